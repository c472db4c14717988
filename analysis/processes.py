"""Work spread over processes of this machine."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
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
    results: Generator[Result, None, None] | None = None
    finished = False
    try:
        with _interruptions_held():
            results = parallel(delayed(_deaf)(function, own) for own in arguments)
        # Not `yield from`, which would end the workers before the warning below is silenced.
        for result in results:  # noqa: UP028
            yield result
        finished = True
    finally:
        if not finished and results is not None:
            # Nobody waits for what is under way; a run that has ended early ends at once, and says so itself.
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)
                results.close()


@contextmanager
def _interruptions_held() -> Iterator[None]:
    """Answer an interruption from the keyboard at the end; processes started meanwhile never see one.

    It reaches every process of the terminal, also those that have only begun to load what `_deaf` needs.
    """
    import signal

    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    from multiprocessing import resource_tracker

    # Its start, which comes with that of the first process, would let interruptions in again.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


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
