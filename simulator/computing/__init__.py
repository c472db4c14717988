"""Threads, processes, memory, progress and rounding of computations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .decompositions import eigh, eigvalsh, lstsq, pinv, svd
    from .internal_error import InternalError
    from .library_versions import versions
    from .memory import want_of_memory
    from .processes import begin_worker, in_processes, interruptions_blocked, processors, safe_path
    from .rounding import TOUCHED, blank, comparable, first_largest, first_largest_of_columns
    from .spreading import evenly_spread
    from .steps import EnoughError, ProgressStep, Report, counted, unreported
    from .threads import scipy_linalg, single_threaded

__getattr__, __dir__ = lazily(__name__, __file__)
