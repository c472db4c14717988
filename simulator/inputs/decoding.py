"""Text of a file in the encoding that it has."""

from __future__ import annotations

import codecs
import re

from .messages import refused

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig", "UTF-8"),
    (codecs.BOM_UTF32_LE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF32_BE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF16_LE, "utf-16", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16", "UTF-16"),
)
# Without a mark, in this order; the last of them has a letter for every byte.
UNMARKED = (("utf-8", "UTF-8"), ("cp1252", "cp1252"), ("latin-1", "latin-1"))
# What begins files that hold no text: workbooks, archives, documents.
OTHERS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"%PDF", b"\x1f\x8b")
CONTROL = re.compile("[\x00-\x08\x0b\x0e-\x1f\x7f]")
LINE_END = re.compile("\r\n|\r|\n")
# What DOS writes at the end of a text.
END_OF_FILE = "\x1a"
# Characters of a line: room for a thousand columns, or for thousands of positions.
MOST_IN_LINE = 1_000_000


def decoded(content: bytes, file: object, encoding: str | None = None) -> tuple[str, str]:
    """The text of a file's content, and the name of the encoding: the one stated, or found.

    A file without a mark of its encoding is in UTF-8 if it can be, in UTF-16 if every other byte of
    it is zero, and otherwise in the encoding of western European systems.

    :raises ExperimentError: it is no text, is damaged, is not in the encoding stated, or has too
        long a line.

    >>> decoded("Lage;1,5 µm".encode("cp1252"), "a.csv")
    ('Lage;1,5 µm', 'cp1252')
    >>> decoded("Lage".encode("utf-16"), "a.csv")
    ('Lage', 'UTF-16')
    """
    text, name = text_and_encoding(content, file, encoding)
    refuse_long_lines(text, file)
    return text.rstrip(END_OF_FILE), name


def text_and_encoding(content: bytes, file: object, encoding: str | None = None) -> tuple[str, str]:
    """`decoded`, with lines of any length, as XML has them, and what DOS writes at the end."""
    if content.startswith(OTHERS):
        text = "is a workbook, an archive or a document, and no text; save its table as CSV"
        raise refused(file, text)
    if encoding is not None:
        marked = next((name for mark, name, _ in MARKS if content.startswith(mark)), "")
        # With its mark, which is no letter of the text.
        used = marked if marked[:6] == codecs.lookup(encoding).name[:6] else encoding
        try:
            return content.decode(used), encoding
        except UnicodeError:
            text = f"is not in the encoding {encoding}; correct readings.encoding, or leave it out"
            raise refused(file, text) from None
    found = [(name, told) for mark, name, told in MARKS if content.startswith(mark)][:1]
    found = found or _by_zeros(content) or list(UNMARKED)
    for name, told in found:
        try:
            text = content.decode(name)
        except UnicodeError:
            continue
        if "\0" not in text:
            return text, told
    raise refused(
        file, "is no text in any encoding known; take a whole copy of it, or save it as UTF-8"
    )


def refuse_long_lines(text: str, file: object) -> None:
    """Refuse a line of more than `MOST_IN_LINE` characters, in time in proportion to the text.

    :raises ExperimentError: it has one.
    """
    start = 0
    while len(text) - start > MOST_IN_LINE:
        end = max(text.rfind(mark, start, start + MOST_IN_LINE + 1) for mark in "\n\r")
        if end < 0:
            line = sum(1 for _ in LINE_END.finditer(text, 0, start)) + 1
            told = f"has more than {MOST_IN_LINE} characters in a line; break it into several"
            raise refused(file, told, line=line)
        start = end + 1


def refuse_controls(text: str, file: object) -> None:
    """Refuse what has characters that no table or report has, as what is no text or is damaged.

    :raises ExperimentError: it has a control character that parts neither words, lines nor pages.
    """
    control = CONTROL.search(text)
    if control is not None:
        line = len(LINE_END.findall(text, 0, control.start())) + 1
        told = f"the control character U+{ord(control[0]):04X} is no part of a text"
        raise refused(file, f"{told}; take a whole copy of the file", line=line)


def _by_zeros(content: bytes) -> list[tuple[str, str]]:
    """UTF-16 of letters most of which are western: every other byte is zero."""
    if b"\0" not in content or len(content) % 2:
        return []
    high, low = content[1::2].count(0), content[::2].count(0)
    return [("utf-16-le" if high > low else "utf-16-be", "UTF-16")]
