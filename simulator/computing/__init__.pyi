# Public names of this package, each loaded from its module when it is first used.
from .decompositions import (
    eigh as eigh,
    eigvalsh as eigvalsh,
    lstsq as lstsq,
    pinv as pinv,
    svd as svd,
)
from .internal_error import InternalError as InternalError
from .library_versions import versions as versions
from .memory import want_of_memory as want_of_memory
from .processes import (
    begin_worker as begin_worker,
    in_processes as in_processes,
    interruptions_blocked as interruptions_blocked,
    processors as processors,
    safe_path as safe_path,
)
from .rounding import (
    TOUCHED as TOUCHED,
    blank as blank,
    comparable as comparable,
    first_largest as first_largest,
    first_largest_of_columns as first_largest_of_columns,
)
from .spreading import evenly_spread as evenly_spread
from .steps import (
    EnoughError as EnoughError,
    ProgressStep as ProgressStep,
    Report as Report,
    counted as counted,
    unreported as unreported,
)
from .threads import scipy_linalg as scipy_linalg, single_threaded as single_threaded
