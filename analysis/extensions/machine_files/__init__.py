"""Machines from files: described errors, measured curves, and maps of fits, which are written and
loaded here; as true machines, error models, corrections of a controller and prior knowledge.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs import lazily

# What other extensions build on.
if TYPE_CHECKING:
    from .curves import Points
    from .description import (
        Combination,
        MachineDescription,
        ParametricError,
        PowerSeries,
        reference_functions,
        true_volumetric,
    )
    from .error_tables import parse_line, parse_point
    from .fitted_map import FittedMap, InCommon, readings_in_common
    from .interface import fit_map_or_path, fitted_map_of, map_or_path
    from .machine_file import load_machine
    from .map_files import is_map_file, read_map
    from .map_of_fit import data_of, left_out_words
    from .sigmas_by_campaign import campaign_sigmas, with_sigmas
    from .volumetric import VolumetricModel, meaning, squareness_field, thermal_field

__getattr__, __dir__ = lazily(__name__, __file__)
