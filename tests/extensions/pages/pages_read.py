"""Figures of a page of a result, taken out of it again."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from html.parser import HTMLParser
from typing import Any

VOID = {"meta", "link", "br", "img", "input"}


@dataclass
class Shown:
    """An element that quotes plain data: its attributes, and what it says."""

    attributes: dict[str, str]
    text: str = ""


class ResultPage(HTMLParser):
    """Elements that quote data, cells of tables with what they say besides, and the tags of a
    page.
    """

    def __init__(self, text: str) -> None:
        super().__init__()
        self.shown: list[Shown] = []
        self.cells: list[tuple[dict[str, str], str]] = []
        self.tags: list[tuple[str, dict[str, str]]] = []
        self._open: list[tuple[str, dict[str, str], list[str]]] = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = {name: value or "" for name, value in attrs}
        self.tags.append((tag, attributes))
        if tag not in VOID:
            self._open.append((tag, attributes, []))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {name: value or "" for name, value in attrs}))

    def handle_data(self, data: str) -> None:
        for _, _, texts in self._open:
            texts.append(data)

    def handle_endtag(self, tag: str) -> None:
        name, attributes, texts = self._open.pop()
        assert name == tag
        text = "".join(texts)
        if "data-path" in attributes:
            self.shown.append(Shown(attributes, text))
            # What encloses it says nothing of its own there.
            for _, _, others in self._open:
                del others[len(others) - len(texts) :]
        if tag == "td":
            self.cells.append((attributes, text))


def at(data: Mapping[str, Any], path: str) -> Any:
    """What stands at a path of plain data."""
    found: Any = data
    for step in path.removeprefix("/").split("/"):
        key = step.replace("~1", "/").replace("~0", "~")
        found = found[int(key)] if isinstance(found, list) else found[key]
    return found


def assert_quoted(text: str, data: Mapping[str, Any]) -> int:
    """All figures of a page are those of the data, to the digits that are shown; their number."""
    page = ResultPage(text)
    for one in page.shown:
        value = at(data, one.attributes["data-path"])
        if isinstance(value, str):
            assert one.text == value, one
            continue
        stated = one.attributes.get("value", one.attributes.get("data-value"))
        if value is None:
            assert stated is None and one.text == "undetermined", one
            continue
        assert stated is not None and float(stated) == value, one
        assert _agrees(one.text, value * float(one.attributes.get("data-factor", "1"))), (
            one,
            value,
        )
    for attributes, text in page.cells:
        assert "words" in attributes.get("class", "") or not re.search(r"\d", text), text
    return len(page.shown)


def _agrees(text: str, value: float) -> bool:
    """Whether a number as shown is the value to its last digit; shares are never rounded up."""
    number = text.removesuffix(" %")
    digits = re.fullmatch(r"-?(\d+)(?:\.(\d+))?(?:e([+-]\d+))?", number)
    assert digits is not None, text
    last = 10.0 ** (int(digits[3] or 0) - len(digits[2] or ""))
    if last == 1.0 and len(digits[1]) > 3:
        # Digits beyond those that count are zeros.
        last = 10.0 ** (len(digits[1]) - len(digits[1].rstrip("0")))
    off = value - float(number)
    if number != text:
        return -1e-9 <= off < 0.01 + 1e-9
    return abs(off) <= 0.5000001 * last
