"""Nominal points of a profile, moved against the errors that a curve has there.

NISTIR 6517, section 2: errors are normal to the surface, and neighbouring cuts end where their
compensated lines cross. An error is positive where material is left.
"""

from __future__ import annotations

import numpy as np
from ballplate.presentation import table_csv
from ballplate.simulator.machines import Array
from ballplate.simulator.splines import SplineError, SplineProblem

from .error_curve import SIDES, ErrorCurve
from .profile import NotOnProfileError, Profile

# Sine of the least angle at which two features make a corner.
CORNER = 0.05


def compensated_points(curve: ErrorCurve, profile: Profile) -> tuple[list[str], Array, Array]:
    """Names of the points of a curve along a profile and of its corners behind them, their nominal
    and their compensated places (m, 2), radius and axial co-ordinate.

    :raises SplineError: a corner is hardly one.
    """
    at = np.searchsorted(profile.lengths, curve.fit.x)
    nominal = profile.places[at]
    moved = nominal - curve.fit.values(curve.fit.x)[:, None] * profile.normals[at]
    corners = [_corner(curve, profile, corner) for corner in curve.corners]
    names = [*curve.points.names, *(f"corner {k}" for k in range(1, len(corners) + 1))]
    return (
        names,
        np.array([*nominal, *(place for place, _ in corners)]),
        np.array([*moved, *(place for _, place in corners)]),
    )


def compensated_csv(curve: ErrorCurve, profile: Profile) -> str:
    """The compensated points as CSV."""
    names, *both = compensated_points(curve, profile)
    columns = {
        f"{word} {axis}, mm": places[:, k].tolist()
        for word, places in zip(("nominal", "compensated"), both, strict=True)
        for k, axis in enumerate("xz")
    }
    return "\n".join([*table_csv({"point": names, **columns}), ""])


def _corner(curve: ErrorCurve, profile: Profile, corner: float) -> tuple[Array, Array]:
    """A corner, and where the compensated lines of its two features cross, each with the slope that
    its errors have there.
    """
    place = profile.places[int(np.argmin(np.abs(profile.lengths - corner)))]
    try:
        normals, tangents = profile.beside(place)
    except NotOnProfileError:
        text = "the corner at {0} adjoins a feature of one point; give that feature another point"
        raise SplineError([SplineProblem(text, (corner,))]) from None
    if abs(np.linalg.det(normals)) < CORNER:
        text = "the features at {0} are nearly tangent; make it a boundary"
        raise SplineError([SplineProblem(text, (corner,))])
    errors, slopes = (
        np.array([curve.fit.values(np.array([corner]), k, side) for side in SIDES]) for k in (0, 1)
    )
    directions = tangents - slopes * normals
    starts = -errors * normals
    across = np.stack([directions[0], -directions[1]], axis=1)
    beyond = np.linalg.solve(across, starts[1] - starts[0])[0]
    return place, place + starts[0] + beyond * directions[0]
