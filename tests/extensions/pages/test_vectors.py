"""Errors at points as a picture."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from ballplate.presentation.vectors import LONGEST, draw_vectors, magnification

pytest.importorskip("matplotlib", reason="pictures need matplotlib")


@pytest.mark.parametrize("size", [1e-9, 3.1e-7, 0.5e-6, 2e-5])
def test_the_longest_vector_takes_its_part_of_the_drawing(size: float) -> None:
    vectors = np.array([[0.0, size], [size / 3, 0.0]])
    assert 0.4 * LONGEST * 0.3 < size * magnification(vectors, 0.3) <= LONGEST * 0.3 * (1 + 1e-9)


def test_vectors_begin_at_their_points() -> None:
    """Of the drawn markers each is at a point, in millimetres."""
    places = np.random.default_rng(1).random((9, 2))
    axes = draw_vectors(places, np.full((9, 2), 1e-6), "some").axes[0]
    (line,) = (line for line in axes.lines if line.get_markevery() == 3)
    np.testing.assert_allclose(line.get_xydata()[::3], 1e3 * places)


def test_no_errors_at_all(tmp_path: Path) -> None:
    draw_vectors(np.eye(2), np.zeros((2, 2)), "nothing", tmp_path / "none.svg")
    assert ElementTree.parse(tmp_path / "none.svg").getroot().tag.endswith("svg")
