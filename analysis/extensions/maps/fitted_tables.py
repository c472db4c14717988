"""Errors of a fitted machine as text for people, as CSV and as plain data for programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from ballplate.presentation import aligned, number, picked, to_uncertainty
from ballplate.simulator.computing import comparable
from ballplate.simulator.machines import Array
from ballplate.simulator.maps import FittedMap, verdict_data, verdict_line

from .fitted_errors import FittedErrors, FittedLengths
from .realisations import Realisations
from .volumetric_tables import CONVENTION, tables_csv, with_drawn

UNDETERMINED = "undetermined"

# Errors and uncertainties below this, in metres and radians, are rounding.
ROUNDING = 1e-15


def head_lines(label: str, fitted: FittedMap, probe: int | None = None) -> list[str]:
    """What the map is, and what its figures state."""
    lines = [f"{label}: {fitted.title}", CONVENTION]
    if probe is not None:
        name, offset = fitted.probes.names[probe], 1e3 * fitted.probes.offsets[probe]
        lines.append(f"probe {name}, offset ({', '.join(f'{v + 0.0:.6g}' for v in offset)}) mm")
    if fitted.frame:
        lines.append(f"frame: {fitted.frame}")
    lines.append(verdict_line(fitted.lack_of_fit))
    return [*lines, f"U: expanded uncertainty, k = {fitted.coverage_factor:g}"]


def map_data(label: str, fitted: FittedMap, probe: int | None = None) -> dict[str, Any]:
    """The same as plain data."""
    found: dict[str, Any] = {
        "map": label,
        "title": fitted.title,
        "convention": CONVENTION,
        "frame": fitted.frame or None,
        **picked(fitted, "coverage_factor", "sigma", "sigma_is_estimated", "degrees_of_freedom"),
        "lack_of_fit": verdict_data(fitted.lack_of_fit),
    }
    if probe is not None:
        found["probe"] = {
            "name": fitted.probes.names[probe],
            "offset": fitted.probes.offsets[probe],
        }
    return found


def with_uncertainty(value: float, uncertainty: float, factor: float) -> list[str]:
    """A value and its expanded uncertainty in millionths of their unit, as two cells."""
    if np.isnan(value) or np.isnan(uncertainty):
        return [UNDETERMINED, "-"]
    value, uncertainty = (0.0 if abs(one) < ROUNDING else one for one in (value, uncertainty))
    shown = to_uncertainty(1e6 * value, 1e6 * uncertainty)
    return [shown, number(1e6 * factor * uncertainty, 3)]


def length_lines(lengths: FittedLengths, names: Sequence[str], factor: float) -> list[str]:
    """Errors of lengths, with their uncertainties."""
    rows = [["length error of", "from", "to", "length, mm", "error, µm", "U, µm"]]
    for k, name in enumerate(names):
        ends = [_point(lengths.starts[k]), _point(lengths.ends[k])]
        cells = with_uncertainty(float(lengths.errors[k]), float(lengths.uncertainties[k]), factor)
        rows.append([name, *ends, f"{1e3 * lengths.nominal[k]:.3f}", *cells])
    return aligned(rows, [False, False, False, True, True, True])


def error_lines(found: FittedErrors, factor: float, names: Sequence[str] = ()) -> list[str]:
    """Errors point by point with their uncertainties, and the largest; points may have names."""
    letters = "xyz"[: found.points.shape[1]]
    heads = [f"{letter}, mm" for letter in letters]
    heads += [cell for letter in letters.upper() for cell in (f"{letter}, µm", "U")]
    rows = [[*(["point"] if names else []), *heads, "resultant"]]
    for i, (point, error, u, resultant) in enumerate(
        zip(found.points, found.errors, found.uncertainties, found.resultant, strict=True)
    ):
        cells = [*([names[i]] if names else []), *(_millimetres(value) for value in point)]
        for value, own in zip(error.tolist(), u.tolist(), strict=True):
            cells += with_uncertainty(value, own, factor)
        is_open = bool(np.isnan(resultant))
        rows.append([*cells, UNDETERMINED if is_open else number(1e6 * float(resultant))])
    right = [not (names and k == 0) for k in range(len(rows[0]))]
    return [*aligned(rows, right), *_largest(found, factor)]


def _largest(found: FittedErrors, factor: float) -> list[str]:
    known = np.flatnonzero(~np.isnan(found.resultant))
    if not len(known):
        return ["all errors are undetermined"]
    worst = int(known[comparable(found.resultant[known]).argmax()])
    least = float(np.nanmax(found.uncertainties))
    told = (
        f"largest resultant {number(1e6 * float(found.resultant[worst]))} µm at"
        f" {_point(found.points[worst])} mm; largest U of a co-ordinate"
        f" {number(1e6 * factor * least, 3)} µm"
    )
    left = len(found.points) - len(known)
    return [f"{told}; {left} of {len(found.points)} points undetermined" if left else told]


def realisation_lines(found: Realisations, names: Sequence[str]) -> list[str]:
    """What each realisation has at most, and its length errors; all points are in CSV and JSON."""
    rows = [["realisation", "largest resultant, µm", *(f"{name}, µm" for name in names)]]
    largest = np.linalg.norm(found.errors, axis=2).max(axis=1)
    for k, (resultant, lengths) in enumerate(zip(largest, found.lengths, strict=True)):
        values = [float(resultant), *lengths.tolist()]
        shown = [UNDETERMINED if np.isnan(v) else number(1e6 * v) for v in values]
        rows.append([str(k + 1), *shown])
    table = aligned(rows, [True] * len(rows[0]))
    return [*table, f"drawn from seed {found.draws.seed}; --format csv and --json have all points"]


def point_csv(
    found: FittedErrors,
    factor: float,
    realisations: Realisations | None,
    names: Sequence[str] = (),
) -> Iterator[str]:
    """Errors as lines of a CSV file; with realisations, a column tells which one, 0 the estimate,
    and only that has uncertainties.
    """
    letters = "xyz"[: found.points.shape[1]]
    heads = [f"{letter}_mm" for letter in letters]
    heads += [f"error_{letter}_um" for letter in letters]
    heads += [f"U_{letter}_um" for letter in letters]
    k = np.full(len(found.points), factor)
    tables = [
        [1e3 * found.points, 1e6 * error, 1e6 * factor * u, 1e6 * np.linalg.norm(error, axis=1), k]
        for error, u in with_drawn(found.errors, found.uncertainties, realisations)
    ]
    return tables_csv([*heads, "resultant_um", "k"], tables, realisations is not None, names)


def _point(point: Array) -> str:
    return f"({', '.join(_millimetres(value) for value in point)})"


def _millimetres(value: float) -> str:
    return f"{1e3 * value + 0.0:.10g}"
