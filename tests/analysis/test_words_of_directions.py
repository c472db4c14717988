"""Words for how artefacts deform and for bars that are proposed, against what they mean."""

from __future__ import annotations

import re
from itertools import product

import numpy as np
import pytest
from ballplate.rank.proposed_bars import bar_directions
from ballplate.rank.verdict import deformation

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
    assert deformation(GRID, (x - 0.15) ** 2 * Z) == "bends out of its plane"
    assert deformation(GRID, (x - 0.15) ** 2 * X) == "distorts unevenly"
    # In a plane, and of a body, nothing is out of the plane.
    assert deformation(GRID[:, :2], (x - 0.15) ** 2 * X[:2]) == "distorts unevenly"
    assert deformation(BODY, (BODY[:, :1] - 0.1) ** 2 * Z) == "distorts unevenly"
    twisted = np.outer(x * 0 + 1, X) * (x - 0.15) + 3.0 * (x - 0.15) * (y - 0.15) * Z
    assert deformation(GRID, twisted) == "stretches along its x, bends out of its plane"


@pytest.mark.parametrize("d", [2, 3])
def test_bars_lie_along_all_neighbours_in_a_cube(d: int) -> None:
    """Axes and diagonals, each once whatever its sign, and the words say which."""
    every = list(bar_directions(d))
    found = set()
    for _, words, (u,) in every:
        assert np.linalg.norm(u) == pytest.approx(1.0)
        whole = np.round(u / np.abs(u).max())
        np.testing.assert_allclose(whole / np.linalg.norm(whole), u, atol=1e-12)
        found.add(max(tuple(whole), tuple(-whole)))
        np.testing.assert_allclose(np.abs(in_words(words, d) @ u), 1.0, atol=1e-12)
    wanted = {max(one, tuple(-k for k in one)) for one in product((-1, 0, 1), repeat=d)}
    assert found == {one for one in wanted if any(one)}
    assert len(every) == len(found)


def in_words(words: str, d: int) -> np.ndarray:
    """The direction (d,) that words give, of length one."""
    axes = np.eye(d)
    if words in tuple("xyz"):
        return axes["xyz".index(words)]
    if plane := re.fullmatch(r"in the (.)(.) plane at (-?\d+) deg", words):
        angle = np.radians(float(plane[3]))
        first, second = (axes["xyz".index(one)] for one in plane.groups()[:2])
        return np.cos(angle) * first + np.sin(angle) * second
    diagonal = np.array([float(one) for one in re.findall(r"-?\d+", words)])
    return diagonal / np.linalg.norm(diagonal)
