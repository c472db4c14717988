"""Differences of plates estimated by two fits: ball by ball, independent of their frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from ballplate.results import Fit
from ballplate.simulator.estimation import BallPlaces, displacements
from ballplate.simulator.geometry import AXIS_NAMES, fit_motion
from ballplate.simulator.machines import Integers

from .campaign_tests import orthonormal
from .compared_maps import ComparedMap, MappedValues, motions, without_shared
from .normalised_errors import FigureGroup, ValueDifference

# Balls of a plate beyond which it is not compared: their joint covariance takes too much memory.
MOST_BALLS = 500


def plate_differences(
    first: ComparedMap, second: ComparedMap, coverage_factor: float
) -> tuple[FigureGroup, ...]:
    """Co-ordinates of the balls of each plate of the same name that both maps' fits have estimated,
    after the best-fit motion of its frame.
    """
    if first.fit is None or second.fit is None:
        return ()
    differences = []
    scatters = first.scatter, second.scatter
    for name in _plates(first.fit):
        if name not in _plates(second.fit):
            continue
        balls = [_balls(fit, name) for fit in (first.fit, second.fit)]
        common = [ball for ball in balls[0] if ball in balls[1]]
        d = first.dimension
        if not d <= len(common) <= MOST_BALLS:
            continue
        first_balls, second_balls = (
            _estimated(side, np.array([numbers[ball] for ball in common]))
            for side, numbers in zip((first, second), balls, strict=True)
        )
        places = first_balls.values.reshape(-1, d)
        # What is shifted alone is the motion below.
        rotation, _ = fit_motion(second_balls.values.reshape(-1, d), places)
        second_balls = second_balls.by(np.asarray(np.kron(np.eye(len(common)), rotation)))
        moving = motions(places - places.mean(axis=0)).reshape(places.size, -1)
        remainder = ValueDifference(first_balls, second_balls, scatters).without(
            orthonormal(moving)
        )
        names = tuple(f"{ball} {axis}" for ball in common for axis in AXIS_NAMES[:d])
        kind = f"balls of {name}"
        group = remainder.group(kind, "m", names, coverage_factor)
        differences.append(replace(group, test=remainder.joint_test(kind)))
    return tuple(differences)


def _plates(fit: Fit) -> tuple[str, ...]:
    artefacts = fit.design.artefacts
    return tuple(
        name for name, is_plate in zip(artefacts.names, artefacts.is_plate, strict=True) if is_plate
    )


def _balls(fit: Fit, artefact: str) -> dict[str, int]:
    """Indices of a plate's balls by name."""
    design = fit.design
    ball_numbers = design.balls.of(design.artefacts.names.index(artefact))
    return {design.balls.names[ball]: int(ball) for ball in ball_numbers}


def _estimated(side: ComparedMap, index: Integers) -> MappedValues:
    """Co-ordinates (n d,) of the balls of indices (n,) in the frame of their artefact."""
    assert side.fit is not None
    moved = displacements(side.fit.functions.at, BallPlaces(index))
    n, d = moved.places.shape
    balls = len(side.fit.design.balls.names)
    effects = np.zeros((n, d, balls, moved.own.shape[2]))
    effects[np.arange(n), :, index] = moved.own
    common = moved.common.reshape(n * d, -1)
    root = side.fit.sigma * np.concatenate([common, effects.reshape(n * d, -1)], axis=1)
    root, shared = without_shared(root, side.absorbed)
    null = moved.null.reshape(n * d, -1)
    return MappedValues(moved.places.ravel(), root, null, moved.size.ravel(), shared)
