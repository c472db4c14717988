"""Readings: simulated, read from files, and checked for gross errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .fingerprints import fingerprint, position_fingerprints
    from .generate import (
        NoReadingError,
        exact_readings,
        noisy_certificate,
        noisy_readings,
        scale_readings,
    )
    from .given_points import ensure_points, probe_places
    from .joining import joined
    from .observed_readings import ObservedReadings, observe
    from .reading_files import AXES, read_readings
    from .reading_sources import (
        Source,
        SourceRows,
        SourceText,
        Units,
        is_plain,
        named_rows,
        plain_rows,
    )
    from .simulated import Simulated, on_stated_machine, simulated_readings, too_large

__getattr__, __dir__ = lazily(__name__, __file__)
