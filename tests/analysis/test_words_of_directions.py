"""Words for how artefacts deform, against what they mean."""

from __future__ import annotations

from itertools import product

import ballplate as bp
import numpy as np
import pytest
from ballplate.rank._descriptions import deformation, shape

from tests.analysis import wording
from tests.reference.small_quickstart import small_sections

GRID = np.array([[0.1 * x, 0.15 * y, 0.0] for x in range(4) for y in range(3)])
# Equal moments, so that a shear is half a turn and half a symmetric strain.
SQUARE = np.array([[0.1 * x, 0.1 * y, 0.0] for x in range(3) for y in range(3)])
BODY = np.array(list(product([0.0, 0.1, 0.2], [0.0, 0.15, 0.3], [0.0, 0.2])))
X, Y, Z = np.eye(3)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("places", "matrix", "words"),
    [
        (GRID, np.outer(X, X), "stretches along its x"),
        (GRID, np.outer(Y, Y), "stretches along its y"),
        (GRID, np.diag([1.0, -0.5, 0.0]), "stretches along its x and shrinks along its y"),
        (GRID, np.diag([1.0, 0.5, 0.0]), "stretches along its x and its y"),
        (GRID, np.diag([1.0, 1.0, 0.0]), "changes its size as a whole"),
        (SQUARE, np.outer(X, Y), "shears in its xy plane"),
        (GRID, np.outer(X, Y) - np.outer(Y, X), "moves as a whole"),
        (SQUARE, np.outer(X, X) + np.outer(Y, X), "stretches along its x, shears in its xy plane"),
        (BODY, np.eye(3), "changes its size as a whole"),
        (BODY, np.diag([1.0, -1.0, 1.0]), "stretches along its x and its z and shrinks along its y"),
        (BODY, np.outer(X, Z), "shears in its xz plane"),
        (BODY, np.outer(Z, Y), "shears in its yz plane"),
    ],
)  # fmt: skip
def test_linear_deformations(
    places: np.ndarray, matrix: np.ndarray, words: str, sign: float
) -> None:
    assert deformation(places, sign * places @ matrix.T) == words


def test_bends_and_uneven_distortions() -> None:
    x, y = GRID[:, :1], GRID[:, 1:2]
    assert deformation(GRID, (x - 0.15) ** 2 * Z) == wording.BENDS_OUT_OF_ITS_PLANE
    assert deformation(GRID, (x - 0.15) ** 2 * X) == "distorts unevenly"
    # In a plane, and of a body, nothing is out of the plane.
    assert deformation(GRID[:, :2], (x - 0.15) ** 2 * X[:2]) == "distorts unevenly"
    assert deformation(BODY, (BODY[:, :1] - 0.1) ** 2 * Z) == "distorts unevenly"
    twisted = np.outer(x * 0 + 1, X) * (x - 0.15) + 3.0 * (x - 0.15) * (y - 0.15) * Z
    assert deformation(GRID, twisted) == wording.STRETCHES_ALONG_ITS_BENDS


@pytest.mark.parametrize("degree", range(1, 12))
def test_the_shape_of_a_curve_is_the_degree_that_describes_it(degree: int) -> None:
    """Polynomials that are orthogonal on the places of the curve, so that a fit of lower degrees
    leaves one of them as it is: another one beside it counts from a thousandth on.
    """
    t = np.linspace(0.0, 1.0, 201)
    curves = np.linalg.qr(np.polynomial.legendre.legvander(2.0 * t - 1.0, 12))[0]
    curve, beside = (
        curves[:, degree : degree + 2].T / np.abs(curves[:, degree : degree + 2]).max(0)[:, None]
    )
    words = ["", "linear", "quadratic", "cubic"]
    words += [f"of degree {k}" for k in range(4, 11)] + ["irregular"] * 2
    assert shape(t, curve) == shape(t, curve + 0.99e-3 * beside) == words[degree]
    assert shape(t, curve + 1.01e-3 * beside) == words[degree + 1]


@pytest.mark.parametrize(
    ("axis", "name", "meaning"),
    [("z", "EXZ", "Z to X"), ("z", "EYZ", "Z to Y"), ("y", "EYZ", "Z to Y")],
)
def test_a_straightness_in_proportion_to_the_axis_is_a_squareness(
    axis: str, name: str, meaning: str
) -> None:
    """Two positions in planes across an axis leave squarenesses undetermined."""
    sections = small_sections()
    sections["positions"] = [p for p in sections["positions"] if p["plane"] == axis]
    sections["error_model"] |= {"position_coefficients": 2, "rotation_coefficients": 1}
    verdict = bp.run(bp.experiment(sections)).verdict
    words = [str(direction) for direction in verdict.null]
    assert any(f"{name} (squareness of {meaning})" in line for line in words), words
    assert not any("straightness" in line and "linear" in line for line in words)
