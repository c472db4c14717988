# Public names of this package, each loaded from its module when it is first used.
from .numerics import (
    TOUCHED as TOUCHED,
    blank as blank,
    comparable as comparable,
    eigh as eigh,
    eigvalsh as eigvalsh,
    evenly_spread as evenly_spread,
    first_largest as first_largest,
    first_largest_of_columns as first_largest_of_columns,
    lstsq as lstsq,
    pinv as pinv,
    svd as svd,
    symmetric_root as symmetric_root,
    versions as versions,
)
from .processes import (
    begin_worker as begin_worker,
    in_processes as in_processes,
    processors as processors,
    safe_path as safe_path,
    scipy_linalg as scipy_linalg,
    single_threaded as single_threaded,
)
from .signals import interruptions_blocked as interruptions_blocked
from .steps import (
    EnoughError as EnoughError,
    InternalError as InternalError,
    ProgressStep as ProgressStep,
    Report as Report,
    counted as counted,
    unreported as unreported,
    want_of_memory as want_of_memory,
)
