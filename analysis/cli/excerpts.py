"""Errors of files: at a terminal each with its line and a mark at the column."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ballplate.simulator.inputs.messages import Message


def print_errors(messages: Iterable[Message], options: Namespace) -> None:
    """Print errors on standard error, a line each; at a terminal, and with --verbose, with the
    lines of the files.
    """
    from ballplate.simulator.inputs.messages import folded, in_one_line

    with_lines = options.verbose or sys.stderr.isatty()
    for message in folded(messages):
        print(message, file=sys.stderr)
        if with_lines and message.line:
            with suppress(OSError, ValueError, IndexError):
                lines = Path(message.file).read_text(encoding="utf-8-sig").splitlines()
                line = lines[message.line - 1].replace("\t", " ")
                mark = " " * len(in_one_line(line[: message.column - 1]))
                print(f"    {in_one_line(line)}\n    {mark}^", file=sys.stderr)
