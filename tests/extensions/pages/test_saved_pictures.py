"""Pictures as files of their own."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from ballplate.presentation.svg import drawing, placed_axes, save

pytest.importorskip("matplotlib", reason="pictures need matplotlib")


def drawn(path: Path) -> bytes:
    with drawing(120.0) as figure:
        axes = placed_axes(figure, 40.0, 30.0, 300.0, 80.0)
        axes.plot([0.0, 1.0], [2.0, 3.0])
        axes.set_xlabel("position, mm")
        save(figure, path, "a rising line")
    return path.read_bytes()


@pytest.mark.parametrize(
    ("ending", "start"), [("svg", b"<?xml"), ("PNG", b"\x89PNG"), ("pdf", b"%PDF")]
)
def test_the_same_figure_gives_the_same_bytes(tmp_path: Path, ending: str, start: bytes) -> None:
    found = drawn(tmp_path / f"one.{ending}")
    assert found.startswith(start) and b"a rising line" in found
    assert drawn(tmp_path / f"two.{ending}") == found


def test_a_picture_that_stands_alone_needs_no_fonts(tmp_path: Path) -> None:
    drawn(tmp_path / "one.svg")
    root = ElementTree.parse(tmp_path / "one.svg").getroot()
    assert not root.findall(".//{http://www.w3.org/2000/svg}text")
