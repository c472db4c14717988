"""Motions of machine, plates and positions along undetermined and weakly determined directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.rank import null_changes, weak_changes
from ballplate.simulator.computing import lstsq, single_threaded
from ballplate.simulator.design import Readings
from ballplate.simulator.estimation import Linearisation, correction_rows
from ballplate.simulator.geometry import cross_matrices
from ballplate.simulator.inputs import Target
from ballplate.simulator.machines import Array, Integers


@dataclass(frozen=True, eq=False)
class Motion:
    """A change of all parameters: `shared` (s,) and `balls` (n, d) of all balls, in metres and
    radians, with the size and sign of the rank report.
    """

    shared: Array
    balls: Array


@single_threaded
def null_motions(linearisation: Linearisation) -> tuple[Motion, ...]:
    """The undetermined directions, in the order of the rank report."""
    return tuple(Motion(*change) for change in null_changes(linearisation))


@single_threaded
def weak_motions(linearisation: Linearisation, target: Target | None) -> tuple[Motion, ...]:
    """Return the weakly determined directions, one standard deviation long, weakest first, with
    the motions of balls that the observations imply.
    """
    motions = []
    for shared in weak_changes(linearisation, target):
        # By the same standard normal variables that make this of the shared parameters.
        made, *_ = lstsq(linearisation.shared, shared, rcond=None)
        motions.append(
            Motion(shared, linearisation.balls.common[:, :, : linearisation.rank] @ made)
        )
    return tuple(motions)


def moved_points(
    linearisation: Linearisation, motion: Motion, points: Array, probes: Integers
) -> Array:
    """By how much (m, d) corrected points for scale readings `points` (m, d) with probes of indices
    (m,) change, in metres.
    """
    rows = correction_rows(
        linearisation.design, linearisation.layout, linearisation.state, points, probes
    )
    return np.asarray(rows @ motion.shared)


def moved_balls(linearisation: Linearisation, motion: Motion, readings: Readings) -> Array:
    """Return the changes (m, d) of the locations of balls of plates that are read, in metres.

    With T(y) = R y + t, and R turned by a small rotation w about the machine's axes, it is dt + w
    x R y + R dy.
    """
    state, d = linearisation.state, linearisation.design.dimension
    columns = linearisation.layout.pose_columns[readings.position]
    poses = np.where(columns >= 0, motion.shared[np.maximum(columns, 0)], 0.0)
    rotation = state.rotations[readings.position]
    arms = np.einsum("mij,mj->mi", rotation, state.balls[readings.ball])
    turned = (
        np.einsum("mij,mj->mi", cross_matrices(arms), poses[:, d:])
        if d == 3
        else poses[:, 2:] * np.stack([-arms[:, 1], arms[:, 0]], axis=1)
    )
    displacements = np.einsum("mij,mj->mi", rotation, motion.balls[readings.ball])
    return poses[:, :d] + turned + displacements
