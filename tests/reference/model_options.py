"""Error models with options, written out as plain sums of columns, and a dense estimate with them.

A model is a list of columns: what a parameter moves, by a function of the place. Nothing is shared
with the package; spaces of functions are monomials and truncated powers, so that parameters differ
from the package's and what does not depend on them can be compared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.reference import dense

Real = NDArray[np.float64]
Univariate = Callable[[Real], Real]
# Displacement (m, 3) of points at scale readings x (m, 3) with offsets p (m, 3).
Column = Callable[[Real, Real], Real]

HELD = ("EYX", "EZX", "EZY")
STRAIGHTNESS = ("EYX", "EZX", "EXY", "EZY", "EXZ", "EYZ")
# Components of the displacement by a turn of one unit about x, y or z of a vector, right-handed.
TURN: tuple[Callable[[Real], list[Any]], ...] = (
    lambda v: [0.0 * v[:, 0], -v[:, 2], v[:, 1]],
    lambda v: [v[:, 2], 0.0 * v[:, 1], -v[:, 0]],
    lambda v: [-v[:, 1], v[:, 0], 0.0 * v[:, 2]],
)


def powers(coefficients: int) -> list[Univariate]:
    """t, t^2, ... of a polynomial with so many coefficients, the constant counted."""
    return [lambda t, k=k: t**k for k in range(1, coefficients)]  # type: ignore[misc]


def splines(order: int, knots: tuple[float, ...]) -> list[Univariate]:
    """The splines of an order with simple knots that vanish at 0, by truncated powers."""
    found = powers(order)
    for knot in knots:
        found.append(lambda t, knot=knot: np.maximum(t - knot, 0.0) ** (order - 1))  # type: ignore[misc]
    return found


def vanishing_at_one(functions: list[Univariate]) -> list[Univariate]:
    """Those sums of functions, of which t is the first, that vanish at 1."""
    one = np.ones(1)
    return [lambda t, f=f: f(t) - f(one)[0] * t for f in functions[1:]]  # type: ignore[misc]


def kinematic(
    families: dict[str, list[Univariate]], square: bool, lower: Real, upper: Real
) -> list[Column]:
    """The chain x carries y carries z carries the probe, with functions by ISO 230-1 name."""
    columns: list[Column] = []
    for name, functions in families.items():
        axis, turns = "XYZ".index(name[2]), name[1] in "ABC"
        component = ("ABC" if turns else "XYZ").index(name[1])
        held = name in (STRAIGHTNESS if square else HELD)
        for f in vanishing_at_one(functions) if held else functions:

            def column(
                x: Real,
                p: Real,
                f: Univariate = f,
                axis: int = axis,
                component: int = component,
                turns: bool = turns,
            ) -> Real:
                value = f((x[:, axis] - lower[axis]) / (upper[axis] - lower[axis]))
                if not turns:
                    return np.asarray(value[:, None] * np.eye(3)[component])
                carried = p.copy()
                carried[:, axis + 1 :] += (x - lower)[:, axis + 1 :]
                return np.asarray(value[:, None] * np.stack(TURN[component](carried), axis=1))

            columns.append(column)
    # A turn of an axis about another, right-handed, as seen from the lower corner.
    for about, axis, along, sign in ((2, 1, 0, -1.0), (1, 2, 0, 1.0), (0, 2, 1, -1.0)):
        if square:
            assert np.cross(np.eye(3)[about], np.eye(3)[axis])[along] == sign
            columns.append(
                lambda x, p, axis=axis, along=along, sign=sign: (  # type: ignore[misc]
                    sign * (x[:, axis] - lower[axis])[:, None] * np.eye(3)[along]
                )
            )
    return columns


def empirical(
    displacing: list[Callable[[Real], Real]],
    turning: list[Callable[[Real], Real]],
    lower: Real,
    upper: Real,
) -> list[Column]:
    """Six functions of the place in [0, 1]^3; the conditions of the frame are taken out by their
    null space.

    The first function has no meaning of its own: any functions that span the space will do.
    """
    corners = {"EY": [(1.0, 0.0, 0.0)], "EZ": [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]}
    columns: list[Column] = []
    for k, name in enumerate(("EX", "EY", "EZ", "EA", "EB", "EC")):
        functions = turning if k >= 3 else displacing
        if not functions:
            continue
        places = np.array([(0.0, 0.0, 0.0), *corners.get(name, [])])
        conditions = np.stack([f(places) for f in functions], axis=1)
        free = np.linalg.svd(conditions)[2][np.linalg.matrix_rank(conditions) :]
        for weights in free:

            def column(
                x: Real,
                p: Real,
                weights: Real = weights,
                functions: list[Callable[[Real], Real]] = functions,
                k: int = k,
            ) -> Real:
                t = (x - lower) / (upper - lower)
                value = np.stack([f(t) for f in functions], axis=1) @ weights
                if k < 3:
                    return np.asarray(value[:, None] * np.eye(3)[k])
                return np.asarray(value[:, None] * np.stack(TURN[k - 3](p), axis=1))

            columns.append(column)
    return columns


@dataclass(frozen=True)
class Found:
    """Deficiency of the complete Jacobian and, of what is determined, U5, U6 and parameters' own
    uncertainties.
    """

    deficiency: int
    distances: Real
    lengths: Real
    of_columns: Real


def in_space(x: Real) -> Real:
    """Points (m, d) with a z of 0 where they have none."""
    return np.column_stack([x, np.zeros(len(x))]) if x.shape[1] == 2 else x


def estimate(design: Any, columns: list[Column]) -> Found:
    """The dense estimate of a design of plates with calibrated distances or co-ordinates."""
    d, readings = design.dimension, design.readings
    n, turns = len(design.balls.places), 3 if d == 3 else 1
    rotations, offsets = design.positions.rotations, design.probes.offsets
    true = (
        np.einsum("mij,mj->mi", rotations[readings.position], design.balls.places[readings.ball])
        + design.positions.origins[readings.position]
    )
    probe = offsets[readings.probe]

    def by_model(x: Real, p: Real) -> Real:
        found = [column(in_space(x), in_space(p))[:, :d] for column in columns]
        return np.stack(found, axis=2) if found else np.zeros((len(x), d, 0))

    poses = [
        (k, j) for k in range(len(rotations)) for j in range(d + turns)
        if not design.positions.held[k, j]
    ]  # fmt: skip
    size = d * n + len(poses) + len(columns)
    start = size - len(columns)
    model = by_model(true - probe, probe)

    def residuals(step: Any) -> Any:
        balls = design.balls.places + step[: d * n].reshape(n, d)
        pose = np.zeros((len(rotations), d + turns), step.dtype)
        for (k, j), value in zip(poses, step[d * n :], strict=False):
            pose[k, j] = value
        if d == 3:
            turned = dense.turned(pose[:, 3:], rotations)
        else:
            c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
            turned = np.stack([np.stack([c, -s], 1), np.stack([s, c], 1)], 1) @ rotations
        there = np.einsum("mij,mj->mi", turned[readings.position], balls[readings.ball])
        there = there + design.positions.origins[readings.position] + pose[readings.position, :d]
        misfit = (true + model @ step[start:] - there) / design.machine.repeatability
        rows = [misfit.ravel()]
        given = dense.known(design, "distance")
        for i in range(len(given.first)):
            between = (balls[given.first[i]] - balls[given.second[i]])[: given.dimensions[i]]
            rows.append(
                np.atleast_1d((dense.length(between) - given.value[i]) / given.uncertainty[i])
            )
        given = dense.known(design, "coordinate")
        for i in range(len(given.ball)):
            off = balls[given.ball[i], given.axis[i]] - given.value[i]
            rows.append(np.atleast_1d(off / given.uncertainty[i]))
        return np.concatenate(rows)

    spread = dense.spread(dense.jacobian(residuals, size), exact=1e-10)
    points = design.evaluation.points
    by_points = np.zeros((len(points), d, size))
    by_points[:, :, start:] = by_model(
        points, np.tile(offsets[design.evaluation.probe], (len(points), 1))
    )
    by_balls = np.zeros((n, d, size))
    by_balls[:, :, : d * n] = np.eye(d * n).reshape(n, d, d * n)
    return Found(
        spread.deficiency,
        spread.of(_between(design.balls.places, by_balls)),
        spread.of(_between(points + offsets[design.evaluation.probe], by_points)),
        spread.of(np.eye(size)[start:]),
    )


def _between(places: Real, rows: Real) -> Real:
    """Derivatives of all distances between places (n, d) with derivatives `rows` (n, d, s)."""
    first, second = np.triu_indices(len(places), 1)
    direction = places[first] - places[second]
    direction = direction / np.sqrt((direction**2).sum(axis=1))[:, None]
    return np.asarray(np.einsum("md,mds->ms", direction, rows[first] - rows[second]))
