"""Groups of lengths throughout the volume: by location, length and direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design import Design
from ballplate.simulator.inputs import LengthFunction, format_length
from ballplate.simulator.machines import Array, Integers


@dataclass(frozen=True)
class LengthMapSettings:
    """Settings of a length map: `grid` points along each axis, the probe and the comparison.

    `with_repeatability` adds the repeatability of both readings along the length. The `target`
    applies to `target_factor` times the standard uncertainty.
    """

    grid: tuple[int, ...]
    probe: str
    target: LengthFunction
    coverage_factor: float = 2.0
    with_repeatability: bool = False
    target_factor: float = 1.0


@dataclass(frozen=True, eq=False)
class LengthGroups:
    """Lengths in g groups; all arrays (g,), uncertainties in metres, NaN without a determined
    length.

    `count` and `undetermined` are numbers of lengths; `average` and `maximum` are standard
    uncertainties, `average_ratio` and `maximum_ratio` their ratios to the target; `within` and
    `within_expanded` count lengths with standard and expanded uncertainties up to the target,
    `within_target` those by the uncertainty of the target.
    """

    count: Integers
    undetermined: Integers
    average: Array
    maximum: Array
    average_ratio: Array
    maximum_ratio: Array
    within: Integers
    within_expanded: Integers
    within_target: Integers

    def share(self, expanded: bool = False) -> Array:
        """Shares of lengths within the target (g,), undetermined ones counted as not; NaN of an
        empty group.
        """
        return self._share(self.within_expanded if expanded else self.within)

    @property
    def missed(self) -> Array:
        """Shares of lengths that miss the target (g,), by the uncertainty that it applies to."""
        return 1.0 - self._share(self.within_target)

    def _share(self, within: Integers) -> Array:
        return np.where(self.count > 0, within / np.maximum(self.count, 1), np.nan)


@dataclass(frozen=True, eq=False, repr=False)
class GroupedLengths:
    """Lengths between all points of a grid, grouped.

    `points` (n, d) are scale readings, metres, the last axis changing fastest. `by_point` has a
    group for each point, of the lengths that start or end there; `by_length` those between
    neighbouring `edges` (c + 1,); `by_direction` those of `directions`; `whole` a single one.
    `worst` are the indices of the length with the largest ratio, and `open_pairs` (up to three, 2)
    of some that are undetermined. `expected` is the rank deficiency that the file expects.
    """

    label: str
    title: str
    design: Design
    deficiency: int
    expected: int | None
    settings: LengthMapSettings
    points: Array
    edges: Array
    directions: tuple[str, ...]
    by_point: LengthGroups
    by_length: LengthGroups
    by_direction: LengthGroups
    whole: LengthGroups
    worst: tuple[int, int] | None
    open_pairs: tuple[tuple[int, int], ...]

    @property
    def is_met(self) -> bool:
        """True if all lengths are within the target, by the uncertainty of the target."""
        return bool(self.whole.within_target[0] == self.whole.count[0])


def target_words(target: LengthFunction) -> str:
    """Return the target as text.

    >>> target_words(LengthFunction(5e-7, 1e-6))
    '0.5 µm + L/1000000'
    """
    return format_length(target.constant) + (f" + L/{1 / target.slope:.9g}" if target.slope else "")
