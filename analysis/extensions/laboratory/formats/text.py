"""Text of a report in whatever encoding its program writes."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ballplate.simulator.inputs import Mark, decoded, refuse_controls

# Form feeds part pages.
LINE_END = re.compile("\r\n|\r|\n|\x0c")


@dataclass(frozen=True)
class Text:
    """Lines of a file, and how it was read where that is not as UTF-8.

    `is_cut` tells that the last line has no end: a number there may lack digits.
    """

    file: str
    lines: tuple[str, ...]
    remarks: tuple[str, ...]
    is_cut: bool

    def mark(self, number: int, column: int = 1) -> Mark:
        """The place of a line, counted from 1."""
        return Mark(self.file, number, column)


def read_lines(content: bytes, file: str) -> Text:
    """Lines of a text file.

    :raises ExperimentError: it holds what is no text.
    """
    text, encoding = decoded(content, file)
    refuse_controls(text, file)
    lines = LINE_END.split(text)
    is_guess = not encoding.startswith("UTF")
    remarks = (f"{file}: not UTF-8; read as {encoding}",) if is_guess else ()
    return Text(file, tuple(lines), remarks, is_cut=bool(lines[-1].strip()))
