"""Dimensions of a part from its readings, corrected by a map."""

from __future__ import annotations

from dataclasses import replace
from math import isnan
from pathlib import Path

import numpy as np
from ballplate.simulator.computing import svd
from ballplate.simulator.inputs import Array, ExperimentError, GivenText, hint, read_table, refused

from ..machine_files import FittedMap
from ..maps.corrected_points import corrected
from .evaluated import evaluated
from .part_result import PartUncertainty
from .part_values import LaidPart

# Distance (m) from its nominal place at which a point is another one, or in another unit.
FAR = 2e-3
NAMES = ("place", "feature", "point")


def read_part_points(source: Path | GivenText, laid: LaidPart) -> Array:
    """Return the co-ordinates (n, 3) of all touched points of a part, in metres, of a table with
    the columns place, feature, point (from 1), and x_mm, y_mm and z_mm, or in another unit.

    :raises ExperimentError: a row names no point of the part, or one twice, or points are missing.
    """
    rows = {
        (place, feature, str(k + 1)): some.start + k
        for (place, feature), some in laid.points.rows.items()
        for k in range(some.stop - some.start)
    }
    found, messages = np.full((len(rows), 3), np.nan), []
    for row in read_table(source, (*NAMES, "probe"), ("x", "y", "z"), defaults={"probe": "any"}):
        key = (row.texts[0], row.texts[1], row.texts[2])
        if key not in rows:
            known = hint(" ".join(key), [" ".join(name) for name in rows])
            messages.append(row.mark.message("", f'no point "{" ".join(key)}"; {known}'))
        elif not np.isnan(found[rows[key], 0]):
            messages.append(row.mark.message("", f"a second row of {' '.join(key)}; remove one"))
        else:
            found[rows[key]] = row.lengths
    absent = [" ".join(key) for key, k in rows.items() if np.isnan(found[k, 0])]
    if absent and not messages:
        text = f"{len(absent)} points of the part are missing, such as {absent[0]}; add their rows"
        raise refused(str(source), text)
    if messages:
        raise ExperimentError(messages)
    return found


def with_readings(found: PartUncertainty, fitted: FittedMap, x: Array) -> PartUncertainty:
    """Return the uncertainties of a part together with its dimensions by scale readings `x` (n, 3)
    of the tips' centres, corrected by a map and to 20 degC.

    :raises ValueError: points are far from where the part has them.
    """
    laid = found.laid
    tips, _ = corrected(fitted, x, laid.points.probes)
    state = laid.part.expansion
    ratio = 1.0 + state.coefficient * (state.temperature - 20.0)
    # The part has expanded, and the tips have not.
    at_20 = replace(laid, points=replace(laid.points, radii=laid.points.radii / ratio))
    centres = _aligned(at_20, tips / ratio)
    _ensure_near(at_20, centres)
    deviations = evaluated(at_20, centres[None])[:, 0].tolist()
    dimensions = tuple(
        replace(one, measured=None if isnan(deviations[one.row]) else deviations[one.row])
        for one in found.dimensions
    )
    return replace(found, dimensions=dimensions)


def _aligned(laid: LaidPart, tips: Array) -> Array:
    """Return centres of tips (n, 3) in the frame of the part, each place turned and moved to be
    nearest to the nominal centres: set-ups are not exact, and dimensions do not depend on them.
    """
    found = np.empty_like(tips)
    for place in laid.part.places:
        rows = laid.points.in_place(place.name)
        there, here = laid.points.centres[rows], tips[rows]
        left, _, right = svd((here - here.mean(axis=0)).T @ (there - there.mean(axis=0)))
        turn = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
        found[rows] = (here - here.mean(axis=0)) @ turn + there.mean(axis=0)
    return found


def _ensure_near(laid: LaidPart, tips: Array) -> None:
    away = np.linalg.norm(tips - laid.points.centres, axis=1)
    worst = int(away.argmax())
    if away[worst] > FAR:
        place, feature = next(key for key, rows in laid.points.rows.items() if rows.stop > worst)
        raise ValueError(
            f"{int((away > FAR).sum())} points are more than {1e3 * FAR:g} mm away from where the"
            f" part file has them, {feature} ({place}) by {1e3 * away[worst]:.3g} mm; check names,"
            " columns and units"
        )
