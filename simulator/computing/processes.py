"""Processes and their threads, so that the same seed gives the same bits whatever their number.

The matrices of an elimination have about a hundred columns. Several threads save little time on an
idle machine and lose a hundredfold on a busy one, where the threads wait for each other; and the
order of summation, with it the last bits of every result, would depend on their number.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from copy import deepcopy
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

from ballplate.simulator.inputs.module_finder import OwnModules, own_modules
from threadpoolctl import ThreadpoolController

from .signals import SAFE_PATH, interruptions_blocked

Result = TypeVar("Result")

# Seconds between two looks of a worker at whether the process that started it still runs.
PARENT_INTERVAL = 1.0

# The name of joblib's threads that manage processes, and the seconds that one has to end.
MANAGER, MANAGER_LIMIT = "ExecutorManagerThread", 0.2


def in_processes(
    function: Callable[..., Result],
    arguments: Iterable[tuple[Any, ...]],
    workers: int,
    ordered: bool = True,
    batch_size: int | str = 1,
) -> Iterator[Result]:
    """Yield results of a function, called with each of the arguments in one of several processes;
    one worker is this process.

    They come in the order of the arguments, or as completed. An early end also ends the workers,
    and so does, within seconds, any end of this process.

    >>> list(in_processes(pow, [(2, 3), (2, 4)], workers=1))
    [8, 16]
    """
    if workers == 1:
        for argument in arguments:
            yield function(*argument)
        return
    with safe_path():
        from joblib import Parallel, delayed

        kind = "generator" if ordered else "generator_unordered"
        parallel = Parallel(
            n_jobs=workers,
            return_as=kind,
            pre_dispatch="2*n_jobs",
            batch_size=batch_size,
            initializer=begin_worker,
            initargs=(os.getpid(), deepcopy(own_modules())),
        )
        results = None
        finished = False
        try:
            with _signals_held():
                results = parallel(delayed(function)(*argument) for argument in arguments)
            # Not `yield from`, which would end the workers before the warning below is silenced.
            for result in results:  # noqa: UP028
                yield result
            finished = True
        finally:
            if not finished and results is not None:
                # Nobody waits for what is under way; a run that has ended early ends at once, and
                # says so itself.
                with warnings.catch_warnings(), _managers_silenced():
                    warnings.simplefilter("ignore", UserWarning)
                    results.close()


@contextmanager
def safe_path() -> Iterator[None]:
    """Let no Python process that starts meanwhile look for modules in the current folder first:
    files there with names of modules are not meant for it.
    """
    before = os.environ.get(SAFE_PATH, "")
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        # An empty one is none.
        os.environ[SAFE_PATH] = before


@contextmanager
def _managers_silenced() -> Iterator[None]:
    """Let threads that manage processes end without a traceback: a task withdrawn during their
    work is not an error.

    Joblib's may look for a task that was just withdrawn.
    """
    before = threading.excepthook

    def tell(arguments: threading.ExceptHookArgs) -> None:
        if arguments.thread is None or arguments.thread.name != MANAGER:
            before(arguments)

    threading.excepthook = tell
    try:
        yield
        for thread in threading.enumerate():
            if thread.name == MANAGER:
                thread.join(MANAGER_LIMIT)
    finally:
        threading.excepthook = before


def begin_worker(parent: int, modules: OwnModules | None = None) -> None:
    """Prepare a process that works for another: it ends with that one, which alone answers
    interruptions, and finds its `modules`.

    An interruption from the keyboard reaches every process of the terminal.
    """
    if modules is not None:
        sys.meta_path.append(modules)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    if sys.platform == "win32":
        import _winapi

        synchronize = 0x00100000
        # There is an error where it has ended already.
        with suppress(OSError):
            _winapi.WaitForSingleObject(
                _winapi.OpenProcess(synchronize, False, parent), _winapi.INFINITE
            )
    else:
        while os.getppid() == parent:
            time.sleep(PARENT_INTERVAL)
    os._exit(1)


@contextmanager
def _signals_held() -> Iterator[None]:
    """Answer signals at the end; processes started meanwhile never see one from the keyboard.

    An exception during the start of processes would leave orphans.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pending = []
    before = {}
    for number in (signal.SIGINT, signal.SIGTERM):
        handler = signal.getsignal(number)
        if callable(handler):
            before[number] = handler
            signal.signal(number, lambda *arrived: pending.append(arrived))
    try:
        _start_trackers()
        with interruptions_blocked():
            yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if pending:
            first, frame = pending[0]
            before[signal.Signals(first)](first, frame)


def _start_trackers() -> None:
    """Start the processes that remove shared memory after this one has ended.

    They accept interruptions when they start, and print the names they remove if this process was
    killed.
    """
    from joblib.externals.loky.backend import resource_tracker as of_joblib

    sys.warnoptions.append("ignore:resource_tracker:UserWarning")
    try:
        of_joblib.ensure_running()
        if sys.platform != "win32":
            from multiprocessing import resource_tracker

            resource_tracker.ensure_running()
    finally:
        sys.warnoptions.remove("ignore:resource_tracker:UserWarning")


def processors() -> int:
    """Number of processors that this process may use."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed is not None else os.cpu_count() or 1


P = ParamSpec("P")
R = TypeVar("R")

SCIPY = "scipy.linalg"

# What the outermost single-threaded function under way restores at its end.
_under_way: ContextVar[ExitStack | None] = ContextVar("_under_way", default=None)


@cache
def _controller(with_scipy: bool) -> ThreadpoolController:
    """The libraries that are loaded: SciPy brings one of its own."""
    return ThreadpoolController()


def single_threaded(function: Callable[P, R]) -> Callable[P, R]:
    """Run a function with one thread of linear algebra, and restore the earlier setting.

    Functions that it calls import SciPy's linear algebra by `scipy_linalg`, if it is not loaded
    from the start.
    """

    @wraps(function)
    def limited(*arguments: P.args, **named: P.kwargs) -> R:
        if _under_way.get() is not None:
            return function(*arguments, **named)
        with ExitStack() as stack:
            stack.enter_context(_controller(SCIPY in sys.modules).limit(limits=1, user_api="blas"))
            token = _under_way.set(stack)
            try:
                return function(*arguments, **named)
            finally:
                _under_way.reset(token)

    return limited


def scipy_linalg() -> Any:
    """Return the module scipy.linalg, loaded on first use, and on one thread within a
    single-threaded function.
    """
    is_new = SCIPY not in sys.modules
    import scipy.linalg

    stack = _under_way.get()
    if is_new and stack is not None:
        stack.enter_context(_controller(True).limit(limits=1, user_api="blas"))
    return scipy.linalg
