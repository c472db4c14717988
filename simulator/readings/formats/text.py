"""Text of a report in whatever encoding its program writes."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ...inputs.messages import ExperimentError, Message, refused
from ...inputs.yamltree import Mark

BYTE_ORDER_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}
# Form feeds part pages; DOS ends a file with Ctrl-Z.
CONTROL = re.compile("[\x00-\x08\x0b\x0e-\x19\x1b-\x1f\x7f]")
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


def decode(content: bytes, file: str) -> tuple[str, tuple[str, ...]]:
    """Characters of a text file, and a remark where its encoding was guessed.

    :raises ExperimentError: it holds what is no text.
    """
    remarks: tuple[str, ...] = ()
    encoding = next(
        (name for mark, name in BYTE_ORDER_MARKS.items() if content.startswith(mark)), "utf-8"
    )
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError:
        if encoding != "utf-8":
            raise refused(file, "is damaged: not all of it is text; take a whole copy") from None
        try:
            text = content.decode("cp1252")
        except UnicodeDecodeError:
            text = content.decode("latin-1")
        remarks = (f"{file}: not UTF-8; read as Windows-1252",)
    control = CONTROL.search(text)
    if control is not None:
        line = len(LINE_END.findall(text, 0, control.start())) + 1
        told = f"the character U+{ord(control[0]):04X} is no part of a text; take a whole copy"
        raise ExperimentError([Message(file, line, 1, "", told)])
    return text.rstrip("\x1a"), remarks


def read_lines(content: bytes, file: str) -> Text:
    """Lines of a text file.

    :raises ExperimentError: it holds what is no text.
    """
    text, remarks = decode(content, file)
    lines = LINE_END.split(text)
    is_cut = bool(lines[-1].strip())
    return Text(file, tuple(lines), remarks, is_cut)
