"""The acceptance and reverification test of ISO 10360-2: its lengths, and its decision rules.

A set is a length that is measured three times. If one of its errors is outside, it is measured
three times again, and all three must then be within; at most five of 35 sets (E0) and two of ten
(E150) may be measured again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design import Flags, Volume
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import LengthFunction
from ballplate.simulator.machines import Array

# Diagonals and axes by the number of axes, from their start on; and diagonals of E150 in the plane
# across x and across y.
LINES = {
    2: ("+x+y", "-x+y", "+x", "+y"),
    3: ("+x+y+z", "-x+y+z", "+x-y+z", "+x+y-z", "+x", "+y", "+z"),
}
PLANE_LINES = (("+y+z", "-y+z"), ("+x+z", "-x+z"), ())
# Lengths of a line as parts of it; each is measured three times.
SHARES = (0.132, 0.264, 0.396, 0.528, 0.66)
REPEATS = 3
# Rules with their guard bands in standard uncertainties of the test: 95 % of a normal distribution
# lie below 1.65, as ISO 14253-1 has it where only one of two limits is near.
RULES = {"simple acceptance": 0.0, "guard band of 1.65 u": 1.65}
# Sets that may be measured again.
MOST_AGAIN = {"E0": 5, "E150": 2}
AGAIN = (
    "a set with one error outside is measured three times again, and all three must be within: at"
    " most 5 of the 35 sets of E0, and 2 of the 10 of E150"
)
# Metres: rounding of numbers in files.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Sets:
    """Lengths that are measured three times each: `kinds` (m,), E0 or E150, of their errors,
    `directions` (m,), and `lengths` (m,) in metres.
    """

    kinds: Array
    directions: Array
    lengths: Array


def length_plan(volume: Volume, across: int = -1) -> tuple[Sets, Array]:
    """Return five lengths each along all diagonals of a volume and along its axes, and of E150
    along two diagonals of the plane across the axis `across`, x or y, if it is not -1; with the
    scale readings (2, m, d) at their starts and ends, in metres.

    Lines along axes, and planes, are in the middle. All lengths of a line begin at one end of it.
    """
    axes = AXIS_NAMES[: len(volume.size)]
    names = np.repeat((*LINES[len(axes)], *PLANE_LINES[across]), len(SHARES))
    signs = [[(f"+{axis}" in name) - (f"-{axis}" in name) for axis in axes] for name in names]
    along = signs * volume.size
    starts = (volume.lower + volume.upper - along) / 2
    along *= np.resize(SHARES, (len(names), 1))
    kinds = np.where(np.isin(names, PLANE_LINES[across]), "E150", "E0")
    sets = Sets(kinds, names, np.linalg.norm(along, axis=1))
    return sets, np.array([starts, starts + along])


@dataclass(frozen=True)
class Agreed:
    """Limits of errors, `mpe`, and of the range R0, `mpl`, in metres; standard uncertainties of the
    test: that of calibrated lengths, `gauge`, common to all; and the
    standard repeatability of a touched `point` along a length, in metres.
    """

    mpe: LengthFunction
    mpl: float = np.inf
    gauge: LengthFunction = LengthFunction(0.0)
    point: float = 0.0

    def limits(self, lengths: Array) -> dict[str, Array]:
        """Limits (m,) of errors of lengths (m,) by each rule, in metres."""
        u, mpe = self.gauge.at(lengths), self.mpe.at(lengths)
        # Without a stated uncertainty there is no guard band.
        rules = {rule: guard for rule, guard in RULES.items() if not guard or u.any()}
        return {rule: mpe - guard * u for rule, guard in rules.items()}


def judged(
    errors: Array, limits: Array, kinds: Array, mpl: float = np.inf
) -> tuple[Flags, Flags, Flags]:
    """Judge errors (n, m, 2, 3) of n tests, the first three and the repeated three of each set of
    `kinds` (m,), NaN where there are none, by limits (m,), and first ranges of E0 by `mpl`; metres.

    Return tests (n,) that pass, sets (n, m) that are measured again, and those not within in the
    end.

    >>> inside, outside = [[[0.0, 0.0, 0.0]] * 2], [[[2.0, 0.0, 0.0], [0.5, 0.5, 0.5]]]
    >>> tests = np.array([2 * inside + 5 * outside, inside + 6 * outside])
    >>> judged(tests, np.ones(7), np.array(7 * ["E0"]))[0]
    array([ True, False])
    """
    inside = np.abs(errors) <= limits[:, None, None] + ROUNDING
    first, second = np.moveaxis(inside.sum(axis=3), 2, 0)
    again = first == REPEATS - 1
    fails = (first < REPEATS) & ~(again & (second == REPEATS))
    ranges = np.ptp(errors[:, kinds == "E0", 0], axis=2)
    passes = ~fails.any(axis=1) & (ranges <= mpl + ROUNDING).all(axis=1)
    for kind, most in MOST_AGAIN.items():
        passes &= again[:, kinds == kind].sum(axis=1) <= most
    return passes, again, fails
