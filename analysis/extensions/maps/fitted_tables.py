"""Errors of a fitted machine as text for people, as CSV and as plain data for programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from ballplate.presentation import ROUNDING, Data, by_axis, number, picked, table_lines
from ballplate.simulator.computing import comparable
from ballplate.simulator.maps import FittedMap, verdict_data, verdict_line

from .realisations import Realisations
from .volumetric_errors import LengthErrors, VolumetricErrors
from .volumetric_tables import CONVENTION, millimetres, point_text

UNDETERMINED = "undetermined"


def head_lines(label: str, fitted: FittedMap, probe: int | None = None) -> list[str]:
    """Return the title of a map and the conventions of its values."""
    lines = [f"{label}: {fitted.title}", CONVENTION]
    if probe is not None:
        name, offset = fitted.probes.names[probe], 1e3 * fitted.probes.offsets[probe]
        lines.append(f"probe {name}, offset ({', '.join(f'{v + 0.0:.6g}' for v in offset)}) mm")
    if fitted.frame:
        lines.append(f"frame: {fitted.frame}")
    lines.append(verdict_line(fitted.lack_of_fit))
    return [*lines, f"U: expanded uncertainty, k = {fitted.coverage_factor:g}"]


def map_data(label: str, fitted: FittedMap, probe: int | None = None) -> Data:
    """The same as plain data."""
    data: Data = {
        "map": label,
        "title": fitted.title,
        "convention": CONVENTION,
        "frame": fitted.frame or None,
        **picked(fitted, "coverage_factor", "sigma", "sigma_is_estimated", "degrees_of_freedom"),
        "lack_of_fit": verdict_data(fitted.lack_of_fit),
    }
    if probe is not None:
        data["probe"] = {
            "name": fitted.probes.names[probe],
            "offset": fitted.probes.offsets[probe],
        }
    return data


def length_lines(lengths: LengthErrors, names: Sequence[str], factor: float) -> list[str]:
    """Errors of lengths, with their uncertainties."""
    columns = {
        "length error of": list(names),
        "from": list(map(point_text, lengths.starts)),
        "to": list(map(point_text, lengths.ends)),
        "length, mm": (lengths.nominal, lambda value: f"{1e3 * value:.3f}"),
        "error, µm": (lengths.errors, lengths.uncertainties),
        "U, µm": (factor * lengths.uncertainties, expanded),
    }
    return table_lines(columns, unknown=UNDETERMINED)


def expanded(uncertainty: float) -> str:
    """An expanded uncertainty in millionths of its unit."""
    return number(0.0 if uncertainty < ROUNDING else 1e6 * uncertainty, 3)


def error_lines(errors: VolumetricErrors, factor: float, names: Sequence[str] = ()) -> list[str]:
    """Errors point by point with their uncertainties, and the largest; points may have names."""
    u, columns = errors.uncertainties, list[tuple[str, Any]]()
    columns += [("point", list(names))] if names else []
    columns += by_axis("{}, mm", errors.points, millimetres).items()
    for k, letter in enumerate("XYZ"[: errors.points.shape[1]]):
        columns += [(f"{letter}, µm", (errors.errors[:, k], u[:, k]))]
        columns += [("U", (factor * u[:, k], expanded))]
    columns.append(("resultant", (errors.resultant, _resultant)))
    return [*table_lines(columns, unknown=UNDETERMINED), *_largest(errors, factor)]


def _resultant(value: float) -> str:
    return UNDETERMINED if np.isnan(value) else number(1e6 * value)


def _largest(errors: VolumetricErrors, factor: float) -> list[str]:
    determined = np.flatnonzero(~np.isnan(errors.resultant))
    if not len(determined):
        return ["all errors are undetermined"]
    worst = int(determined[comparable(errors.resultant[determined]).argmax()])
    least = float(np.nanmax(errors.uncertainties))
    text = (
        f"largest resultant {number(1e6 * errors.resultant[worst])} µm at"
        f" {point_text(errors.points[worst])} mm; largest U of a co-ordinate"
        f" {number(1e6 * factor * least, 3)} µm"
    )
    undetermined = len(errors.points) - len(determined)
    return [
        f"{text}; {undetermined} of {len(errors.points)} points undetermined"
        if undetermined
        else text
    ]


def error_columns(errors: VolumetricErrors, factor: float) -> Data:
    """Columns of errors point by point, with their expanded uncertainties."""
    return {
        **by_axis("{}, mm", errors.points),
        **by_axis("error {}, µm", errors.errors),
        **by_axis("U {}, µm", factor * errors.uncertainties),
        "resultant, µm": errors.resultant,
        "k": [factor] * len(errors.points),
    }


def realisation_lines(realisations: Realisations, names: Sequence[str]) -> list[str]:
    """Return the largest error and the length errors of each realisation; CSV and JSON have all
    points.
    """
    largest = np.linalg.norm(realisations.errors, axis=2).max(axis=1)
    columns = [
        ("realisation", range(1, len(largest) + 1)),
        ("largest resultant, µm", largest),
        *(
            (f"{name}, µm", drawn_lengths)
            for name, drawn_lengths in zip(names, realisations.lengths.T, strict=True)
        ),
    ]
    table = table_lines(columns, unknown=UNDETERMINED)
    return [
        *table,
        f"drawn from seed {realisations.draws.seed}; --format csv and --json have all points",
    ]
