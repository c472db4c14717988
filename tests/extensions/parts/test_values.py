"""Values of dimensions and their derivatives, against closed forms and known displacements."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.parts.part_file import load_part
from ballplate.extensions.parts.values import combine, fitted, members, weights
from ballplate.simulator.geometry import rotation_matrix
from numpy.testing import assert_allclose

NAMES = [
    "diameter bore 1",
    "diameter ball",
    "radius corner",
    "distance bore 1, bore 2",
    "distance C, right",
    "distance cross, A",
    "angle A, B",
    "flatness A",
    "straightness edge",
    "roundness pin hole",
    "cylindricity bore 2",
    "parallelism right",
    "perpendicularity bore 1",
    "position bore 2",
    "position countersink",
]


@cache
def block():
    return load_part("designs/parts/block.yaml")


def dimension(name):
    return next(one for one in block().dimensions if one.name == name)


def nominal_points(one):
    return {name: block().features[name].points for name in one.used}


def value_at(one, points):
    fits = fitted(block(), one, {name: x[None] for name, x in points.items()})
    return combine(one, members(block(), one, fits)).item()


def test_the_example_has_the_dimensions_tested_here():
    assert [one.name for one in block().dimensions] == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_nominal_points_deviate_by_nothing(name):
    one = dimension(name)
    assert abs(value_at(one, nominal_points(one))) < 1e-14


@pytest.mark.parametrize("name", NAMES)
def test_a_motion_of_the_whole_part_changes_nothing(name):
    one = dimension(name)
    rng = np.random.default_rng(5)
    points = {
        feature: x + 1e-6 * rng.normal(size=(len(x), 1)) * block().features[feature].normals
        for feature, x in nominal_points(one).items()
    }
    rotation, shift = rotation_matrix([1e-5, -2e-5, 3e-5]), [1e-5, 2e-5, -3e-5]
    moved = {feature: x @ rotation.T + shift for feature, x in points.items()}
    assert_allclose(value_at(one, moved), value_at(one, points), atol=1e-10)


# The minimum zone has no derivative at a perfect form.
@pytest.mark.parametrize("name", [name for name in NAMES if name != "roundness pin hole"])
def test_weights_are_the_effect_of_small_displacements(name):
    one = dimension(name)
    rng = np.random.default_rng(6)
    by_feature = weights(block(), one)
    assert set(by_feature) == set(one.used)
    moves = {feature: 1e-9 * rng.normal(size=len(x)) for feature, x in nominal_points(one).items()}
    points = {
        feature: np.stack(
            [
                x + sign * moves[feature][:, None] * block().features[feature].normals
                for sign in (1, -1)
            ]
        )
        for feature, x in nominal_points(one).items()
    }
    there, back = members(block(), one, fitted(block(), one, points))
    expected = sum(by_feature[feature] @ moves[feature] for feature in one.used)
    assert_allclose((there - back) / 2, expected, atol=1e-14)


def sizes(name, feature):
    rows = weights(block(), dimension(name))[feature]
    return np.linalg.norm(rows, axis=1)


def test_uncertainties_by_points_are_those_of_closed_forms():
    # n points evenly on a circle: radius 1 / sqrt(n), each co-ordinate of the centre sqrt(2 / n).
    assert_allclose(sizes("diameter bore 1", "bore 1"), 2 / np.sqrt(16), rtol=1e-8)
    assert_allclose(sizes("distance bore 1, bore 2", "bore 1"), np.sqrt(2 / 16), rtol=1e-8)
    # Of two planes the mean, whose lever is half the distance of their centroids across.
    y = {name: block().features[name].points[:, 1] for name in ("C", "right")}
    lever = (y["C"].mean() - y["right"].mean()) / 2
    for name, one in y.items():
        expected = np.sqrt(1 / len(one) + lever**2 / ((one - one.mean()) ** 2).sum())
        assert_allclose(sizes("distance C, right", name), expected, rtol=1e-8)
    # The axis is straight through two circles, here at the ends: its tilt is a difference.
    assert_allclose(
        sizes("perpendicularity bore 1", "bore 1"), np.sqrt(2) * np.sqrt(2 / 8), rtol=1e-8
    )
    assert_allclose(sizes("position bore 2", "bore 2"), np.sqrt(2 / 8), rtol=1e-8)
    # A plane over a grid: the inverse of the spread of its points.
    x = block().features["A"].points[:, 1]
    y = block().features["B"].points[:, 2]
    spread = [1 / np.sqrt(((v - v.mean()) ** 2).sum()) for v in (x, y)]
    assert_allclose(sizes("angle A, B", "A"), spread[0], rtol=1e-8)
    assert_allclose(sizes("angle A, B", "B"), spread[1], rtol=1e-8)


def test_known_displacements_are_found():
    one = dimension("position bore 2")
    points = nominal_points(one)
    points["bore 2"] = points["bore 2"] + [3e-6, 4e-6, 0]
    assert_allclose(value_at(one, points), 10e-6, rtol=1e-6)
    # Datum B is farther out by 4 um, which is where the bore was moved less.
    points["B"] = points["B"] + [0, 4e-6, 0]
    assert_allclose(value_at(one, points), 6e-6, rtol=1e-6)

    one = dimension("perpendicularity bore 1")
    points = nominal_points(one)
    points["bore 1"] = points["bore 1"] @ rotation_matrix([3e-5, 4e-5, 0]).T
    assert_allclose(value_at(one, points), 0.04 * 5e-5, rtol=1e-6)

    one = dimension("parallelism right")
    points = nominal_points(one)
    points["right"] = points["right"] @ rotation_matrix([0, 0, 1e-5]).T
    assert_allclose(value_at(one, points), 0.08 * 1e-5, rtol=1e-4)

    for name, length in (
        ("distance bore 1, bore 2", np.hypot(0.1, 0.065)),
        ("diameter ball", 0.025),
    ):
        one = dimension(name)
        assert_allclose(one.nominal, length, rtol=1e-15)
        grown = {feature: x * (1 + 1e-5) for feature, x in nominal_points(one).items()}
        assert_allclose(value_at(one, grown), length * 1e-5, rtol=1e-9)


def test_a_second_axis_turns_the_datums():
    one = dimension("position countersink")
    points = nominal_points(one)
    # Bore 2 turns the frame about bore 1, by its displacement over their distance.
    away = points["bore 2"].mean(axis=0) - points["bore 1"].mean(axis=0)
    sideways = np.cross([0, 0, 1], away) / np.linalg.norm(away)
    points["bore 2"] = points["bore 2"] + 2e-6 * sideways
    turned = 2e-6 / np.linalg.norm(away) * np.hypot(0.05, 0.035)
    assert_allclose(value_at(one, points), 2 * turned, rtol=1e-4)


@pytest.mark.parametrize("order", ["ABC", "BAC", "CAB"])
def test_datums_are_taken_in_their_order(order, tmp_path):
    file = tmp_path / "block.yaml"
    text = Path("designs/parts/block.yaml").read_text()
    file.write_text(f"{text}  - {{position: ball, datums: [{', '.join(order)}]}}\n")
    part = load_part(file)
    one, rng = part.dimensions[-1], np.random.default_rng(7)
    points = {name: part.features[name].points @ rotation_matrix([1e-3] * 3).T for name in one.used}
    nominal, measured = [], []
    for name in order:
        feature = part.features[name]
        points[name] = points[name] @ rotation_matrix(1e-3 * rng.normal(size=3)).T + 1e-4
        middle, normal = points[name].mean(axis=0), feature.nominal.direction
        found = np.linalg.svd(points[name] - middle)[2][2]
        nominal.append((feature.points.mean(axis=0), normal))
        measured.append((middle, found * np.sign(found @ normal)))
    # The first gives a direction, the second a turn about it, each its own distance.
    triads = []
    for planes in (nominal, measured):
        first, second = planes[0][1], np.cross(planes[0][1], planes[1][1])
        second = second / np.linalg.norm(second)
        triads.append(np.stack([first, second, np.cross(first, second)]))
    turned = triads[0].T @ triads[1]
    away = turned @ rotation_matrix([1e-3] * 3) @ part.features["ball"].nominal.centre
    for (place, normal), (middle, _) in zip(nominal, measured, strict=True):
        away = away - (turned @ middle - place) @ normal * normal
    away = away - part.features["ball"].nominal.centre
    fits = fitted(part, one, {name: x[None] for name, x in points.items()})
    assert_allclose(combine(one, members(part, one, fits)), 2 * np.linalg.norm(away), atol=1e-10)
