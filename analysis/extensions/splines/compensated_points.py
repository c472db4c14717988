"""Nominal points of a profile, moved against the errors that a curve has there.

NISTIR 6517, section 2: errors are normal to the surface, and neighbouring cuts end where their
compensated lines cross. An error is positive where material is left.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ballplate.extensions.splines.curve_tables import SIDES
from ballplate.extensions.splines.error_curve import ErrorCurve
from ballplate.presentation import fixed
from ballplate.simulator.inputs import CsvWriter, header_names, read_table
from ballplate.simulator.machines import Array
from ballplate.simulator.splines import SplineError, SplineProblem

from .profile import NotOnProfileError

# Sine of the least angle at which two features make a corner.
CORNER = 0.05


@dataclass(frozen=True, eq=False)
class CompensatedPoints:
    """Points of a profile: `names`, `nominal` places (m, 2), unit `normals` (m, 2) out of the
    material, `errors` (m,) along them with their standard uncertainties, and `compensated` places
    (m, 2), radius and axial co-ordinate, in metres.

    At a corner the normal is the direction of the way to the compensated place.
    """

    names: tuple[str, ...]
    nominal: Array
    normals: Array
    errors: Array
    uncertainties: Array

    @property
    def compensated(self) -> Array:
        """Where the points are to be cut."""
        return self.nominal - self.errors[:, None] * self.normals

    def csv(self) -> str:
        """The points as CSV, in millimetres and micrometres."""
        text = io.StringIO()
        writer = CsvWriter(text)
        pairs = [
            f"{word}_{axis}" for word in ("nominal", "compensated") for axis in ("x_mm", "z_mm")
        ]
        heads = ("error_um", "standard_uncertainty_um", "offset_um", "normal_x", "normal_z")
        writer.writerow(["point", *pairs, *heads])
        for k, name in enumerate(self.names):
            lengths = [*self.nominal[k], *self.compensated[k]]
            values = [self.errors[k], self.uncertainties[k], -self.errors[k]]
            lengths_written = [fixed(1e3 * value, 6) for value in lengths]
            lengths_written += [
                "" if np.isnan(value) else fixed(1e6 * value, 4) for value in values
            ]
            writer.writerow(
                [name, *lengths_written, *(fixed(value, 9) for value in self.normals[k])]
            )
        return text.getvalue()


def nominal_points(path: Path) -> tuple[tuple[str, ...], Array]:
    """Names and nominal places (m, 2) of a CSV file with the columns nominal_x and nominal_z, each
    with its unit, and perhaps point.

    :raises ExperimentError: everything that is wrong with the file.
    """
    named = ["point"] if "point" in header_names(path) else []
    rows = read_table(path, named, ["nominal_x", "nominal_z"])
    names = tuple((*row.texts, str(k))[0] for k, row in enumerate(rows, start=1))
    return names, np.array([row.lengths for row in rows])


def compensated_points(curve: ErrorCurve, names: Sequence[str], places: Array) -> CompensatedPoints:
    """Places (m, 2) of the profile compensated by the curve's errors, and its corners behind them.

    :raises SplineError: the curve is none of errors along a profile, a place is not on it, or a
        corner is hardly one.
    """
    profile = curve.profile
    if profile is None or curve.points.y_column.kind != "length":
        text = "errors are compensated along a profile; give the columns nominal_x and nominal_z"
        raise SplineError([SplineProblem(text)])
    problems, lengths, points_kept = [], [], []
    for place in places:
        try:
            length, normal = profile.located(place)
        except NotOnProfileError:
            text = "the point ({0}, {1}) is not on the profile of a feature; correct it"
            problems.append(SplineProblem(text, tuple(place.tolist())))
            continue
        lengths.append(length)
        points_kept.append(normal)
    if problems:
        raise SplineError(problems)
    s = np.array(lengths)
    points_found = CompensatedPoints(
        tuple(names),
        places,
        np.array(points_kept).reshape(-1, 2),
        curve.fit.values(s),
        curve.standard_uncertainty(s),
    )
    corners = [_corner(curve, corner, k) for k, corner in enumerate(curve.corners, start=1)]
    return _together([points_found, *corners])


def _corner(curve: ErrorCurve, corner: float, number: int) -> CompensatedPoints:
    """Where the compensated lines of the two features at a corner cross, each with the slope that
    its errors have there.
    """
    assert curve.profile is not None
    corner_place, index = (
        np.array([corner]),
        int(np.argmin(np.abs(curve.profile.lengths - corner))),
    )
    place = curve.profile.places[index]
    try:
        normals, tangents = curve.profile.beside(place)
    except NotOnProfileError:
        text = "the corner at {0} adjoins a feature of one point; give that feature another point"
        raise SplineError([SplineProblem(text, (corner,))]) from None
    if abs(np.linalg.det(normals)) < CORNER:
        text = "the features at {0} are nearly tangent; make it a boundary"
        raise SplineError([SplineProblem(text, (corner,))])
    errors, slopes = (
        np.array([curve.fit.values(corner_place, k, side)[0] for side in SIDES]) for k in (0, 1)
    )
    ways = tangents - slopes[:, None] * normals
    starts = -errors[:, None] * normals
    beyond = np.linalg.solve(np.stack([ways[0], -ways[1]], axis=1), starts[1] - starts[0])[0]
    moved = starts[0] + beyond * ways[0]
    size = float(np.linalg.norm(moved))
    direction = -moved / size if size else normals.sum(axis=0) / np.linalg.norm(normals.sum(axis=0))
    # Slopes as small as those of errors change nothing here.
    shares = np.linalg.solve(normals, np.eye(2)).T @ direction
    root = sum(
        share * curve.fit.space.rows(corner_place, 0, side) @ curve.fit.root
        for share, side in zip(shares, SIDES, strict=True)
    )
    return CompensatedPoints(
        (f"corner {number}",),
        place[None],
        direction[None],
        np.array([size]),
        np.array([curve.sigma * float(np.linalg.norm(root))]),
    )


def _together(parts: Sequence[CompensatedPoints]) -> CompensatedPoints:
    arrays = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("nominal", "normals", "errors", "uncertainties")
    )
    return CompensatedPoints(tuple(name for part in parts for name in part.names), *arrays)
