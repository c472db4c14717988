"""Lengths of the body diagonals of the volume."""

from __future__ import annotations

import numpy as np
from ballplate import Design, Distances, MeasuredPoints, QuantityKind
from ballplate.simulator.design import SharedLayout


def body_diagonals(design: Design, layout: SharedLayout) -> tuple[Distances, ...]:
    """Distances between opposite corners of the volume, corrected for the probe of the points."""
    edges = zip(*design.machine.volume.corners, strict=True)
    corners = np.stack(np.meshgrid(*edges), axis=-1).reshape(-1, design.dimension)
    points = MeasuredPoints(corners, np.full(len(corners), design.evaluation.probe))
    half = len(corners) // 2
    opposite = np.array([(i, len(corners) - 1 - i) for i in range(half)])
    return (Distances(points, opposite, tuple(f"diagonal {i + 1}" for i in range(half))),)


QUANTITY = QuantityKind(
    "lengths of the body diagonals", body_diagonals, are_lengths=True, effect="body diagonals"
)
