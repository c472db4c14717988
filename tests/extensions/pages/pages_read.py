"""Figures of a page of a result, taken out of it again."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from html.parser import HTMLParser
from typing import Any

import numpy as np

VOID = {"meta", "link", "br", "img", "input"}
# What lengths, temperatures, shares, angles and expanded uncertainties in SI units are shown times.
FACTORS = (1.0, 1e2, 1e3, 2e3, 1e6, 2e6, 180 * 3600 / np.pi)


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
        factor = float(one.attributes.get("data-factor", "1"))
        assert _agrees(one.text, value * factor) and factor in FACTORS, (one, value)
        # What is as small as metres are is shown in micrometres.
        assert "e-" not in one.text or re.search("p_value|step", one.attributes["data-path"]), one
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


def chart_marks(text: str) -> dict[str, np.ndarray]:
    """Marks of a chart by kind (n, 2) and the frame that holds them (2, 2), in the axes' numbers."""
    label = r'<text x="([-\d.]+)" y="([-\d.]+)" text-anchor="%s">(-?[\d.]+)<'
    across, up = (np.array(re.findall(label % how, text), float) for how in ("middle", "end"))
    of_x, of_y = np.polyfit(across[:, 0], across[:, 2], 1), np.polyfit(up[:, 1] - 3.5, up[:, 2], 1)
    sides = [re.findall(one, text)[0] for one in (r"M(\S+) \S+H([\d.]+)", r"M\S+ (\S+)V([\d.]+)")]
    found = {"frame": (frame := np.array(sides, float).T)}
    for kind, path in re.findall(r'<path class="(dots|line|band) [^"]*" d="(M[^"]*)"', text):
        found[kind] = np.array(re.findall(r"([-\d.]+) ([-\d.]+)", path), float)
        assert ((frame[0] <= found[kind]) & (found[kind] <= frame[1])).all() and (frame > 0).all()
    return {
        kind: np.stack([np.polyval(of_x, x), np.polyval(of_y, y)], axis=1)
        for kind, (x, y) in ((kind, marks.T) for kind, marks in found.items())
    }
