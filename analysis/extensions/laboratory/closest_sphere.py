"""Spheres closest to points, for balls reported as points on their surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import lstsq, svd
from ballplate.simulator.geometry import FLAT, fit_sphere
from ballplate.simulator.machines import Array

# Any sphere goes through four.
FEWEST_POINTS = 5
STEPS = 6


@dataclass(frozen=True)
class SphereFit:
    """The sphere closest to points: its `centre` (3,) and radius in metres, and residuals.

    `residuals` (m,) are distances from it, and `cofactor` (3, 3) times the variance of a point is
    the covariance of the centre.
    """

    centre: Array
    radius: float
    residuals: Array
    cofactor: Array

    @property
    def degrees_of_freedom(self) -> int:
        """Points beyond the four that any sphere goes through."""
        return len(self.residuals) - 4


def closest_sphere(points: Array) -> SphereFit | None:
    """Return the sphere whose distances from points (m, 3) have the smallest sum of squares,
    unless the points are nearly in a plane, or fewer than five.

    Gauss-Newton steps start from the sphere of `fit_sphere`; errors of the points hardly turn
    normals, so that a few suffice.
    """
    if len(points) < FEWEST_POINTS:
        return None
    middle = points.mean(axis=0)
    spread = svd(points - middle, compute_uv=False)
    if not spread[2] > FLAT * spread[0]:
        return None
    centre, radius = fit_sphere(points, middle)
    for _ in range(STEPS):
        towards = points - centre
        distances = np.linalg.norm(towards, axis=1)
        if not distances.all():
            return None
        rows = np.column_stack([-towards / distances[:, None], -np.ones(len(points))])
        step = lstsq(rows, radius - distances)[0]
        centre, radius = centre + step[:3], radius + float(step[3])
    residuals = np.linalg.norm(points - centre, axis=1) - radius
    inverse = np.linalg.inv(np.linalg.qr(rows)[1])
    return SphereFit(centre, radius, residuals, (inverse @ inverse.T)[:3, :3])
