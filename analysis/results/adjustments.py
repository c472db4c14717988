"""Mechanical adjustments of a machine of straight axes: scales, and the directions of guideways.

Readings that are too short have a positive scale error. A squareness error is the turn that a
guideway has suffered about the positive axis in its name, so that the adjustment turns it back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.inputs.settings import number_of
from ballplate.simulator.machines.error_names import (
    SQUARENESS_ERRORS,
    TRANSLATIONS,
    SquarenessError,
)
from ballplate.simulator.machines.protocol import Array, Unit

ARCSECOND = np.pi / (180.0 * 3600.0)

# Below so many degrees of freedom a standard deviation is uncertain by more than about a quarter
# (GUM, E.4.3).
FEW = 10


@dataclass(frozen=True)
class Adjustment:
    """An error with its uncertainty, NaN where it is open, and what to do about it in words.

    The expanded uncertainty is of 95 %: Student's factor times the standard uncertainty (GUM, annex
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


def adjustments(
    values: Array,
    spread: Array,
    null: Array | None = None,
    degrees_of_freedom: float = np.inf,
    squareness: Sequence[SquarenessError] = tuple(SQUARENESS_ERRORS.values()),
) -> tuple[Adjustment, ...]:
    """From scale errors of X, Y and Z and `squareness` errors (6,), or the latter alone (s,).

    `spread` (6, r) is a square root of their covariance, `null` (6, k) what of them is open. Where
    scales are open and their differences are not, those of Y and Z against X are reported as well.
    `degrees_of_freedom` are those of the scatter that `spread` comes from, infinite where
    uncertainties are as stated.
    """
    factor = coverage_factor(degrees_of_freedom)
    null = np.zeros((len(values), 0)) if null is None else null
    rows, found = np.eye(len(values)), []
    size = np.abs(null).max(initial=0.0)

    def told(row: Array) -> tuple[float, float]:
        is_open = null.shape[1] > 0 and float(np.abs(row @ null).max()) > 1e-7 * size
        return (
            (np.nan, np.nan)
            if is_open
            else (float(row @ values), float(np.linalg.norm(row @ spread)))
        )

    if len(values) > len(squareness):
        for row, axis in zip(rows[:3], "XYZ", strict=True):
            value, u = told(row)
            found.append(
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
        alone = [not np.isnan(one.value) for one in found]
        for k, axis in ((1, "Y"), (2, "Z")):
            value, u = told(rows[k] - rows[0])
            if not np.isnan(value) and not (alone[0] and alone[k]):
                name = f"scale {axis.lower()} - scale x"
                words = _scale(axis, value, " against X")
                found.append(
                    Adjustment(name, f"scale of {axis} against X", value, u, factor * u, "1", words)
                )
    for row, error in zip(rows[-len(squareness) :], squareness, strict=True):
        value, u = told(row)
        guideway, other = TRANSLATIONS[error.axis], TRANSLATIONS[error.to]
        words = _turn(guideway, other, error.sign * value)
        name, what = f"angle {other}{guideway}".lower(), f"angle of {other} and {guideway}"
        # An axis that leans towards the other makes the angle smaller.
        found.append(Adjustment(name, what, -error.sign * value, u, factor * u, "rad", words))
    return tuple(found)


def coverage_factor(degrees_of_freedom: float) -> float:
    """Student's factor for an expanded uncertainty of 95 % (GUM, table G.2), NaN without degrees of
    freedom.

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
    """The number of degrees of freedom in words."""
    return f"{number_of(degrees_of_freedom, 'degree')} of freedom"


def few_degrees_of_freedom(degrees_of_freedom: int, what: str, instead: str) -> str:
    """A warning where `what` has been estimated from few degrees of freedom, and `instead`;
    otherwise empty.
    """
    if not 0 < degrees_of_freedom < FEW:
        return ""
    doubt = 100.0 / np.sqrt(2.0 * degrees_of_freedom)
    return (
        f"{what} from {freedom_words(degrees_of_freedom)} is itself uncertain by {doubt:.0f} %;"
        f" {instead}"
    )


def _scale(axis: str, value: float, against: str = "") -> str:
    if np.isnan(value):
        return "cannot be determined"
    return (
        f"let {axis} read {_amount(1e6 * abs(value))} µm per m"
        f" {'more' if value > 0 else 'less'}{against}"
    )


def _turn(guideway: str, other: str, lean: float) -> str:
    if np.isnan(lean):
        return "cannot be determined"
    angle = f"{_amount(abs(lean) / ARCSECOND)} arcsec ({_amount(1e6 * abs(lean))} µm per m)"
    return f"turn the {guideway} guideway by {angle} towards {'-' if lean > 0 else '+'}{other}"


def _amount(value: float) -> str:
    """Three significant digits without an exponent, thousands apart.

    >>> _amount(50020.0), _amount(12.34), _amount(2.0), _amount(0.000012)
    ('50 000', '12.3', '2', '0.000012')
    """
    rounded = float(f"{value:.3g}")
    return (
        f"{rounded:,.0f}".replace(",", " ")
        if rounded >= 1e3
        else np.format_float_positional(rounded, trim="-")
    )
