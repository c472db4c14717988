"""Experiment files: their keys, loading, and messages about errors in them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .bounds import (
        EDGE,
        OUTSIDE,
        TOLERANCE,
        Bounds,
        edge_of,
        entered,
        limits_of,
        occupied,
        shared,
    )
    from .calibrations import resolve_calibration
    from .changes import node_of
    from .inside_checks import check_inside
    from .json_schema import DRAFT, schema, tidied
    from .layout import lay_out
    from .loading import build, load, trees_of, with_pool
    from .model import (
        AtMost,
        Candidate,
        ChangeTimes,
        Experiment,
        Pool,
        Position,
        Prior,
        Probe,
        ReadingGroup,
    )
    from .modules import python_models, runs_code
    from .name_rules import PLACE, check_rule
    from .named_files import (
        existing_file,
        files_of_machine,
        is_rooted,
        keyed_paths,
        model_modules,
        module_files,
        named_in,
    )
    from .own_sections import check_installed
    from .placements import check_turns, resolve_position
    from .pool import placed_only, with_chosen
    from .pool_sections import (
        GroupSettings,
        LimitsSettings,
        ListedSettings,
        OwnTimesSettings,
        PlacesByAxis,
        PoolSettings,
        RangeSettings,
        SelectorSettings,
        TimesSettings,
        is_group,
    )
    from .position_sections import Edges
    from .readings_section import (
        ColumnsSettings,
        CompensationSettings,
        Coordinate,
        ReadingsSettings,
    )
    from .sections import Line, MapPriorSettings, Seed, VolumeSettings
    from .size_checks import check_lengths
    from .spans import unspanned
    from .structure import Sections
    from .variants import (
        is_same_place,
        node_at,
        override,
        place_of,
        variant_trees,
    )
    from .volumes import check_ends

__getattr__, __dir__ = lazily(__name__, __file__)
