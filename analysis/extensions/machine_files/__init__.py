"""Machines from files: described errors, measured curves and maps, as true machines, and what a map
tells of the machine beforehand.
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
    from .machine_file import load_machine
    from .volumetric import VolumetricModel, meaning, squareness_field, thermal_field

__getattr__, __dir__ = lazily(__name__, __file__)
