"""Errors of files for people at a terminal: each with its line and a mark at the column."""

from __future__ import annotations

import os
import re
import shutil
import sys
from argparse import Namespace
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, TextIO
from unicodedata import combining, east_asian_width

if TYPE_CHECKING:
    from ballplate.simulator.inputs.messages import Message

# What ends a line of a YAML file.
LINE_END = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
# Larger files are not read again for the sake of a line.
MOST_BYTES = 10_000_000
# Columns of a terminal that are left of what an excerpt shows.
INDENT = 4
RED, PLAIN = "\x1b[31m", "\x1b[0m"


def has_colour(stream: TextIO, environment: Mapping[str, str] = os.environ) -> bool:
    """True for colour: by NO_COLOR and FORCE_COLOR if not empty, otherwise on a terminal that
    supports it.

    Some consoles of Windows interpret the sequences only on request.
    """
    if environment.get("NO_COLOR"):
        return False
    if environment.get("FORCE_COLOR"):
        return True
    return stream.isatty() and os.name != "nt" and environment.get("TERM") != "dumb"


def print_errors(messages: Iterable[Message], options: Namespace) -> None:
    """Print errors on standard error, a line each; at a terminal, and with --verbose, with the
    lines of the files.
    """
    with_lines = options.verbose or sys.stderr.isatty()
    colour = has_colour(sys.stderr) if with_lines else False
    files = {}
    for message in messages:
        print(message, file=sys.stderr)
        if not with_lines or not message.line:
            continue
        if message.file not in files:
            files[message.file] = _lines(Path(message.file))
        lines = files[message.file]
        if message.line <= len(lines):
            shown, mark = excerpt(
                lines[message.line - 1], message.column, shutil.get_terminal_size().columns
            )
            print(shown, file=sys.stderr)
            print(f"{RED}{mark}{PLAIN}" if colour else mark, file=sys.stderr)


def _lines(path: Path) -> list[str]:
    try:
        if not path.is_file() or path.stat().st_size > MOST_BYTES:
            return []
        return LINE_END.split(path.read_bytes().decode("utf-8-sig", "replace"))
    except (OSError, ValueError):
        return []


def excerpt(line: str, column: int, width: int) -> tuple[str, str]:
    """A line, or what of it has room in `width` around a column that counts from 1, and a line that
    marks the column.

    >>> print(*excerpt("  repeatability: 1 parsec", 18, 80), sep="\\n")
          repeatability: 1 parsec
                         ^
    """
    from ballplate.simulator.inputs.messages import in_one_line

    room = max(width - INDENT - 1, 10)
    column_index = min(max(column - 1, 0), len(line))
    far = max(column_index - room, 0)
    # Each character as it is shown, so that the mark stands below the right one.
    shown = [
        " " if character == "\t" else in_one_line(character)
        for character in f"{line} "[far : column_index + room]
    ]
    column_index -= far
    start = 0
    while sum(map(_columns, shown[start : column_index + 1])) > max(
        room // 2, room - sum(map(_columns, shown[column_index + 1 :]))
    ):
        start += 1
    end = len(shown)
    while end > column_index + 1 and sum(map(_columns, shown[start:end])) > room:
        end -= 1
    indent = " " * INDENT
    return (indent + "".join(shown[start:end])).rstrip(), indent + " " * sum(
        map(_columns, shown[start:column_index])
    ) + "^"


def _columns(text: str) -> int:
    """Return the number of terminal columns of a text."""
    return sum(
        0 if combining(character) else 2 if east_asian_width(character) in "FW" else 1
        for character in text
    )
