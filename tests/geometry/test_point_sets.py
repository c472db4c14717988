"""Motions, turns and axes of sets of points, against group theory and least squares."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from ballplate.extensions.certificates.datum import Datum, chosen_datum, in_datum, relative_to
from ballplate.results.plates import PlateAxes, plate_axes
from ballplate.simulator.design.objects import Volume
from ballplate.simulator.geometry.ball_layouts import BallLayout
from ballplate.simulator.geometry.motions import (
    fit_motion,
    fixes_pose,
    pose_parameter_names,
    pose_size,
    rigid_motions,
    rotation_from_vector,
    rotation_matrix,
    vector_from_rotation,
    vector_rate,
    without_rigid_motion,
)
from scipy.spatial.transform import Rotation

from tests.geometry import wording


def grid(*counts: int) -> np.ndarray:
    return np.array([*product(*map(range, counts))], float)


def in_space(points: np.ndarray) -> np.ndarray:
    return np.column_stack([points, np.zeros(len(points))])


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
    with pytest.raises(ValueError, match=wording.NAME_DIFFERENT_BALLS_ONE):
        chosen_datum(layout, 3, ("a", "b"))
    with pytest.raises(ValueError, match=wording.NAME_DIFFERENT_BALLS):
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
    drawn = drawn[[3, 1, 2, 0, 4]]
    shifted = drawn + [30.0, -50.0, 80.0]
    layout = BallLayout(("above", "on", "plane", "o", "below"), shifted)
    rotation = rotation_matrix([2.0, -0.7, 1.3])
    for d, names in ((3, ("o", "on", "plane")), (2, ("o", "on"))):
        datum = chosen_datum(layout, d, names)
        turn = rotation if d == 3 else rotation_matrix([2.5])
        moved = shifted[:, :d] @ turn.T + np.arange(d)
        found, turned = in_datum(moved, datum, shifted)
        np.testing.assert_allclose(found, drawn[:, :d], atol=1e-12)
        np.testing.assert_allclose(turned, turn.T, atol=1e-12)


@pytest.mark.parametrize("along", [*np.eye(3), [0.6, 0.0, -0.8]])
def test_balls_in_line_are_on_their_axis(along: np.ndarray) -> None:
    drawn = np.outer([1.0, 0.0, 3.0], [0.8, 0.6, 0.0])
    datum = chosen_datum(BallLayout(("a", "o", "b"), drawn), 3, (), PlateAxes(1, 2, 0))
    assert datum.plane is None
    found, rotation = in_datum(np.outer([1.0, 0.0, 3.0], along) + 7.0, datum, drawn)
    np.testing.assert_allclose(found, np.outer([1.0, 0.0, 3.0], [1.0, 0.0, 0.0]), atol=1e-13)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-13)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_all_balls_in_a_datum_are_as_close_as_possible_to_the_drawing() -> None:
    drawn = np.random.default_rng(4).standard_normal((5, 3))
    rotation = rotation_matrix([2.0, -0.7, 1.3])
    found, turned = in_datum(drawn @ rotation.T + 5.0, Datum(None), drawn)
    np.testing.assert_allclose(found, drawn, atol=1e-14)
    np.testing.assert_allclose(turned, rotation.T, atol=1e-14)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("names", [("o", "on", "other"), ("o", "high", "on"), ("all",)])
def test_displacements_in_a_datum_are_differences_of_coordinates_there(
    names: tuple[str, ...], d: int
) -> None:
    balls = np.array([[0.1, 0.2, 0.0], [2.0, 0.3, 0.1], [0.4, 1.9, 0.3], [-0.7, 1.0, -0.2]])
    layout = BallLayout(("o", "on", "high", "other"), balls)
    datum = chosen_datum(layout, d, names if names == ("all",) else names[:d])
    where = in_datum(balls[:, :d], datum, balls[:, :d])[0]
    displacements = np.random.default_rng(2).standard_normal((4, d, 3))
    found = relative_to(datum, where, displacements)
    for k in range(3):
        step = 1e-6 * displacements[:, :, k]
        change = [in_datum(where + one, datum, where)[0] for one in (step, -step)]
        np.testing.assert_allclose(found[:, :, k], (change[0] - change[1]) / 2e-6, atol=1e-8)
    if datum.axes is not None:
        zero = {(datum.axes.origin, axis) for axis in range(d)}
        zero |= {(datum.axes.ball, axis) for axis in range(d) if axis != datum.axes.axis}
        zero |= set() if datum.plane is None else {(datum.plane, 2)}
        assert set(zip(*np.nonzero((found == 0.0).all(axis=2)), strict=True)) == zero


def test_the_datum_of_a_layout_and_its_words() -> None:
    flat = BallLayout(tuple("abcdefghi"), in_space(grid(3, 3)))
    chosen = chosen_datum(flat, 3, ())
    # Of c, f and i, which are as far from the x axis through g, the first.
    assert chosen == Datum(PlateAxes(0, 6, 0), 2)
    told = "origin: ball a, x axis through ball g"
    assert chosen.words(flat.names) == f"{told}, xy plane through ball c"
    assert chosen_datum(flat, 2, ()) == Datum(PlateAxes(0, 6, 0))
    assert chosen_datum(flat, 2, ()).words(flat.names) == told
    stated = PlateAxes(4, 1, 0, -1.0)
    assert chosen_datum(flat, 2, (), stated) == Datum(stated)
    assert chosen_datum(flat, 3, (), stated) == Datum(stated, 0)
    assert chosen_datum(flat, 3, ("e", "b", "d")) == Datum(PlateAxes(4, 1, 0, -1.0), 3)
    assert chosen_datum(flat, 3, ("e", "d", "b")) == Datum(PlateAxes(4, 3, 1, -1.0), 1)
    assert chosen_datum(flat, 3, ("all",)) == Datum(None)
    assert "least squares" in Datum(None).words(flat.names)
    row = BallLayout(("a", "b", "c"), np.outer([0.0, 1.0, 2.0], [1.0, 1.0, 0.0]))
    assert chosen_datum(row, 3, ()).plane is None


@pytest.mark.parametrize("off", [0.9e-3, 1.1e-3])
@pytest.mark.parametrize("along", [-2.0, 0.5, 3.0])
def test_a_thousandth_of_how_far_it_is_along_keeps_a_ball_from_being_in_line(
    off: float, along: float
) -> None:
    turn = rotation_matrix([0.3, 0.4, 0.5])
    places = np.array([[0.0, 0, 0], [1.0, 0, 0], [along, off * abs(along), 0]]) @ turn.T + 1.0
    layout = BallLayout(("a", "b", "c"), places)
    plane = chosen_datum(layout, 3, ()).plane
    if off < 1e-3:
        assert plane is None
        with pytest.raises(ValueError, match=wording.A_ARE_IN):
            chosen_datum(layout, 3, ("a", "b", "c"))
    else:
        assert plane is not None and chosen_datum(layout, 3, ("a", "b", "c")).plane == 2


def test_what_defines_no_datum_is_told() -> None:
    column = BallLayout(("a", "b"), np.array([[0.0, 0, 0], [0, 0, 1]]))
    with pytest.raises(ValueError, match=wording.ITS_BALLS_ARE_DRAWN_ABOVE_ONE):
        chosen_datum(column, 3, (), PlateAxes(0, 0, 0))
    with pytest.raises(ValueError, match=wording.A_AND_ARE_DRAWN_ABOVE_ONE):
        chosen_datum(column, 2, ("a", "b"))
    with pytest.raises(ValueError, match='no ball "z"'):
        chosen_datum(column, 2, ("a", "z"))
    with pytest.raises(ValueError, match="name 2 different balls"):
        chosen_datum(column, 2, ("a", "a"))
    with pytest.raises(ValueError, match=wording.A_SINGLE_BALL_HAS):
        chosen_datum(BallLayout(("a",), np.zeros((1, 3))), 3, ())


TURNS = [0.0, 1e-9, 5e-5, 9.9e-5, 1.01e-4, 2e-3, 0.4, 1.5, 3.0]


@pytest.mark.parametrize("angle", TURNS)
def test_turns_are_those_of_scipy(angle: float) -> None:
    """And the rate of a turn is the inverse of that of a further turn of the matrix."""
    axes = np.random.default_rng(5).standard_normal((4, 3))
    vectors = angle * axes / np.linalg.norm(axes, axis=1)[:, None]
    found = rotation_from_vector(vectors)
    np.testing.assert_allclose(found, Rotation.from_rotvec(vectors).as_matrix(), atol=1e-14)
    np.testing.assert_allclose(vector_from_rotation(found), vectors, rtol=1e-12, atol=1e-14)
    flat = rotation_from_vector(vectors[:, :1])
    c, s = np.cos(vectors[:, 0]), np.sin(vectors[:, 0])
    np.testing.assert_allclose(flat.reshape(-1, 4), np.array([c, -s, s, c]).T, atol=1e-15)
    np.testing.assert_allclose(vector_from_rotation(flat), vectors[:, :1], atol=1e-15)
    step = 1e-4
    for k in range(3):
        turns = [Rotation.from_rotvec(sign * step * np.eye(3)[k]) for sign in (1.0, -1.0)]
        change = [(turn * Rotation.from_matrix(found)).as_rotvec() for turn in turns]
        expected = (change[0] - change[1]) / (2 * step)
        np.testing.assert_allclose(vector_rate(vectors)[:, :, k], expected, atol=1e-7)
    assert vector_rate(vectors[:, :1]).tolist() == [[[1.0]]] * 4


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("is_flat", [True, False])
def test_the_motion_of_points_is_found(d: int, is_flat: bool) -> None:
    points = np.random.default_rng(8).standard_normal((6, d))
    points[:, -1] *= 0.0 if is_flat and d == 3 else 1.0
    turn = rotation_matrix([2.2] if d == 2 else [0.4, -1.9, 0.7])
    rotation, origin = fit_motion(points, points @ turn.T + np.arange(d))
    np.testing.assert_allclose(rotation, turn, atol=1e-14)
    np.testing.assert_allclose(origin, np.arange(d), atol=1e-14)
    # Of a mirror image the nearest proper rotation.
    mirrored = points * np.array([-1.0, *[1.0] * (d - 1)])
    assert np.linalg.det(fit_motion(points, mirrored)[0]) == pytest.approx(1.0)


def test_points_that_fix_a_pose() -> None:
    row = np.outer([0.0, 1.0, 3.0], [1.0, 2.0, -1.0])
    for off, fixes in ((0.0, False), (1e-7, False), (1e-4, True)):
        assert fixes_pose(row + 5.0 + off * np.array([[0.0] * 3, [1.0, 0, 0], [0.0] * 3])) is fixes
    assert not fixes_pose(row[:2]) and fixes_pose(row[:2, :2])
    assert not fixes_pose(np.ones((2, 2))) and not fixes_pose(row[:1, :2])


@pytest.mark.parametrize("d", [2, 3])
def test_motions_of_places_are_shifts_and_turns_of_them(d: int) -> None:
    """One after the other along and about the axes; in space the turn about z stands first."""
    places = np.random.default_rng(9).standard_normal((5, d))
    found = rigid_motions(places)
    assert found.shape == (5, d, pose_size(d)) and pose_size(d) == len(pose_parameter_names(d))
    for k in range(d):
        np.testing.assert_array_equal(found[:, :, k], np.tile(np.eye(d)[k], (5, 1)))
    for k, about in enumerate([2, 0, 1] if d == 3 else [2], start=d):
        turned = np.cross(np.eye(3)[about], places if d == 3 else in_space(places))[:, :d]
        np.testing.assert_allclose(found[:, :, k], turned, atol=1e-15)


def test_nothing_is_taken_from_errors_of_no_places_or_no_errors() -> None:
    for shape in ((0, 3, 2), (4, 3, 0), (0, 2, 0)):
        assert without_rigid_motion(np.zeros(shape[:2]), np.zeros(shape)).shape == shape


def test_limits_of_scale_readings_and_of_units() -> None:
    """A thousandth of each side, and as much as the longest one beyond the volume."""
    volume = Volume(np.array([1.0, -1.0, 0.0]), np.array([2.0, 0.0, 4.0]))
    lower, upper = volume.of_readings
    np.testing.assert_allclose(lower, [0.999, -1.001, -0.004])
    np.testing.assert_allclose(upper, [2.001, 0.001, 4.004])
    reading = np.array([[5.9, -4.9, 7.9], [6.1, -5.1, -4.1]])
    assert volume.far_outside(reading).tolist() == [[False] * 3, [True] * 3]
