"""Arc lengths along turned profiles."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.extensions.splines.arc_lengths import arc_lengths

RADIUS = 0.037


def dome(degrees: np.ndarray) -> np.ndarray:
    """Radius and axial co-ordinate on a quarter circle that ends on the axis at 90 degrees."""
    angle = np.radians(degrees)
    return RADIUS * np.column_stack([np.cos(angle), np.sin(angle) - 1.0])


def test_points_on_a_circle_have_its_arcs() -> None:
    degrees = np.array([0.0, 3.0, 11.0, 30.0, 31.0, 60.0, 85.0])
    found = arc_lengths(dome(degrees), [""] * 7)
    np.testing.assert_allclose(found, RADIUS * np.radians(degrees), rtol=1e-13)


def test_labels_part_features_at_a_corner() -> None:
    """A cylinder and a face, which a common curve would round off."""
    places = np.array([[0.04, -0.03], [0.04, -0.02], [0.04, -0.01], [0.03, 0.0], [0.02, 0.0]])
    found = arc_lengths(places, ["cylinder"] * 3 + ["face"] * 2)
    assert found[-1] == pytest.approx(0.03 + np.hypot(0.01, 0.01))
    assert arc_lengths(places[:1], [""]).tolist() == [0.0]


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
    found = arc_lengths(places[::step], labels[::step])
    points = ellipse[::step, 1] + 1j * ellipse[::step, 0]
    curvature = [signed_curvature(*points[k : k + 3]) for k in range(5)]
    curvature = [curvature[0], *curvature, curvature[-1]]
    lengths = found[:7] if backwards else found[2:]
    for k in range(6):
        mean = 0.5 * (curvature[k] + curvature[k + 1])
        chord = points[k + 1] - points[k]
        turn = 2.0 * np.arcsin(0.5 * abs(mean * chord))
        assert lengths[k + 1] - lengths[k] == pytest.approx(turn / abs(mean), rel=1e-12)
