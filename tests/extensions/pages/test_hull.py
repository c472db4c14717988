"""Outlines of positions on the paper."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.presentation.scenes import hull


@pytest.mark.parametrize("seed", range(20))
def test_all_points_lie_within_and_the_corners_are_some_of_them(seed: int) -> None:
    generator = np.random.default_rng(seed)
    points = generator.normal(size=(3 + 4 * seed, 2)).round(1)
    corners = hull(points)
    assert {tuple(one) for one in corners} <= {tuple(one) for one in points}
    sides = np.roll(corners, -1, axis=0) - corners
    away = points[:, None] - corners
    # To the left of every side.
    assert (sides[:, 0] * away[..., 1] - sides[:, 1] * away[..., 0] >= -1e-9).all()


def test_points_on_a_line_have_its_ends() -> None:
    along = np.random.default_rng(1).permutation(np.linspace(-1.0, 2.0, 9))
    for direction in ([1.0, 0.0], [0.0, 1.0], [1.0, 2.0]):
        found = hull(along[:, None] * np.array(direction))
        assert sorted(found.tolist()) == [[-d for d in direction], [2.0 * d for d in direction]]


@pytest.mark.parametrize("count", [1, 2])
def test_one_or_two_points_are_their_own_hull(count: int) -> None:
    points = np.arange(2.0 * count).reshape(count, 2)
    assert hull(points).tolist() == points.tolist()
