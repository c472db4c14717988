"""Motions, turns and axes of sets of points, against group theory and least squares."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from ballplate.simulator.design.objects import Volume
from ballplate.simulator.geometry.axes import plate_axes
from ballplate.simulator.geometry.ball_layouts import BallLayout
from ballplate.simulator.geometry.datum import Datum, chosen_datum, in_datum
from ballplate.simulator.geometry.directions import GeneratedDirectionsSettings, directions
from ballplate.simulator.geometry.motions import (
    rigid_motions,
    vector_from_rotation,
    vector_rate,
    without_rigid_motion,
)
from ballplate.simulator.geometry.rotations import rotation_matrix
from ballplate.simulator.geometry.symmetry import turns_onto_itself


def grid(*counts: int) -> np.ndarray:
    return np.array([*product(*map(range, counts))], float)


def in_space(points: np.ndarray) -> np.ndarray:
    return np.column_stack([points, np.zeros(len(points))])


@pytest.mark.parametrize(
    ("points", "turns"),
    [
        (grid(3, 3), 3),
        (grid(3, 2), 1),
        # In space a square has the turns of the dihedral group, a rectangle those of Klein's.
        (in_space(grid(3, 3)), 7),
        (in_space(grid(4, 2)), 3),
        (grid(2, 2, 2), 23),
        (grid(2, 2, 3), 7),
        (in_space(grid(4, 1)), 0),
        (np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 2.0]]), 0),
    ],
)
def test_turns_onto_itself_are_those_of_the_group(points: np.ndarray, turns: int) -> None:
    found = turns_onto_itself(points, 1e-6)
    assert len(found) == turns
    local = points - points.mean(axis=0)
    for one in found:
        moved = np.round(local @ one.T, 6) + 0.0
        assert {tuple(p) for p in moved} == {tuple(p) for p in np.round(local, 6) + 0.0}


@pytest.mark.parametrize("shift", [0.0, 5.0])
@pytest.mark.parametrize(
    "points", [in_space(grid(4, 1)), grid(1, 1, 1), in_space(grid(3, 2)), grid(2, 3, 2), grid(4, 1)]
)
def test_what_a_motion_cannot_do_stays(points: np.ndarray, shift: float) -> None:
    """As the residuals of least squares, also of points in a line, which no turn about it moves."""
    points = points + shift
    errors = np.random.default_rng(3).standard_normal((*points.shape, 4))
    motions = rigid_motions(points).reshape(points.size, -1)
    flat = errors.reshape(points.size, -1)
    left = flat - motions @ np.linalg.lstsq(motions, flat, rcond=1e-10)[0]
    found = without_rigid_motion(points, errors).reshape(points.size, -1)
    np.testing.assert_allclose(found, left, atol=1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_the_rate_of_a_turn_is_its_derivative(d: int) -> None:
    about = [0.7] if d == 2 else [0.3, -0.5, 0.8]
    rotation = rotation_matrix(about)[None]
    vector, size = vector_from_rotation(rotation), 1e-6
    for k in range(len(about)):
        small = rotation_matrix((size * np.eye(len(about))[k]).tolist())
        less = rotation_matrix((-size * np.eye(len(about))[k]).tolist())
        change = vector_from_rotation(small @ rotation) - vector_from_rotation(less @ rotation)
        np.testing.assert_allclose(vector_rate(vector)[0, :, k], change[0] / (2 * size), atol=1e-8)


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        (grid(3, 4), ("2,0", 0, 1.0)),
        (-grid(3, 4), ("-2,0", 0, -1.0)),
        # None on the x axis: the farthest on the y axis; none on either: the farthest along x.
        (np.array([[0.0, 0], [0, 2], [0, -3], [5, 1]]), ("0,-3", 1, -1.0)),
        (np.array([[0.0, 0], [1, 2], [-3, 1], [2, 9]]), ("-3,1", 0, -1.0)),
    ],
)
def test_axes_of_a_plate_without_settings(
    points: np.ndarray, expected: tuple[str, int, float]
) -> None:
    names = tuple(f"{x:g},{y:g}" for x, y in points + 0.0)
    axes = plate_axes(BallLayout(names, in_space(points)))
    assert axes is not None and axes.origin == 0
    assert (names[axes.ball], axes.axis, axes.sign) == expected


def test_a_datum_names_as_many_balls_as_there_are_dimensions() -> None:
    layout = BallLayout(("a", "b", "c", "d"), in_space(grid(2, 2)))
    with pytest.raises(ValueError, match="name 3 different balls, .* one in the xy plane, or all"):
        chosen_datum(layout, 3, ("a", "b"))
    with pytest.raises(ValueError, match="name 2 different balls, .*, one on an axis, or all"):
        chosen_datum(layout, 2, ("a", "b", "c"))


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_balls_in_a_datum_are_as_they_are_drawn(axis: int, sign: float, side: float) -> None:
    """Drawn so that they meet its conditions, and then moved: on either half of an axis, with the
    third ball on either side of it, and above and below its plane.
    """
    drawn = np.array([[0.0, 0, 0], [0, 0, 0], [0.4, 0.2, 0], [0.1, 0.5, 0.3], [-0.6, 0.2, -0.2]])
    drawn[1, axis] = 2.0 * sign
    drawn[2, 1 - axis] = 0.7 * side
    shifted = drawn + [0.3, -0.1, 0.8]
    layout = BallLayout(("o", "on", "plane", "above", "below"), shifted)
    rotation = rotation_matrix([2.0, -0.7, 1.3])
    for d, names in ((3, ("o", "on", "plane")), (2, ("o", "on"))):
        datum = chosen_datum(layout, d, names)
        turn = rotation if d == 3 else rotation_matrix([2.5])
        moved = shifted[:, :d] @ turn.T + np.arange(d)
        found, turned = in_datum(moved, datum, shifted)
        np.testing.assert_allclose(found, drawn[:, :d], atol=1e-14)
        np.testing.assert_allclose(turned, turn.T, atol=1e-14)


def test_all_balls_in_a_datum_are_as_close_as_possible_to_the_drawing() -> None:
    drawn = np.random.default_rng(4).standard_normal((5, 3))
    rotation = rotation_matrix([2.0, -0.7, 1.3])
    found, turned = in_datum(drawn @ rotation.T + 5.0, Datum(None), drawn)
    np.testing.assert_allclose(found, drawn, atol=1e-14)
    np.testing.assert_allclose(turned, rotation.T, atol=1e-14)


def test_nothing_is_taken_from_errors_of_no_places_or_no_errors() -> None:
    for shape in ((0, 3, 2), (4, 3, 0), (0, 2, 0)):
        assert without_rigid_motion(np.zeros(shape[:2]), np.zeros(shape)).shape == shape


def test_random_directions_are_those_of_the_seed() -> None:
    plain, first, second = (
        directions(GeneratedDirectionsSettings(random=4, seed=seed)) for seed in (None, 1, 2)
    )
    np.testing.assert_array_equal(plain, first)
    assert np.abs(first - second).min(axis=1).max() > 1e-3


def test_limits_of_scale_readings_and_of_units() -> None:
    """A thousandth of each side, and as much as the longest one beyond the volume."""
    volume = Volume(np.array([1.0, -1.0, 0.0]), np.array([2.0, 0.0, 4.0]))
    lower, upper = volume.of_readings
    np.testing.assert_allclose(lower, [0.999, -1.001, -0.004])
    np.testing.assert_allclose(upper, [2.001, 0.001, 4.004])
    reading = np.array([[5.9, -4.9, 7.9], [6.1, -5.1, -4.1]])
    assert volume.far_outside(reading).tolist() == [[False] * 3, [True] * 3]
