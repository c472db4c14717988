"""Digits and uncertainties in a table of readings, against the uncertainty that is stated."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.design import Design
from ballplate.simulator.inputs import LENGTH_UNITS, format_length
from ballplate.simulator.machines import Array

# Units, in metres, of whose powers of ten tables have the last digits, and the largest exponent.
UNITS = (1.0, float(LENGTH_UNITS["in"]))
FINEST = 10
# A number is a multiple of its last digit to this part of that, and to so many metres: what is more
# is a digit that was written.
MULTIPLE, ROUNDING = 1e-4, 1e-12
# Fewer co-ordinates than these do not tell digits.
FEWEST = 12
# Rounding that is told has a standard uncertainty above this part of that of readings.
NOTABLE = 0.5
# Uncertainties so many times those that are stated, or less, are rather in another unit.
OTHER_UNIT = 100.0


def last_digit(x: Array) -> float:
    """Return the largest power of ten of a unit that divides all co-ordinates, in metres; zero for
    many digits.

    >>> [round(last_digit(np.array([0.1234, 0.5]) * unit), 9) for unit in (1.0, 0.001, 0.0254)]
    [0.0001, 1e-07, 2.54e-06]
    >>> last_digit(np.array([0.25, 0.5 + 2e-7]))
    1e-07
    """
    for exponent in range(FINEST + 1):
        for unit in UNITS:
            step = unit * 10.0**-exponent
            count = x / step
            if np.abs(count - np.round(count)).max(initial=0.0) <= min(MULTIPLE, ROUNDING / step):
                return step
    return 0.0


def doubts_about_digits(design: Design, x: Array, uncertainty: Array | None) -> tuple[str, ...]:
    """Return a sentence about co-ordinates (m, d) in the table, in metres, that are rounded more
    coarsely than the standard `uncertainty` (m, d) of readings, or the repeatability, suggests;
    possibly empty.

    Rounding to steps of q has the standard uncertainty q / sqrt(12) (GUM, 4.3.7).
    """
    values = x[~np.isnan(x)]
    if len(values) < FEWEST:
        return ()
    step = last_digit(values)
    rounding = step / np.sqrt(12.0)
    uncertainty_stated = float(
        np.median(design.machine.repeatability if uncertainty is None else uncertainty)
    )
    if rounding <= NOTABLE * uncertainty_stated:
        return ()
    shown = [
        format_length(float(f"{amount:.3g}")) for amount in (step, rounding, uncertainty_stated)
    ]
    return (
        f"the readings have no digit below {shown[0]}; such rounding has a standard uncertainty of"
        f" {shown[1]}, and {shown[2]} is stated for readings: give more digits, or increase the"
        " stated uncertainty",
    )


def doubts_about_units(design: Design, uncertainty: Array) -> tuple[str, ...]:
    """Return a sentence about standard uncertainties (m,) of readings in a table that differ from
    the repeatability by a factor typical of another unit.
    """
    stated_uncertainty, repeatability = (
        float(np.median(uncertainty)),
        float(np.median(design.machine.repeatability)),
    )
    if repeatability / OTHER_UNIT < stated_uncertainty < repeatability * OTHER_UNIT:
        return ()
    shown = [
        format_length(float(f"{amount:.3g}")) for amount in (stated_uncertainty, repeatability)
    ]
    return (
        f"the table states a standard uncertainty of {shown[0]} for its readings, but the"
        f" repeatability is {shown[1]}: check the unit of its column",
    )
