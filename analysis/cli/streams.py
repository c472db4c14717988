"""Standard streams that fail, and signals that ask a command to end."""

from __future__ import annotations

import errno
import io
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from types import FrameType
from typing import Any

from ballplate.simulator.computing.signals import ANSWERS


class StandardOutputError(Exception):
    """Standard output cannot be written; the text is the system's reason.

    It is not an OSError, which would be reported as one of a file.
    """


class _Lasting(io.FileIO):
    """Writes until the reader has left or the disk is full, and then to the null device."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError as error:
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            # Windows reports a reader that has left as EINVAL.
            if error.errno not in (errno.EPIPE, errno.EINVAL):
                raise StandardOutputError(error.strerror) from None
            return len(data)


@contextmanager
def lasting_streams() -> Iterator[None]:
    """Let a command finish regardless of the reader of its output, so that its files and its
    status are its own, and print every character.

    The null device replaces closed streams, whose numbers files opened later would take. Pipes and
    files are UTF-8; a terminal of another encoding shows the numbers of characters that it lacks.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            replacement = open(os.devnull, mode, encoding="utf-8")  # noqa: SIM115
            # Workers inherit it.
            os.set_inheritable(replacement.fileno(), True)
            setattr(sys, name, replacement)
    before = sys.stdout
    with suppress(OSError):
        # Fails for a stream that is no file.
        raw = _Lasting(sys.stdout.fileno(), "w", closefd=False)
        sys.stdout.flush()
        sys.stdout = io.TextIOWrapper(io.BufferedWriter(raw), line_buffering=raw.isatty())
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            if stream.isatty():
                stream.reconfigure(errors="backslashreplace")
            else:
                stream.reconfigure(encoding="utf-8", errors="backslashreplace", newline="\n")
    try:
        yield
    finally:
        sys.stdout, written = before, sys.stdout
        with suppress(StandardOutputError):
            written.flush()


# Seconds within which signals count as one.
SAME_SIGNAL = 0.5


@dataclass
class Interruption:
    """The signal that came, and a function that returns what is kept if the command ends now."""

    came: str = ""
    at: float = 0.0
    kept: Callable[[], str] = str

    def handle(self, number: int, _: FrameType | None) -> None:
        """Raise KeyboardInterrupt at the first signal, and end the process at a later one."""
        if not self.came:
            self.came, self.at = signal.Signals(number).name, time.monotonic()
            raise KeyboardInterrupt
        # Programs in between, such as `timeout`, send what the terminal sends too.
        if time.monotonic() > self.at + SAME_SIGNAL:
            self.tell()
            os._exit(self.status)

    def answer(self) -> None:
        """Raise KeyboardInterrupt after a signal whose exception a library has caught."""
        if self.came:
            raise KeyboardInterrupt

    def tell(self) -> None:
        """Report on standard error that the command has ended, and what it keeps."""
        kept = self.kept()
        print(f"{self.word}; {kept}" if kept else self.word, file=sys.stderr, flush=True)

    @property
    def status(self) -> int:
        return ANSWERS[self.came or "SIGINT"][0]

    @property
    def word(self) -> str:
        return ANSWERS[self.came or "SIGINT"][1]
