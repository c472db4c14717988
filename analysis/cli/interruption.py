"""An interruption from the keyboard (SIGINT), answered wherever it comes."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def interruptions() -> Iterator[Callable[[], None]]:
    """Remember interruptions; the function yielded raises KeyboardInterrupt if there was one.

    It is for long work to call now and then: an interruption that comes in a place that lets no exception out, such as
    a finaliser or a library's callback, would go unanswered. A process that was started with interruptions ignored, as
    shells start those in the background, goes on ignoring them.
    """
    came = False

    def interrupt(*_: object) -> None:
        nonlocal came
        came = True
        raise KeyboardInterrupt

    def answer() -> None:
        if came:
            raise KeyboardInterrupt

    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_IGN or threading.current_thread() is not threading.main_thread():
        yield answer
        return
    signal.signal(signal.SIGINT, interrupt)
    try:
        yield answer
    finally:
        signal.signal(signal.SIGINT, before)
