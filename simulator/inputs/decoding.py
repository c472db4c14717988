"""Decoding of text files in stated or detected encodings."""

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
# Tried in this order without a mark; latin-1 has a letter for every byte.
UNMARKED = (("utf-8", "UTF-8"), ("cp1252", "cp1252"), ("latin-1", "latin-1"))
# First bytes of files that hold no text: workbooks, archives, documents.
BINARY_FILES = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"%PDF", b"\x1f\x8b")
# Rich text begins so, in any encoding, perhaps behind a byte-order mark or blanks.
RICH_TEXT = re.compile(rb"(?:[\xef\xbb\xbf\xff\xfe\s]|\0)*\{\0*\\\0*u?\0*r\0*t\0*f", re.IGNORECASE)
CONTROL = re.compile("[\x00-\x08\x0b\x0e-\x1f\x7f]")
LINE_END = re.compile("\r\n|\r|\n")
# DOS's last character of a text.
END_OF_FILE = "\x1a"
# Characters of a line: room for a thousand columns, or for thousands of positions.
MOST_IN_LINE = 1_000_000


def decoded(content: bytes, file: object, encoding: str | None = None) -> tuple[str, str]:
    """Return the text of a file's content, and the encoding's name, stated or detected.

    Without a byte-order mark, the text is UTF-8 if it decodes, UTF-16 if every other byte is zero,
    and otherwise cp1252. Zero bytes at the end, with which some programs fill a file, are left out.

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
    """Return the text as `decoded`, with lines of any length and a trailing `END_OF_FILE`."""
    refuse_binary(content, file)
    if encoding is not None:
        marked = next((name for mark, name, _ in MARKS if content.startswith(mark)), "")
        # The codec of the mark removes it.
        used = marked if marked[:6] == codecs.lookup(encoding).name[:6] else encoding
        try:
            return content.decode(used).rstrip("\0"), encoding
        except UnicodeError:
            text = f"is not in the encoding {encoding}; correct readings.encoding, or leave it out"
            raise refused(file, text) from None
    candidates = [(name, label) for mark, name, label in MARKS if content.startswith(mark)][:1]
    for name, label in candidates or _by_zeros(content) or UNMARKED:
        try:
            text = content.decode(name).rstrip("\0")
        except UnicodeError:
            continue
        if "\0" not in text:
            return text, label
        refuse_controls(text, file)
    raise refused(
        file, "is no text in any encoding known; take a whole copy of it, or save it as UTF-8"
    )


def refuse_binary(content: bytes, file: object) -> None:
    """Refuse the content of a workbook, of rich text and the like.

    :raises ExperimentError: it is one.
    """
    if content.startswith(BINARY_FILES):
        text = "is a workbook, an archive or a document, and no text; save its table as CSV"
        raise refused(file, text)
    if RICH_TEXT.match(content):
        text = "is rich text (RTF), whatever its name; save it as plain text, in the program or a"
        raise refused(file, f"{text} text editor, or copy its table into a .txt file")


def refuse_long_lines(text: str, file: object) -> None:
    """Refuse a line of more than `MOST_IN_LINE` characters, in time proportional to the text.

    :raises ExperimentError: it has one.
    """
    start = 0
    while len(text) - start > MOST_IN_LINE:
        end = max(text.rfind(mark, start, start + MOST_IN_LINE + 1) for mark in "\n\r")
        if end < 0:
            line = sum(1 for _ in LINE_END.finditer(text, 0, start)) + 1
            fact = f"has more than {MOST_IN_LINE} characters in a line; break it into several"
            raise refused(file, fact, line=line)
        start = end + 1


def refuse_controls(text: str, file: object) -> None:
    """Refuse text with control characters, except those that separate words, lines and pages.

    :raises ExperimentError: the text is damaged or of a binary file.
    """
    control = CONTROL.search(text)
    if control is not None:
        line = len(LINE_END.findall(text, 0, control.start())) + 1
        fact = f"the control character U+{ord(control[0]):04X} is not allowed in a text"
        raise refused(file, f"{fact}; take a whole copy of the file", line=line)


def _by_zeros(content: bytes) -> list[tuple[str, str]]:
    """Return UTF-16 if a quarter of its letters have a zero byte, as western ones have."""
    text = content.rstrip(b"\0")
    high, low = text[1::2].count(0), text[::2].count(0)
    if len(content) % 2 or 8 * max(high, low) < max(len(text), 1):
        return []
    return [("utf-16-le" if high > low else "utf-16-be", "UTF-16")]
