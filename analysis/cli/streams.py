"""Standard streams that are closed, full, without a reader, or of another encoding than UTF-8."""

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
