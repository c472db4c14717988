"""Results of acceptance tests, predicted or evaluated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from ballplate.presentation import Data, MainTable, Result, percent, picked, table_lines
from ballplate.simulator.inputs import service
from ballplate.simulator.machines import Array

from .acceptance_rules import Agreed, Sets, judged

CLAIM = "figures of a test, no statement of conformity"


@dataclass(frozen=True, eq=False, repr=False)
class Acceptance(Result):
    """An acceptance test: what is `agreed`, its `sets`, the chance to pass by each rule, 0 or 1 of
    readings, and lines `told`, the first for each rule.

    The errors of each set are from `low` to `high` (m,), and the range of three is `r0` (m,), in
    metres: those of readings, or predicted ones of which 95 % are so, or not greater.
    """

    label: str
    agreed: Agreed
    sets: Sets
    low: Array
    high: Array
    r0: Array
    chances: Mapping[str, float]
    told: Sequence[str]
    title: ClassVar = "acceptance test"

    def page_text(self) -> str:
        """Return its page as a file that needs no other."""
        text: str = service("acceptance_page")(self)
        return text

    def headline(self) -> str:
        return self.told[0]

    def lines(self) -> list[str]:
        return [self.heading, *self.told, CLAIM, "", *table_lines(*self.columns())]

    def columns(self) -> MainTable:
        """Columns with one row per set."""
        lengths = self.sets.lengths
        return {
            "error": self.sets.kinds,
            "direction": self.sets.directions,
            "length, mm": (lengths, 6),
            "MPE, µm": (self.agreed.mpe.at(lengths), 3),
            "u of test, µm": (self.agreed.gauge.at(lengths), 3),
            "lowest, µm": (self.low, 3),
            "highest, µm": (self.high, 3),
            "R0, µm": (self.r0, 3),
        }, ()

    def data(self) -> Data:
        figures = picked(self, "agreed", "chances", "told")
        return {**self.named, "unit": "m", **figures, "sets": self.rows()}


def acceptance_of(
    label: str,
    agreed: Agreed,
    sets: Sets,
    errors: Array,
    words: Callable[..., str],
    told: Sequence[str],
) -> Acceptance:
    """Return the test of errors (n, m, 2, 3), see `judged`, of readings or of n drawn tests;
    `words` say what a rule has judged, and `told` are further lines.
    """
    chances, lines = dict[str, float](), list[str]()
    for rule, limits in agreed.limits(sets.lengths).items():
        found = judged(errors, limits, sets.kinds, agreed.mpl)
        chances[rule] = float(found[0].mean())
        lines.append(f"{rule}: {words(*found)}")
    lines += told
    first = errors[:, :, 0]
    ratios, ranges = np.abs(first).max(axis=2) / agreed.mpe.at(sets.lengths), np.ptp(first, axis=2)
    for kind in np.unique(sets.kinds):
        at = sets.kinds == kind
        for name, values in (("|E|/MPE", ratios), ("range in µm", 1e6 * ranges)):
            ends = np.unique(np.quantile(values[:, at].max(axis=1), (0.5, 0.95)))
            shown = ", 95 % quantile ".join(f"{end:.3f}" for end in ends)
            lines.append(f"largest {name} of {kind}: {shown}")
    if np.isfinite(agreed.mpl):
        most = ranges[:, sets.kinds == "E0"].max(axis=1, initial=0.0)
        share = percent((most <= agreed.mpl).mean())
        lines.append(f"R0 within the MPL of {1e6 * agreed.mpl:g} µm: {share}")
    # Of three values the outer ones are the least and the greatest.
    low, high = np.quantile(first, (0.025, 0.975), axis=(0, 2), method="nearest")
    r0 = np.quantile(ranges, 0.95, axis=0)
    return Acceptance(label, agreed, sets, low, high, r0, chances, lines)
