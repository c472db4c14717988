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
