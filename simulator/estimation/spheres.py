"""Spheres through points, for the pivot of a Bryan gauge and the length of its bar."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing.decompositions import lstsq
from ballplate.simulator.machines.protocol import Array

# Directions of the centre that points show by less than this fraction of what they show best are
# left alone: a machine's errors and noise bend a plane by less.
FLAT = 1e-3


def fit_sphere(points: Array, near: Array) -> tuple[Array, float]:
    """Centre (d,) and radius of the sphere, in two dimensions the circle, through points (m, d).

    The squares |x - c|^2 - r^2 are minimised, which is linear in c and |c|^2 - r^2. Where the
    points lie in a plane or on a line, the centre stays where `near` is across it.
    """
    middle = points.mean(axis=0)
    local = points - middle
    half = 0.5 * ((local**2).sum(axis=1) - (local**2).sum(axis=1).mean())
    start = near - middle
    move = lstsq(local, half - local @ start, rcond=FLAT)[0]
    centre = start + move
    return middle + centre, float(np.sqrt(((local - centre) ** 2).sum(axis=1).mean()))
