"""Text of a report in the encoding of its program."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ballplate.simulator.inputs import Mark, decoded, refuse_controls

# Form feeds part pages.
LINE_END = re.compile("\r\n|\r|\n|\x0c")


@dataclass(frozen=True)
class Text:
    """Lines of a file, and its encoding if that is not UTF-8.

    `is_cut` is true if the last line has no end: a number there may lack digits.
    """

    file: str
    lines: tuple[str, ...]
    remarks: tuple[str, ...]
    is_cut: bool

    def mark(self, number: int, column: int = 1) -> Mark:
        """Return the location of a line, counted from 1."""
        return Mark(self.file, number, column)


def read_lines(content: bytes, file: str) -> Text:
    """Return lines of a text file.

    :raises ExperimentError: it is not text.
    """
    text, encoding = decoded(content, file)
    refuse_controls(text, file)
    lines = LINE_END.split(text)
    is_cut, remarks = bool(lines[-1].strip()), []
    if not encoding.startswith("UTF"):
        remarks.append(f"{file}: not UTF-8; read as {encoding}")
    if is_cut:
        remarks.append(f"{file}: the last line has no end; the file may have been cut off")
    return Text(file, tuple(lines), tuple(remarks), is_cut)
