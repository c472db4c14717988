"""The drawings of the documentation are those that their script makes, and tell what the program
computes.
"""

from __future__ import annotations

import importlib.util
import json
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import pytest
from ballplate.cli import main
from ballplate.simulator.machines.arrangement import ARRANGEMENTS

SCRIPT = Path("docs/_extensions/drawings.py")
PICTURES = Path("docs/pictures")
NUMBER = r"-?\d+(?:\.\d+)?"


def script() -> ModuleType:
    specification = importlib.util.spec_from_file_location("drawings", SCRIPT)
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def texts(name: str) -> list[tuple[float, float, str]]:
    """What is written in a drawing, with its place."""
    root = ElementTree.parse(PICTURES / f"{name}.svg").getroot()
    found = root.iter("{http://www.w3.org/2000/svg}text")
    return [(float(one.attrib["x"]), float(one.attrib["y"]), one.text or "") for one in found]


@pytest.mark.parametrize(("name", "draw"), script().DRAWINGS.items())
def test_the_stored_drawing_is_the_one_drawn(name: str, draw: Callable[[], Any]) -> None:
    stored, drawn = (PICTURES / f"{name}.svg").read_text(encoding="utf-8"), draw().svg()
    assert re.sub(NUMBER, "#", stored) == re.sub(NUMBER, "#", drawn)
    values = [[float(value) for value in re.findall(NUMBER, text)] for text in (stored, drawn)]
    # The last digit of a place may differ between processors.
    assert values[0] == pytest.approx(values[1], abs=0.11)


def test_every_drawing_is_shown_with_words_for_those_who_do_not_see_it() -> None:
    pages = [page.read_text(encoding="utf-8") for page in Path("docs").rglob("*.md")]
    for picture in PICTURES.iterdir():
        shown = [
            re.search(rf"{{figure}} \S*{picture.name}\n *:alt: (.+)\n", page) for page in pages
        ]
        assert any(match and len(match[1]) > 40 for match in shown), picture


def test_chains_stand_in_the_drawing_as_in_the_program() -> None:
    written = texts("arrangements")
    names = [one for one in written if one[2] in ARRANGEMENTS]
    assert {name for _, _, name in names} == set(ARRANGEMENTS)
    for left, top, name in names:
        panel = [
            (x - left, y, word)
            for x, y, word in written
            if word in ("x", "y", "z") and 0 <= x - left < 160 and 0 < y - top < 250
        ]
        # From the ground upwards, which is from large y to small ones.
        stacks = [[], []]
        for x, _, word in sorted(panel, key=lambda one: -one[1]):
            stacks[x > 65].append(word)
        arrangement = ARRANGEMENTS[name]
        assert stacks == [list(arrangement.probe_side), list(arrangement.workpiece_side)], name


def test_bars_have_the_figures_of_the_quickstart(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "designs/quickstart.yaml", "--json"]) == 0
    quantities = json.loads(capsys.readouterr().out)["quantities"]
    written = texts("overview")
    rows = {word[:2]: y for _, y, word in written if re.match(r"U\d ", word)}
    assert set(rows) == {"U1", "U4", "U5", "U6"}
    for symbol, height in rows.items():
        beside = [float(word.split()[0]) for _, y, word in written if abs(y - height - 23) < 1]
        exact = [1e6 * quantities[symbol][key] for key in ("average", "maximum")]
        assert beside == pytest.approx(exact, abs=0.0051)
