"""Signals that end a command, and where its processes look for modules; the first module to be
loaded.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

# Exit status and what is told, by signal; SIGBREAK is Ctrl-Break on Windows.
ANSWERS = {
    "SIGINT": (130, "interrupted"),
    "SIGBREAK": (130, "interrupted"),
    "SIGTERM": (143, "terminated"),
}

# The variable with which Python does not look for modules in the current folder first.
SAFE_PATH = "PYTHONSAFEPATH"


@contextmanager
def interruptions_blocked(*others: int) -> Iterator[None]:
    """Block SIGINT, and other signals, until the end; processes started meanwhile inherit it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT, *others])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
