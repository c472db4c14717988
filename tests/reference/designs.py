"""Designs of NPL Report CISE 15/98 put together by hand, for tests and benchmarks of the estimator
alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from ballplate.simulator.design.arrays import Design, Observations, Readings
from ballplate.simulator.design.objects import (
    Artefacts,
    Balls,
    EvaluationPoints,
    Machine,
    Positions,
    Probes,
    Tasks,
    UnknownLengths,
    Volume,
)
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.kinematic import kinematic_model
from numpy.typing import NDArray

Real = NDArray[np.float64]

# Tips of a star probe: down, and along and against x and y.
TIPS = {
    "down": (0.0, 0.0, -0.05),
    "+x": (0.05, 0.0, 0.0),
    "-x": (-0.05, 0.0, 0.0),
    "+y": (0.0, 0.05, 0.0),
    "-y": (0.0, -0.05, 0.0),
}
# Which machine axes the first and the second axis of a plate lie along, in planes of constant x, y
# and z.
PLANE_AXES = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}
PLANE_TIPS = {"x": ("+x", "-x"), "y": ("+y", "-y"), "z": ("down",)}
SIDE = 0.75
SIGMA = 2e-7


@dataclass(frozen=True)
class Placed:
    """A pose of a plate: rotation (3, 3), origin (3,), and the tips that it is read with."""

    rotation: Real
    origin: Real
    tips: tuple[str, ...]


def grid(n: int, side: float = SIDE) -> Real:
    """n x n balls (n^2, 3), the first co-ordinate running fastest."""
    line = np.linspace(0.0, side, n)
    return np.array([(a, b, 0.0) for b in line for a in line])


def square(n: int, side: float = SIDE) -> Real:
    """Only the balls on the edge of a grid."""
    balls = grid(n, side)
    return np.asarray(balls[(np.isin(balls[:, :2], (0.0, side))).any(axis=1)])


def corner_sides(balls: Real) -> list[tuple[int, int]]:
    """The four sides between the corners of a grid or a square."""
    side = balls[:, :2].max()
    corners = [
        int(np.abs(balls[:, :2] - corner).sum(axis=1).argmin())
        for corner in ((0, 0), (0, side), (side, side), (side, 0))
    ]
    return [(corners[i], corners[(i + 1) % 4]) for i in range(4)]


def neighbours(balls: Real) -> list[tuple[int, int]]:
    """All pairs of balls next to one another in a grid."""
    apart = np.sqrt(((balls[:, None] - balls[None]) ** 2).sum(axis=2))
    pitch = apart[apart > 0].min()
    first, second = np.nonzero(np.triu(np.abs(apart - pitch) < 1e-9))
    return [(int(i), int(j)) for i, j in zip(first, second, strict=True)]


def placed(
    plane: str, level: float, corner: tuple[float, float], turns: int, side: float = SIDE
) -> Placed:
    """A plate in a plane of constant x, y or z, in quarter turns about its centre.

    `corner` is the lowest corner of the area it covers, in the order of the other two machine axes
    (x, y, z).
    """
    first, second = PLANE_AXES[plane]
    third = 3 - first - second
    frame = np.zeros((3, 3))
    frame[first, 0] = frame[second, 1] = frame[third, 2] = 1.0
    quarter = np.linalg.matrix_power(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), turns % 4)
    rotation = frame @ quarter
    centre = np.zeros(3)
    centre[third] = level
    centre[sorted((first, second))] = np.add(corner, side / 2)
    origin = centre - rotation @ np.array([side / 2, side / 2, 0.0])
    return Placed(rotation, origin, PLANE_TIPS[plane])


def six_positions(side: float = SIDE) -> list[Placed]:
    """Experiment 6.2.1: two positions in each of the planes z, x, y, each turned against the
    other.
    """
    low, high = (0.0, 0.0), (1.0 - side, 1.0 - side)
    turns = {"z": (0, 1), "x": (1, 0), "y": (0, 1)}
    return [
        placed(plane, level, corner, turns[plane][i], side)
        for plane in "zxy"
        for i, (level, corner) in enumerate(((0.25, low), (0.75, high)))
    ]


def four_positions() -> list[Placed]:
    """Experiment 6.1.1: two positions across z, one across x and one across y."""
    corner = (0.125, 0.125)
    return [
        placed("z", 0.1, corner, 0),
        placed("z", 0.9, corner, 0),
        placed("x", 0.5, corner, 2),
        placed("y", 0.5, corner, 1),
    ]


def plate_design(
    balls: Real,
    positions: Sequence[Placed],
    sides: Sequence[tuple[int, int]] = (),
    coordinates: Sequence[int] = (),
    position_coefficients: int = 5,
    rotation_coefficients: int = 5,
    repeatability: tuple[float, float, float] = (SIGMA, SIGMA, SIGMA),
    lower: tuple[float, float, float] = (0.0, 0.0, 0.0),
    upper: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> Design:
    """One plate read in all positions, with calibrated distances `sides` or co-ordinates of the
    balls listed.

    Without calibrated co-ordinates the first pose is held.
    """
    rows = [
        (ball, k, list(TIPS).index(tip))
        for k, pose in enumerate(positions)
        for tip in pose.tips
        for ball in range(len(balls))
    ]
    ball, position, probe = np.array(rows, np.int64).T
    held = np.zeros((len(positions), 6), bool)
    held[0] = not len(coordinates)
    first, second = np.array(list(sides), np.int64).reshape(-1, 2).T
    certified = np.repeat(np.array(list(coordinates), np.int64), 3)
    axis = np.tile(np.arange(3), len(coordinates))
    return Design(
        model=kinematic_model(
            ARRANGEMENTS["MB2"], position_coefficients, rotation_coefficients, lower, upper
        ),
        machine=Machine(Volume(np.array(lower), np.array(upper)), np.array(repeatability)),
        probes=Probes(
            tuple(TIPS), np.array(list(TIPS.values())), np.zeros((len(TIPS), len(lower)), bool)
        ),
        artefacts=Artefacts(("plate",), np.array([True]), np.array([False])),
        balls=Balls(
            tuple(f"b{i}" for i in range(len(balls))), np.zeros(len(balls), np.int64), balls
        ),
        positions=Positions(
            tuple(f"p{k}" for k in range(len(positions))),
            np.zeros(len(positions), np.int64),
            np.array([pose.rotation for pose in positions]),
            np.array([pose.origin for pose in positions]),
            held,
        ),
        readings=Readings(ball, position, probe, np.ones(len(ball), np.int64)),
        observations=(
            CalibratedDistances(
                first,
                second,
                np.full(len(first), 3),
                np.sqrt(((balls[first] - balls[second]) ** 2).sum(axis=1)),
                np.full(len(first), SIGMA),
            ),
            CalibratedCoordinates(
                certified, axis, balls[certified, axis], np.full(len(certified), SIGMA)
            ),
            no_lengths(),
            Priors((), *np.zeros((3, 0), np.int64), np.zeros((0, 0)), *np.zeros((2, 0))),
        ),
        unknown_lengths=UnknownLengths((), np.zeros(0, np.int64), np.zeros(0)),
        evaluation=EvaluationPoints(np.zeros((0, 3)), 0),
        tasks=Tasks((), np.zeros((0, 2, 3)), np.zeros((0, 2), np.int64), ()),
    )


def altered(design: Design, **changes: Any) -> Design:
    """The design with other fields, or parts of it with the other fields that a dictionary
    states; observations take the place of those of their kind.
    """
    observed = [one for one in changes.values() if isinstance(one, Observations)]
    fields = {
        name: replace(getattr(design, name), **other) if isinstance(other, dict) else other
        for name, other in changes.items()
        if not isinstance(other, Observations)
    }
    return replace(design, **fields).observed(*observed)


def no_lengths() -> Lengths:
    """A design's lengths where it has no length standard."""
    none, empty = np.zeros(0, np.int64), np.zeros(0)
    return Lengths(
        none, none, empty, empty, none.astype(bool), np.zeros((0, 3)), none.astype(bool), none
    )


def grid_experiment(n: int, points: int = 200, position_coefficients: int = 5) -> Design:
    """Experiment 6.2.1 on an n x n grid, its four sides calibrated, with random evaluation
    points.
    """
    balls = grid(n)
    design = plate_design(
        balls, six_positions(), corner_sides(balls), position_coefficients=position_coefficients
    )
    return altered(design, evaluation={"points": np.random.default_rng(1).random((points, 3))})
