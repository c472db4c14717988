"""Mechanical adjustments of a machine of straight axes: scales, and the directions of guideways.

Readings that are too short have a positive scale error. A squareness error is the rotation of a
guideway about the positive axis in its name; the adjustment reverses it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.presentation.formatting import Data, by_name
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.settings import number_of
from ballplate.simulator.machines.arrangement import (
    SQUARENESS_ERRORS,
    TRANSLATIONS,
    SquarenessError,
)
from ballplate.simulator.machines.protocol import Unit

ARCSECOND = np.pi / (180.0 * 3600.0)

# With fewer degrees of freedom a standard deviation is uncertain by more than about a quarter (GUM,
# E.4.3).
FEW = 10


@dataclass(frozen=True)
class Adjustment:
    """An error with its uncertainty, NaN if undetermined, and the adjustment as text.

    The expanded uncertainty (95 %) is Student's factor times the standard uncertainty (GUM, annex
    G). `what` is the scale of an axis, or two axes whose angle differs from 90 degrees by `value`;
    `unit` is 1 or rad.
    """

    name: str
    what: str
    value: float
    standard_uncertainty: float
    expanded_uncertainty: float
    unit: Unit
    words: str


def adjusted(
    values: Array,
    spread: Array,
    null: Array | None = None,
    degrees_of_freedom: float = np.inf,
    squareness: Sequence[SquarenessError] = tuple(SQUARENESS_ERRORS.values()),
) -> tuple[Adjustment, ...]:
    """Return adjustments from scale errors of X, Y and Z and `squareness` errors (6,), or from the
    latter only (s,).

    `spread` (6, r) is a square root of their covariance, `null` (6, k) spans undetermined
    directions. If scales are undetermined but their differences are not, those of Y and Z against X
    are added. `degrees_of_freedom` are those of `spread`, infinite if uncertainties are as stated.
    """
    factor = coverage_factor(degrees_of_freedom)
    null = np.zeros((len(values), 0)) if null is None else null
    rows, results = np.eye(len(values)), []
    size = np.abs(null).max(initial=0.0)

    def estimate_of(row: Array) -> tuple[float, float]:
        is_open = null.shape[1] > 0 and float(np.abs(row @ null).max()) > 1e-7 * size
        return (
            (np.nan, np.nan)
            if is_open
            else (float(row @ values), float(np.linalg.norm(row @ spread)))
        )

    if len(values) > len(squareness):
        for row, axis in zip(rows[:3], "XYZ", strict=True):
            value, u = estimate_of(row)
            results.append(
                Adjustment(
                    f"scale {axis.lower()}",
                    f"scale of {axis}",
                    value,
                    u,
                    factor * u,
                    "1",
                    _scale(axis, value),
                )
            )
        is_known = [not np.isnan(scale.value) for scale in results]
        for k, axis in ((1, "Y"), (2, "Z")):
            value, u = estimate_of(rows[k] - rows[0])
            if not np.isnan(value) and not (is_known[0] and is_known[k]):
                name = f"scale {axis.lower()} - scale x"
                words = _scale(axis, value, " against X")
                results.append(
                    Adjustment(name, f"scale of {axis} against X", value, u, factor * u, "1", words)
                )
    for row, error in zip(rows[-len(squareness) :], squareness, strict=True):
        value, u = estimate_of(row)
        guideway, towards = TRANSLATIONS[error.axis], TRANSLATIONS[error.to]
        words = _turn(guideway, towards, error.sign * value)
        name, subject = f"angle {towards}{guideway}".lower(), f"angle of {towards} and {guideway}"
        # An axis that leans towards the other makes the angle smaller.
        results.append(Adjustment(name, subject, -error.sign * value, u, factor * u, "rad", words))
    return tuple(results)


def coverage_factor(degrees_of_freedom: float) -> float:
    """Return Student's factor for an expanded uncertainty of 95 % (GUM, table G.2); NaN without
    degrees of freedom.

    >>> [round(coverage_factor(freedom), 2) for freedom in (1, 2, 10, float("inf"))]
    [12.71, 4.3, 2.23, 1.96]
    """
    from scipy.special import ndtri, stdtrit

    if not degrees_of_freedom > 0:
        return float("nan")
    return float(
        ndtri(0.975) if np.isinf(degrees_of_freedom) else stdtrit(degrees_of_freedom, 0.975)
    )


def freedom_words(degrees_of_freedom: int) -> str:
    """Return the number of degrees of freedom as text."""
    return f"{number_of(degrees_of_freedom, 'degree')} of freedom"


def few_degrees_of_freedom(degrees_of_freedom: int, subject: str, remedy: str) -> str:
    """Return a warning if `subject` was estimated from few degrees of freedom, with a `remedy`;
    otherwise an empty text.
    """
    if not 0 < degrees_of_freedom < FEW:
        return ""
    doubt = 100.0 / np.sqrt(2.0 * degrees_of_freedom)
    return (
        f"{subject} from {freedom_words(degrees_of_freedom)} is itself uncertain by {doubt:.0f} %;"
        f" {remedy}"
    )


def _scale(axis: str, value: float, against: str = "") -> str:
    if np.isnan(value):
        return "cannot be determined"
    return (
        f"let {axis} read {_amount(1e6 * abs(value))} µm per m"
        f" {'more' if value > 0 else 'less'}{against}"
    )


def _turn(guideway: str, towards: str, lean: float) -> str:
    if np.isnan(lean):
        return "cannot be determined"
    angle = f"{_amount(abs(lean) / ARCSECOND)} arcsec ({_amount(1e6 * abs(lean))} µm per m)"
    return f"turn the {guideway} guideway by {angle} towards {'-' if lean > 0 else '+'}{towards}"


def _amount(value: float) -> str:
    """Return three significant digits without an exponent, with spaces for thousands.

    >>> _amount(50020.0), _amount(12.34), _amount(2.0), _amount(0.000012)
    ('50 000', '12.3', '2', '0.000012')
    """
    rounded = float(f"{value:.3g}")
    return (
        f"{rounded:,.0f}".replace(",", " ")
        if rounded >= 1e3
        else np.format_float_positional(rounded, trim="-")
    )


def _turned(name: str) -> Callable[[Adjustment], float]:
    def in_practice(row: Adjustment) -> float:

        # Mechanics read arcseconds and µm/m.
        return float(getattr(row, name) / (ARCSECOND if row.unit == "rad" else 1e-6))

    return in_practice


ADJUSTMENT_COLUMNS: dict[str, Any] = {
    "adjustment": "what",
    "is off by": _turned("value"),
    "standard uncertainty": _turned("standard_uncertainty"),
    "expanded, 95 %": _turned("expanded_uncertainty"),
    "unit": lambda row: "arcsec" if row.unit == "rad" else "µm/m",
    "what to do": "words",
}


def adjustment_lines(adjustments: Sequence[Adjustment]) -> list[str]:
    """Return adjustments as a table of text."""
    from ballplate.presentation.table_columns import table_lines

    return [
        *table_lines(ADJUSTMENT_COLUMNS, adjustments),
        "(errors of scales: true length less reading; errors of angles: excess over 90 deg)",
    ]


def adjustment_data(adjustments: Sequence[Adjustment]) -> Data:
    """Return adjustments as plain data."""
    names = "what", "value", "standard_uncertainty", "expanded_uncertainty", "unit", "words"
    return by_name(adjustments, *names)
