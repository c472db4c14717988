"""Readings: simulated, read from files, and checked for gross errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .certificate_files import certified_values, headings
    from .coordinate_kinds import controller_offsets
    from .generate import NoReadingError, exact_readings, true_readings
    from .observed_readings import ObservedReadings
    from .point_files import (
        NAMING,
        PROBE,
        GivenPoints,
        ensure_points,
        probe_places,
        read_pairs,
        read_points,
    )
    from .reading_files import AXES, read_readings
    from .reading_sources import Source, SourceRows, SourceText, Units, is_plain, plain_rows
    from .readings_in_common import (
        position_fingerprints,
        read_once_words,
        same_positions,
        same_readings,
    )
    from .simulated import on_stated_machine

__getattr__, __dir__ = lazily(__name__, __file__)
