"""Fits against other parametrisations, closed forms and searches."""

from itertools import combinations

import numpy as np
import pytest
from ballplate.extensions.parts.fitting import (
    distances,
    element,
    fit,
    fit_zone,
    normals_at,
    offset,
    undetermined,
)
from numpy.testing import assert_allclose
from scipy.optimize import least_squares

TURNS = np.arange(8) * np.pi / 4
RINGS = {
    kind: np.array(
        [
            [(1 + z * slope) * np.cos(t), (1 + z * slope) * np.sin(t), z]
            for z in (-1, 0.5, 1)
            for t in TURNS
        ]
    )
    for kind, slope in (("cylinder", 0.0), ("cone", np.tan(0.4)))
}
ARC = np.column_stack([np.cos(TURNS / 5.25), np.sin(TURNS / 5.25), 0 * TURNS])  # 60 degrees
CAP = np.array(
    [[0, 0, 1]]
    + [[np.sin(a) * np.cos(t), np.sin(a) * np.sin(t), np.cos(a)] for a in (0.3, 0.6) for t in TURNS]
)
POINTS = {"circle": ARC, "sphere": CAP, **RINGS}
# Parameters of other forms of the equations.
STARTS = {
    "circle": [0, 0, 1],
    "sphere": [0, 0, 0, 1],
    "cylinder": [0, 0, 0, 0, 1],
    "cone": [0, 0, 0, 0, np.cos(0.4), 0.4],
}


def other_distances(kind, p, x):
    if kind == "circle":
        return np.hypot(x[:, 0] - p[0], x[:, 1] - p[1]) - p[2]
    if kind == "sphere":
        return np.linalg.norm(x - p[:3], axis=1) - p[3]
    direction = np.array([p[2], p[3], 1])
    away, length = x - [p[0], p[1], 0], np.linalg.norm(direction)
    across = np.linalg.norm(np.cross(away, direction), axis=1) / length
    if kind == "cylinder":
        return across - p[4]
    return across * np.cos(p[5]) - p[4] - away @ direction / length * np.sin(p[5])


@pytest.mark.parametrize("kind", STARTS)
@pytest.mark.parametrize("is_inner", [False, True])
def test_fits_are_those_of_another_parametrisation(kind, is_inner):
    rng = np.random.default_rng(1)
    points = POINTS[kind] + 1e-5 * rng.normal(size=(4, *POINTS[kind].shape))
    points[2:] += [3e-4, 1e-4, 0.0]
    tilt = [1e-3, 0, 1] if kind in RINGS else [0, 0, 1]
    start = element(
        kind, [1e-3, -1e-3, 0], tilt, 1.001, 0.401 if kind == "cone" else 0.0, is_inner=is_inner
    )
    found, residuals = fit(start, points)
    for k in range(4):
        expected = least_squares(
            lambda p, x=points[k]: 1e3 * other_distances(kind, p, x),
            STARTS[kind],
            jac="3-point",
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
        )
        sign = -1 if is_inner else 1
        assert_allclose(
            sign * residuals[k], other_distances(kind, expected.x, points[k]), atol=1e-10
        )
        assert_allclose(distances(found, points)[k], residuals[k], atol=1e-15)


def test_planes_and_lines_are_those_of_singular_values():
    rng = np.random.default_rng(2)
    x = np.column_stack([rng.uniform(size=(20, 2)), 1e-5 * rng.normal(size=20)])
    found, residuals = fit(element("plane", [0, 0, 1e-3], [1e-3, 0, 1]), x[None])
    normal = np.linalg.svd(x - x.mean(axis=0))[2][2]
    assert_allclose(abs(found.direction[0] @ normal), 1, atol=1e-14)
    assert_allclose(np.abs(residuals[0]), np.abs((x - x.mean(axis=0)) @ normal), atol=1e-14)
    flat = x * [1, 0, 1]
    edge, _ = fit(element("line", [0, 0, 0], [1, 0, 1e-3], normal=[-1e-3, 0, 1]), flat[None])
    along = np.linalg.svd(flat - flat.mean(axis=0))[2][0]
    assert_allclose(abs(edge.direction[0] @ along), 1, atol=1e-14)


@pytest.mark.parametrize("kind", ["point", "line", "plane", *STARTS])
def test_moving_elements_outwards_shortens_all_distances(kind):
    points = POINTS.get(kind, CAP)
    opening = 0.4 if kind == "cone" else 0.0
    for is_inner in (False, True):
        one = element(kind, [0, 0, 0], [0, 0, 1], 1.0, opening, [0, 1, 0], is_inner)
        moved = distances(offset(one, 0.01), points)
        assert_allclose(moved, distances(one, points) - 0.01, atol=1e-15)
        # Normals are the gradients of distances.
        lifted = points + 1e-3 * normals_at(one, points)
        assert_allclose(distances(one, lifted) - distances(one, points), 1e-3, atol=1e-6)


def test_the_minimum_zone_of_a_line_is_the_width_of_its_points():
    rng = np.random.default_rng(3)
    for _ in range(5):
        x = np.column_stack([np.linspace(0, 1, 9), 1e-4 * rng.normal(size=9), np.zeros(9)])
        _, residuals = fit_zone(element("line", [0, 0, 0], [1, 0, 0], normal=[0, 1, 0]), x[None])
        widths = []
        for i, j in combinations(range(9), 2):
            across = np.cross([0, 0, 1], x[j] - x[i])
            widths.append(np.ptp(x @ across) / np.linalg.norm(across))
        assert_allclose(np.ptp(residuals), min(widths), rtol=1e-9)


def test_the_minimum_zone_of_a_circle_is_least_among_centres():
    rng = np.random.default_rng(4)
    x = np.column_stack([np.cos(TURNS), np.sin(TURNS), 0 * TURNS])
    x[:, :2] += 1e-4 * rng.normal(size=(8, 2))
    found, residuals = fit_zone(element("circle", [0, 0, 0], radius=1.0), x[None])
    for shift in 1e-7 * rng.normal(size=(500, 2)):
        assert np.ptp(np.hypot(*(x[:, :2] - found.centre[0, :2] - shift).T)) >= np.ptp(residuals)


@pytest.mark.parametrize(
    ("kind", "points", "words"),
    [
        ("plane", [[0, 0, 0], [1, 1, 0], [2, 2, 0]], "do not determine the direction of the plane"),
        ("circle", ARC[:2], "its points do not determine"),
        ("sphere", CAP[1:9], "position and radius of the sphere; add some"),
        ("cylinder", RINGS["cylinder"][:8], "the direction of the cylinder; add some elsewhere"),
        ("cone", RINGS["cone"][:8], "angle of the cone; add some elsewhere"),
        ("line", [[1, 0, 0], [1, 0, 0]], "direction of the line"),
        *((kind, points, "") for kind, points in POINTS.items()),
    ],
)
def test_what_points_leave_open_is_said(kind, points, words):
    opening = 0.4 if kind == "cone" else 0.0
    one = element(kind, [0, 0, 0], [0, 0, 1], 1.0, opening, [0, 1, 0])
    said = undetermined(one, np.array(points, float))
    assert words in said if words else not said
