"""Standard output and standard error of a command: readers that leave early, disks that are full,
streams closed.
"""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any


class StandardOutputError(Exception):
    """Standard output cannot be written; the text is the system's reason.

    It is not an OSError, which would be reported as one of a file, and which some libraries
    ignore.
    """


# What writes to the console of Windows.
_CONSOLE: Any = getattr(io, "_WindowsConsoleIO", io.FileIO)


@contextmanager
def lasting_streams() -> Iterator[None]:
    """Let a command finish regardless of the reader of its output, so that its files and its
    status are its own.

    If a reader of standard output such as ``head`` has left, further output is dropped. Any other
    error of standard output is raised once as StandardOutputError, at the first output if the
    stream was closed beforehand. Errors of standard error are ignored, since no stream remains for
    them.
    """
    before = sys.stdout, sys.stderr
    sys.stdout = _lasting(sys.stdout, 1, is_told=True)
    sys.stderr = _lasting(sys.stderr, 2, is_told=False)
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            with suppress(StandardOutputError, OSError, ValueError):
                stream.flush()
        sys.stdout, sys.stderr = before


def keep_standard_numbers() -> None:
    """Open the null device as replacement of closed standard streams.

    Otherwise files opened later would take their numbers, here or in workers, and receive the
    output of libraries and the interpreter.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(number, True)
    os.close(number)


def _lasting(stream: Any, number: int, is_told: bool) -> Any:
    """Return the stream with errors handled, or unchanged if it is not the interpreter's own."""
    if stream is None:
        closed = io.BufferedWriter(_Lasting(None, number, is_told))
        return io.TextIOWrapper(closed, encoding="utf-8", errors="replace", line_buffering=True)
    buffer = getattr(stream, "buffer", None)
    raw = getattr(buffer, "raw", buffer)
    if not isinstance(raw, io.FileIO | _CONSOLE):
        return stream
    with suppress(OSError):
        stream.flush()
    lasting = _Lasting(raw, number, is_told)
    return io.TextIOWrapper(
        # Where Python was told not to buffer, there is none between text and file.
        lasting if raw is buffer else io.BufferedWriter(lasting),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


class _Lasting(io.RawIOBase):
    """Passes bytes on until that fails for the first time, and drops them from then on."""

    def __init__(self, raw: io.RawIOBase | None, number: int, is_told: bool) -> None:
        self._raw, self._number, self._is_told = raw, number, is_told
        self._has_failed = False

    def write(self, data: Any) -> int | None:
        if self._has_failed:
            return len(data)
        try:
            if self._raw is None:
                raise OSError(errno.EBADF, os.strerror(errno.EBADF))
            return self._raw.write(data)
        except OSError as error:
            self._has_failed = True
            # Windows tells by EINVAL that the other end of a pipe is closed.
            has_left = (
                isinstance(error, BrokenPipeError)
                or os.name == "nt"
                and error.errno == errno.EINVAL
            )
            if self._is_told and not has_left:
                raise StandardOutputError(error.strerror) from None
            return len(data)

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._number if self._raw is None else self._raw.fileno()

    def isatty(self) -> bool:
        return self._raw is not None and self._raw.isatty()
