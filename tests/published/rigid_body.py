"""A machine as a product of rigid motions, written for the comparison with Park, Burdekin and Peggs
alone.

Rotations are full ones, by Rodrigues' formula. Nothing of the package is used.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

AXES = "xyz"


def _motion(rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    angle = np.sqrt(rotation @ rotation)
    if angle:
        x, y, z = rotation / angle
        turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        matrix[:3, :3] += np.sin(angle) * turn + (1.0 - np.cos(angle)) * turn @ turn
    matrix[:3, 3] = translation
    return matrix


def tip_error(
    chain: Sequence[Sequence[str]],
    position: np.ndarray,
    probe: np.ndarray,
    errors: Mapping[str, float],
) -> np.ndarray:
    """Where the tip is in the workpiece's frame, less where it should be.

    `chain` has the axes on the probe's and on the workpiece's side, from the ground outwards;
    `errors` are those of the axes where they stand now: dy_x is the displacement in y by the x
    axis, Ey_x its rotation about y, and a, b1 and b2 turn the axes' directions. A table goes the
    other way as the scale counts.
    """
    direction = np.eye(3)
    direction[0, 1] = -errors.get("a", 0.0)
    direction[2, :2] = -errors.get("b1", 0.0), -errors.get("b2", 0.0)
    sides = []
    for side, sign in zip(chain, (1.0, -1.0), strict=True):
        whole = np.eye(4)
        for name in side:
            k = AXES.index(name)
            shift = position[k] * direction[k] + [errors.get(f"d{c}_{name}", 0.0) for c in AXES]
            turn = np.array([errors.get(f"E{c}_{name}", 0.0) for c in AXES])
            whole = whole @ _motion(np.zeros(3), sign * shift) @ _motion(turn, np.zeros(3))
        sides.append(whole)
    tip = np.linalg.solve(sides[1], sides[0] @ np.append(probe, 1.0))
    return np.asarray(tip[:3] - position - probe)
