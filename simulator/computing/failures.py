"""Failures that are not of the input: errors of the program itself, and lack of memory."""

from __future__ import annotations

import errno
import re


class InternalError(Exception):
    """The program has found an error in itself; the message states the contradiction."""


WITH_SIZE = re.compile(r"Unable to allocate ([0-9.]+ [KMGTPE]?i?B|[0-9]+ bytes)")


def want_of_memory(error: BaseException) -> str | None:
    """Return the end of a message about lack of memory, if the error is one."""
    if not isinstance(error, MemoryError) and getattr(error, "errno", None) != errno.ENOMEM:
        return None
    match = WITH_SIZE.search(str(error))
    size = f": there is no room for another {match[1]}" if match else ""
    return f"needs more memory than is available{size}"
