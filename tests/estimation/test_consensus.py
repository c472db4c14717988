"""The motion that most points agree on: known motions of points of which many are wrong."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.extensions.laboratory.consensus import consensus_motion
from ballplate.simulator.geometry.rotations import rotation_matrix

WITHIN = 1e-5


def cross(d: int) -> np.ndarray:
    """Sixty points at both ends of a row, and twenty beside its middle that alone tell the turn
    about it.
    """
    places = np.zeros((80, 3))
    places[:60, 0] = np.append(np.linspace(-1.0, -0.9, 30), np.linspace(0.9, 1.0, 30))
    places[60:, 1] = np.linspace(0.01, 0.2, 20)
    return places[:, :d]


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("count", [8, 80])
def test_the_motion_of_two_thirds_is_found(d: int, count: int) -> None:
    """As it was made, also where most points are in a row, with noise below what agrees."""
    source = cross(d)[:: 80 // count]
    rotation = rotation_matrix([0.4] if d == 2 else [0.3, -0.2, 0.9])
    origin = np.array([0.5, -0.2, 0.3])[:d]
    generator = np.random.default_rng(2)
    target = source @ rotation.T + origin + 1e-7 * generator.uniform(-1.0, 1.0, source.shape)
    wrong = np.arange(count) % 3 == 1
    target[wrong] += generator.uniform(0.01, 0.5, (int(wrong.sum()), d))
    turned, moved, agreeing = consensus_motion(source, target, np.full(count, WITHIN))
    np.testing.assert_array_equal(agreeing, ~wrong)
    np.testing.assert_allclose(turned, rotation, rtol=0, atol=1e-5)
    np.testing.assert_allclose(moved, origin, rtol=0, atol=1e-6)
    assert np.linalg.det(turned) == pytest.approx(1.0, abs=1e-12)
