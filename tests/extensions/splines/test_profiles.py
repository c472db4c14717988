"""Arc lengths along turned profiles and normals to them."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.extensions.splines.profile import NotOnProfileError, along

RADIUS = 0.037


def dome(degrees: np.ndarray) -> np.ndarray:
    """Radius and axial co-ordinate on a quarter circle that ends on the axis at 90 degrees."""
    angle = np.radians(degrees)
    return RADIUS * np.column_stack([np.cos(angle), np.sin(angle) - 1.0])


def test_points_on_a_circle_have_its_arcs_and_normals() -> None:
    degrees = np.array([0.0, 3.0, 11.0, 30.0, 31.0, 60.0, 85.0])
    profile, own, _ = along(dome(degrees), [""] * 7, np.zeros((0, 2)))
    np.testing.assert_allclose(profile.lengths[own], RADIUS * np.radians(degrees), rtol=1e-13)
    outwards = np.column_stack([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    np.testing.assert_allclose(profile.normals, outwards, atol=1e-13)


@pytest.mark.parametrize("backwards", [False, True])
def test_a_line_joins_a_circle_at_their_boundary(backwards: bool) -> None:
    line = np.array([[RADIUS, -RADIUS - 0.02], [RADIUS, -RADIUS - 0.005]])
    places = np.concatenate([line, dome(np.array([4.0, 20.0, 50.0, 80.0]))])
    step = -1 if backwards else 1
    pole = dome(np.array([90.0]))[0]
    start, end = (pole, None) if backwards else (None, pole)
    profile, own, at = along(places[::step], [""] * 6, dome(np.array([0.0])), start, end)
    whole = 0.02 + RADIUS * np.pi / 2
    assert profile.lengths[-1] == pytest.approx(whole, rel=1e-12)
    edge = profile.lengths[at[0]]
    assert (whole - edge if backwards else edge) == pytest.approx(0.02, rel=1e-12)
    normals = profile.normals[own][::step]
    np.testing.assert_allclose(normals[:2], [[1.0, 0.0]] * 2, atol=1e-12)
    np.testing.assert_allclose(
        normals[2], [np.cos(np.radians(4)), np.sin(np.radians(4))], atol=1e-12
    )


def test_a_measured_point_may_be_the_boundary() -> None:
    line = np.array([[RADIUS, -RADIUS - 0.02], [RADIUS, -RADIUS - 0.005]])
    places = np.concatenate([line, dome(np.array([0.0, 20.0, 50.0, 80.0]))])
    for labels in ([""] * 6, ["line"] * 3 + ["dome"] * 3, ["line"] * 2 + ["dome"] * 4):
        profile, own, at = along(places, labels, dome(np.array([0.0, 80.0])))
        assert own.tolist() == list(range(6)) and at.tolist() == [2, 5]
        assert profile.features == ((0, 2), (2, 5))
        np.testing.assert_allclose(
            np.diff(profile.lengths)[2:], RADIUS * np.radians([20, 30, 30]), rtol=1e-12
        )


def test_labels_part_features_at_a_corner() -> None:
    """A cylinder and a face: each has its own normals, which a common curve would round off."""
    places = np.array([[0.04, -0.03], [0.04, -0.02], [0.04, -0.01], [0.03, 0.0], [0.02, 0.0]])
    profile, own, _ = along(places, ["cylinder"] * 3 + ["face"] * 2, np.zeros((0, 2)))
    assert profile.features == ((0, 2), (3, 4))
    np.testing.assert_allclose(profile.normals[own], [[1, 0]] * 3 + [[0, 1]] * 2, atol=1e-15)
    assert profile.lengths[-1] == pytest.approx(0.03 + np.hypot(0.01, 0.01))


def test_a_single_point_takes_its_normal_from_its_nearer_neighbour() -> None:
    places = np.array([[0.05, -0.03], [0.05, -0.02], [0.03, -0.01], [0.02, 0.0], [0.01, 0.0]])
    profile, own, _ = along(places, ["a", "a", "b", "c", "c"], np.zeros((0, 2)))
    np.testing.assert_allclose(profile.normals[own[2]], np.sqrt([0.5, 0.5]), atol=1e-12)
    alone, _, _ = along(places[:1], [""], np.zeros((0, 2)))
    assert alone.normals.tolist() == [[1.0, 0.0]] and alone.lengths.tolist() == [0.0]


def test_a_boundary_off_the_profile_is_refused() -> None:
    with pytest.raises(NotOnProfileError) as error:
        along(dome(np.array([0.0, 20.0, 40.0])), [""] * 3, np.array([[RADIUS, 0.5]]))
    assert error.value.args == (0,)


def signed_curvature(one: complex, two: complex, three: complex) -> float:
    """Of the circle through three points: four times the area of the triangle over its sides."""
    first, second = two - one, three - two
    area = 0.5 * (first.real * second.imag - first.imag * second.real)
    return 4.0 * area / (abs(first) * abs(second) * abs(three - one))


@pytest.mark.parametrize("backwards", [False, True])
def test_arcs_of_a_curve_have_the_mean_curvature_of_their_ends(backwards: bool) -> None:
    """Behind a cylinder a quarter of an ellipse, on which no two points have the same curvature."""
    angle = np.radians([0.0, 12.0, 20.0, 35.0, 41.0, 60.0, 80.0])
    ellipse = np.column_stack([0.04 * np.cos(angle), 0.025 * np.sin(angle)])
    cylinder = np.array([[0.04, -0.03], [0.04, -0.01]])
    places = np.concatenate([cylinder, ellipse])
    labels = ["cylinder"] * 2 + ["dome"] * 7
    step = -1 if backwards else 1
    profile, own, _ = along(places[::step], labels[::step], np.zeros((0, 2)))
    points = ellipse[::step, 1] + 1j * ellipse[::step, 0]
    curvature = [signed_curvature(*points[k : k + 3]) for k in range(5)]
    curvature = [curvature[0], *curvature, curvature[-1]]
    lengths = profile.lengths[own][:7] if backwards else profile.lengths[own][2:]
    for k in range(6):
        mean = 0.5 * (curvature[k] + curvature[k + 1])
        chord = points[k + 1] - points[k]
        turn = 2.0 * np.arcsin(0.5 * abs(mean * chord))
        assert lengths[k + 1] - lengths[k] == pytest.approx(turn / abs(mean), rel=1e-12)


@pytest.mark.parametrize("step", [1, -1])
def test_both_sides_of_a_place_that_features_share(step: int) -> None:
    """The quarter circle turns from the line at its end, on the way up and down again."""
    arc = dome(np.array([0.0, 20.0, 50.0, 80.0]))
    line = np.array([[RADIUS + 0.02, -RADIUS - 0.02], [RADIUS + 0.01, -RADIUS - 0.01]])
    places = np.concatenate([line, arc])
    profile, _, at = along(places[::step], [""] * 6, arc[:1])
    normals, tangents = (one[::step] for one in profile.beside(arc[0]))
    assert at.tolist() == [2 if step == 1 else 3]
    half = np.sqrt(0.5)
    np.testing.assert_allclose(normals, [[half, half], [1.0, 0.0]], atol=1e-13)
    np.testing.assert_allclose(step * tangents, [[-half, half], [0.0, 1.0]], atol=1e-13)
    for place in (arc[1], line[0], arc[-1]):
        with pytest.raises(NotOnProfileError):
            profile.beside(place)
    # A feature of one point at the corner has no side of its own.
    profile, _, _ = along(places, ["line"] * 2 + ["corner"] + ["arc"] * 3, np.zeros((0, 2)))
    with pytest.raises(NotOnProfileError):
        profile.beside(arc[0])


def test_only_the_last_boundaries_may_be_corners() -> None:
    """A way of 40 mm over a corner that is 26 mm without it, and a boundary on the way before it."""
    places = np.array([[0.04, -0.03], [0.04, -0.02], [0.026, 0.0], [0.01, 0.0]])
    corner, before = np.array([0.04, 0.0]), np.array([0.04, -0.024])
    profile, own, at = along(places, [""] * 4, np.array([before, corner]), corners=1)
    assert own.tolist() == [0, 2, 4, 5] and at.tolist() == [1, 3]
    assert profile.features == ((0, 1), (1, 3), (3, 5))
    np.testing.assert_allclose(profile.lengths, np.cumsum([0, 6, 4, 20, 14, 16]) * 1e-3, rtol=1e-12)
    for boundaries, corners, wrong in (
        ([before, corner], 0, 1),
        ([corner, before], 1, 0),
        ([before, corner, [0.3, 0.3]], 2, 2),
    ):
        with pytest.raises(NotOnProfileError) as error:
            along(places, [""] * 4, np.array(boundaries), corners=corners)
        assert error.value.args == (wrong,)
