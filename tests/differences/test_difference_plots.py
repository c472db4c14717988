"""The picture of what changed between two maps, by what it draws."""

from __future__ import annotations

import re
from dataclasses import replace

import ballplate as bp
import numpy as np
import pytest
from ballplate.results.differences.comparison import ComparisonSettings, MapComparison, compared
from ballplate.results.differences.difference_plots import draw_difference
from ballplate.simulator.machines.protocol import Array

from tests.differences.campaigns import simulated_map

pytest.importorskip("matplotlib", reason="pictures need matplotlib")


@pytest.fixture(scope="module")
def found() -> MapComparison:
    maps = [simulated_map(bp.quickstart(), seed) for seed in (1, 2)]
    return compared(maps[0], maps[1], ComparisonSettings(grid=3))


def drawn(found: MapComparison) -> tuple[Array, float, Array, Array, float]:
    """Starts and tips (m, 2, 2) of the vectors in metres of the paper, how much larger than life
    the picture says that they are, the limits (2, 2) of its axes, the ends (m, 2) of all that is
    drawn of the volume, and the length of the scale bar over what it says.
    """
    axes = draw_difference(found, "changes").axes[0]
    lines = [np.column_stack(line.get_data()).astype(float) for line in axes.get_lines()]
    vectors = [
        one.reshape(-1, 3, 2)[:, :2]
        for one, line in zip(lines, axes.get_lines(), strict=True)
        if line.get_marker() in ("o", "s")
    ]
    (text,) = (one.get_text() for one in axes.texts if "magnified" in one.get_text())
    told = re.match(r"(\S+) µm, magnified ([0-9,.]+) times", text)
    assert told is not None
    (bar,) = (
        np.ptp(one[:, 0])
        for one, line in zip(lines, axes.get_lines(), strict=True)
        if line.get_transform() != axes.transData
    )
    box = [
        one[np.isfinite(one).all(axis=1)]
        for one, line in zip(lines, axes.get_lines(), strict=True)
        if line.get_transform() == axes.transData
    ]
    limits = np.array([axes.get_xlim(), axes.get_ylim()])
    times = float(told[2].replace(",", ""))
    return np.concatenate(vectors), times, limits, np.concatenate(box), bar / float(told[1])


@pytest.mark.parametrize("factor", [1.0, 37.0, 0.004])
def test_vectors_are_as_large_as_the_picture_says(found: MapComparison, factor: float) -> None:
    """Whatever their size, the longest is a few hundredths of the volume."""
    places = replace(found.places, differences=factor * found.places.differences)
    vectors, times, limits, ends, bar = drawn(replace(found, places=places))
    moved = places.differences.reshape(-1, 3)
    longest = np.linalg.norm(moved, axis=1).max()
    assert len(vectors) == len(moved)
    # A cube of one metre is drawn to scale; magnification is 1, 2, 5, 10 and so on.
    assert 0.15 / 2.5 < times * longest <= 0.15 * (1.0 + 1e-9)
    # On the paper none is longer than it is, and of vectors everywhere some lie in the paper.
    lengths = np.linalg.norm(vectors[:, 1] - vectors[:, 0], axis=1)
    magnified = np.sort(times * np.linalg.norm(moved, axis=1))
    assert (np.sort(lengths) <= magnified * (1.0 + 1e-9)).all()
    assert lengths.sum() > 0.5 * magnified.sum()
    assert bar == pytest.approx(1e-6 * times)
    # Everything is inside of the axes, in the middle from left to right.
    low, high = ends.min(axis=0), ends.max(axis=0)
    assert (limits[:, 0] < low).all() and (high < limits[:, 1]).all()
    assert low[0] - limits[0, 0] == pytest.approx(limits[0, 1] - high[0])
