"""Work spread over processes of this machine."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

Result = TypeVar("Result")


def in_processes(
    function: Callable[..., Result],
    arguments: Iterable[tuple[Any, ...]],
    workers: int,
    ordered: bool = True,
    batch_size: int | str = 1,
) -> Iterator[Result]:
    """Results of a function, called with each of the arguments in one of several processes.

    In the order of the arguments, or as they come. An end before the last of them ends the workers as well.
    """
    from joblib import Parallel, delayed

    kind = "generator" if ordered else "generator_unordered"
    parallel = Parallel(n_jobs=workers, return_as=kind, pre_dispatch="2*n_jobs", batch_size=batch_size)
    results = parallel(delayed(_deaf)(function, own) for own in arguments)
    finished = False
    try:
        # Not `yield from`, which would end the workers before the warning below is silenced.
        for result in results:  # noqa: UP028
            yield result
        finished = True
    finally:
        if not finished:
            # Nobody waits for what is under way; a run that has ended early ends at once, and says so itself.
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)
                results.close()


def _deaf(function: Callable[..., Result], arguments: tuple[Any, ...]) -> Result:
    import signal

    # An interruption from the keyboard reaches every process; the one that started the workers answers it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return function(*arguments)


def processors() -> int:
    """Number of processors that this process may use."""
    import os

    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed is not None else os.cpu_count() or 1
