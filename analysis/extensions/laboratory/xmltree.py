"""An XML file as a tree of elements that know their line and column.

Files come from elsewhere: a document type, which could declare entities that expand without bound
or name other files, is refused, as is what is larger or deeper than any report of measurements.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from ballplate.simulator.inputs import (
    ExperimentError,
    GivenText,
    Mark,
    read_bytes,
    refused,
    shorten,
)

MOST_XML_BYTES = 50_000_000
MOST_ELEMENTS = 500_000
DEEPEST = 100

# Joins namespace and name; no part of either.
_SEPARATOR = " "

# What expat says → what the person who has the file can do about it.
_REMEDIES = {
    "no element found": "the file ends before its first element; it is empty or was cut off",
    "unclosed token": "the file ends within a tag; it was cut off, take a whole copy",
    "mismatched tag": "this closing tag does not match the open element",
    "not well-formed (invalid token)": "a character that XML does not allow here",
    "junk after document element": "the file continues after its last element; remove what follows",
    "undefined entity": "an entity that XML does not know; write the character itself",
    "XML or text declaration not at start of entity": (
        "the line <?xml …?> must be the very first; remove everything before it"
    ),
}


@dataclass(frozen=True, eq=False, slots=True)
class Element:
    """An element: its name without prefix, its namespace, and the pieces of its own text."""

    mark: Mark
    namespace: str
    name: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Its own text without white space about it."""
        return "".join(self.texts).strip()

    def all(self, *names: str) -> Iterator[Element]:
        """Elements at a path of names below this one, in their order."""
        for child in self.children:
            if child.name == names[0]:
                if len(names) == 1:
                    yield child
                else:
                    yield from child.all(*names[1:])

    def first(self, *names: str) -> Element | None:
        """The first element at a path of names below this one, or None."""
        return next(self.all(*names), None)

    def text_at(self, *names: str) -> str:
        """The text of the first element at a path of names, empty where there is none."""
        element = self.first(*names)
        return "" if element is None else element.text

    def walk(self) -> Iterator[Element]:
        """This element and all below it, in their order."""
        elements_left = [self]
        while elements_left:
            element = elements_left.pop()
            yield element
            elements_left += reversed(element.children)


def read_xml(path: Path | GivenText) -> Element:
    """The root of an XML file; see ``parse_xml``.

    :raises ExperimentError: the file cannot be read or is refused.
    """
    encoding = "utf-8" if isinstance(path, GivenText) else None
    return parse_xml(read_bytes(path), str(path), encoding)


def parse_xml(content: bytes, file: str, encoding: str | None = None) -> Element:
    """The root of an XML document in the encoding that it declares, or the one that is given;
    ``file`` is named in messages.

    :raises ExperimentError: it is not well-formed, has a document type, an encoding that is not
        known, more than `MOST_XML_BYTES`, more than `MOST_ELEMENTS` or is deeper than `DEEPEST`.

    >>> root = parse_xml(b'<a xmlns="urn:b"><c unit="mm"> 1 </c></a>', "example")
    >>> root.namespace, root.text_at("c"), root.first("c").mark.column
    ('urn:b', '1', 18)
    """
    if len(content) > MOST_XML_BYTES:
        raise refused(file, f"has more than {MOST_XML_BYTES // 10**6} MB; leave some of it out")
    builder = _Builder(file, encoding)
    try:
        builder.parser.Parse(content, True)
    except expat.ExpatError as error:
        words = expat.ErrorString(error.code)
        text = f"not well-formed XML: {_REMEDIES.get(words, words)}"
        if words == "no element found" and builder.open:
            text = (
                f"the file ends within <{shorten(builder.open[-1].name)}>; it was cut off, take a"
                " whole copy"
            )
        raise refused(file, text, line=error.lineno, column=error.offset + 1) from None
    except (LookupError, ValueError) as error:
        text = f"the encoding cannot be read ({error}); save the file with the encoding UTF-8"
        raise refused(file, text, line=1) from None
    return builder.roots[0]


class _Builder:
    """Makes the tree of what a parser says."""

    def __init__(self, file: str, encoding: str | None) -> None:
        self.file = file
        self.open: list[Element] = []
        self.roots: list[Element] = []
        self.count = 0
        self.parser = expat.ParserCreate(encoding, _SEPARATOR)
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.parser.StartDoctypeDeclHandler = self._refuse_type

    def _mark(self) -> Mark:
        return Mark(self.file, self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1)

    def _refuse(self, text: str) -> ExperimentError:
        return self._mark().refused(text)

    def _refuse_type(self, *_: object) -> None:
        text = "a document type (<!DOCTYPE …>) is not read, nor any entity of it; remove it"
        raise self._refuse(text)

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self.count += 1
        if self.count > MOST_ELEMENTS:
            raise self._refuse(f"more than {MOST_ELEMENTS} elements; leave some out")
        if len(self.open) >= DEEPEST:
            raise self._refuse(f"elements within each other more than {DEEPEST} deep")
        namespace, _, local = name.rpartition(_SEPARATOR)
        plain_attributes = {
            key.rpartition(_SEPARATOR)[2]: value for key, value in attributes.items()
        }
        element = Element(self._mark(), namespace, local, plain_attributes)
        (self.open[-1].children if self.open else self.roots).append(element)
        self.open.append(element)

    def _end(self, _: str) -> None:
        self.open.pop()

    def _text(self, text: str) -> None:
        if self.open:
            self.open[-1].texts.append(text)
