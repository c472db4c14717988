"""The picture of what changed between two maps, by what it draws."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
import pytest
from ballplate.extensions.maps.comparison import MapComparison, compared
from ballplate.extensions.maps.difference_plots import draw_difference
from ballplate.simulator.machines.protocol import Array

from tests.extensions.maps.campaigns import simulated_map
from tests.reference.small_quickstart import small_quickstart

pytest.importorskip("matplotlib", reason="pictures need matplotlib")


@pytest.fixture(scope="module")
def found() -> MapComparison:
    maps = [simulated_map(small_quickstart(), seed) for seed in (1, 2)]
    return compared(maps[0], maps[1], grid=3)


@dataclass(frozen=True)
class Drawn:
    """Vectors (m, 2, 2) from start to tip on the paper, all `places` (k, 2) where something of them
    or of the volume is drawn, and the `limits` (2, 2) of the axes; the length of the `bar`, what it
    stands for in micrometres, and how many `times` vectors are magnified, by the words beside it.
    """

    vectors: Array
    places: Array
    limits: Array
    bar: float
    micrometres: float
    times: float


def drawn(found: MapComparison) -> Drawn:
    axes = draw_difference(found, "changes").axes[0]
    vectors, places, bars = [], [], []
    for line in axes.get_lines():
        ends = np.column_stack(line.get_data()).astype(float)
        if line.get_transform() != axes.transData:
            bars.append(float(np.ptp(ends[:, 0])))
            continue
        places.append(ends[np.isfinite(ends).all(axis=1)])
        if line.get_marker() in ("o", "s"):
            vectors.append(ends.reshape(-1, 3, 2)[:, :2])
    (bar,) = bars
    (text,) = (one.get_text() for one in axes.texts if "magnified" in one.get_text())
    words = re.match(r"(\S+) µm, magnified ([0-9,.]+) times", text)
    assert words is not None
    limits = np.array([axes.get_xlim(), axes.get_ylim()])
    micrometres, times = float(words[1]), float(words[2].replace(",", ""))
    return Drawn(np.concatenate(vectors), np.concatenate(places), limits, bar, micrometres, times)


@pytest.mark.parametrize("factor", [1.0, 37.0, 0.004])
def test_vectors_are_as_large_as_the_picture_says(found: MapComparison, factor: float) -> None:
    """In a cube of one metre, drawn to scale, the longest is at most 0.15 m, whatever it is."""
    places = replace(found.places, differences=factor * found.places.differences)
    picture = drawn(replace(found, places=places))
    sizes = picture.times * np.linalg.norm(places.differences.reshape(-1, 3), axis=1)
    # Of magnifications of 1, 2, 5, 10 and so on, the next is up to two and a half times as large.
    assert 0.15 / 2.5 < sizes.max() <= 0.15 * (1.0 + 1e-9)
    # Seen from the side, a vector is no longer than it is, and most are not much shorter.
    seen = np.linalg.norm(picture.vectors[:, 1] - picture.vectors[:, 0], axis=1)
    assert len(seen) == len(sizes)
    assert (np.sort(seen) <= np.sort(sizes) * (1.0 + 1e-9)).all()
    assert seen.sum() > 0.5 * sizes.sum()
    assert picture.bar == pytest.approx(1e-6 * picture.micrometres * picture.times)
    # All of it is inside of the axes, in the middle from left to right.
    low, high = picture.places.min(axis=0), picture.places.max(axis=0)
    left, below = picture.limits[:, 0]
    right, above = picture.limits[:, 1]
    assert left < low[0] and below < low[1] and high[0] < right and high[1] < above
    assert low[0] - left == pytest.approx(right - high[0])
