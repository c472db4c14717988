"""The deformation of an artefact in words."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing.numerics import above, lstsq
from ballplate.simulator.geometry.motions import without_rigid_motion
from ballplate.simulator.machines.protocol import Array


def deformation(places: Array, displacement: Array) -> str:
    """Return a description of an artefact's deformation, from ball places and their displacements,
    both (n, d).

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    >>> deformation(square, square * [1.0, -1.0])
    'stretches along its x and shrinks along its y'
    """
    n, d = places.shape
    moved = without_rigid_motion(places, displacement[:, :, None])[:, :, 0]
    total = float((moved**2).sum())
    if total <= 1e-12 * float((displacement**2).sum()):
        return "moves as a whole"
    centred = places - places.mean(axis=0)
    linear = lstsq(centred, moved, rcond=1e-9)[0].T
    remainder = moved - centred @ linear.T
    extent = np.ptp(places, axis=0)
    words = []
    if above(((centred @ linear.T) ** 2).sum(), 0.02 * total):
        names = ("x", "y", "z")
        stretch = np.array([linear[i, i] * (extent[i] > 0) for i in range(d)])
        flat = [i for i in range(d) if extent[i] > 0]
        largest = np.abs(linear).max()
        used = [i for i in flat if above(abs(stretch[i]), 0.05 * largest)]
        if len(used) > 1 and np.ptp(stretch[used]) < 0.02 * largest and len(used) == len(flat):
            words.append("changes its size as a whole")
        else:
            grow = " and ".join(
                f"its {names[i]}" for i in used if stretch[i] * stretch[used[0]] > 0
            )
            shrink = " and ".join(
                f"its {names[i]}" for i in used if stretch[i] * stretch[used[0]] < 0
            )
            if grow:
                words.append(
                    f"stretches along {grow}" + (f" and shrinks along {shrink}" if shrink else "")
                )
        sheared = [
            (i, j)
            for i in flat
            for j in flat
            if i < j and above(abs(linear[i, j] + linear[j, i]), 0.1 * largest)
        ]
        words += [f"shears in its {names[i]}{names[j]} plane" for i, j in sheared]
    if above((remainder**2).sum(), 0.02 * total):
        out_of_plane = (
            d == 3
            and extent[2] == 0
            and above((remainder[:, 2] ** 2).sum(), 0.5 * float((remainder**2).sum()))
        )
        words.append("bends out of its plane" if out_of_plane else "distorts unevenly")
    return ", ".join(words) if words else "deforms"
