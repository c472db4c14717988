"""Rotations: order of turns, exactness at quarter-turns."""

import math

import numpy as np
import pytest
from ballplate.simulator.geometry.motions import cosine_and_sine, rotation_matrix
from ballplate.simulator.inputs.quantities import parse_angle
from hypothesis import given, strategies as st

angles = st.floats(-10.0, 10.0)


@given(st.tuples(angles, angles, angles))
def test_rotations_are_proper(three: tuple[float, float, float]) -> None:
    rotation = rotation_matrix(three)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_turns_are_about_fixed_x_then_y_then_z() -> None:
    x, y, z = np.eye(3)
    quarter = math.pi / 2
    np.testing.assert_array_equal(rotation_matrix([quarter, 0.0, 0.0]) @ y, z)
    np.testing.assert_array_equal(rotation_matrix([0.0, quarter, 0.0]) @ z, x)
    np.testing.assert_array_equal(rotation_matrix([0.0, 0.0, quarter]) @ x, y)
    # y goes to z about x, on to x about y, on to y about z.
    np.testing.assert_array_equal(rotation_matrix([quarter, quarter, quarter]) @ y, y)


@given(st.integers(-8, 8))
def test_multiples_of_ninety_degrees_are_exact(turns: int) -> None:
    expected = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][turns % 4]
    assert cosine_and_sine(parse_angle(f"{90 * turns} deg")) == expected
    rotation = rotation_matrix([turns * math.pi / 2])
    assert set(np.abs(rotation).flat) <= {0.0, 1.0}
    assert not np.any(np.signbit(rotation) & (rotation == 0))


def test_a_tiny_angle_is_not_rounded_away() -> None:
    assert cosine_and_sine(1e-12) == (1.0, 1e-12)
    assert cosine_and_sine(math.pi / 2 + 1e-9)[0] == pytest.approx(-1e-9, rel=1e-6)
