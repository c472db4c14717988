"""Answer of a sweep: which settings meet the target, which of these takes fewest observations, and
what each axis changes while the others stay.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..presentation.formatting import number, percent
from ..presentation.table import Block, Entry, Row, Table
from .results import Integers, ReportedSweep, criterion, partly_open

# Settings that the answer lists.
LISTED = 8

WITHIN = "U6_within_target"


@dataclass(frozen=True)
class AxisWorth:
    """What an axis changes: the average uncertainty at its last value divided by that at its first,
    of axes with texts the largest divided by the smallest, in each of `settings` of the other axes;
    `low` to `high` over these.
    """

    axis: str
    ends: tuple[str, str] | None
    low: float
    high: float
    settings: int

    def __str__(self) -> str:
        low, high = number(self.low, 3), number(self.high, 3)
        by = low if low == high else f"{low} to {high}"
        of = "" if self.settings == 1 else f", in {self.settings} settings of the other axes"
        if self.ends is None:
            return f"{self.axis}: its values differ by a factor of {by}{of}"
        return f"{self.axis}: from {self.ends[0]} to {self.ends[1]} it is multiplied by {by}{of}"


@dataclass(frozen=True)
class SweepAnswer:
    """Sentences, the settings that they are about, and what each axis is worth."""

    sentences: tuple[str, ...]
    settings: Table | None
    worth: tuple[AxisWorth, ...]


def answer(results: ReportedSweep) -> SweepAnswer | None:
    """The answer of a sweep; None where nothing is done or recorded that cells are judged by."""
    judged = criterion(results)
    done = np.flatnonzero(results.done)
    if judged is None or not len(done):
        return None
    column, symbol = judged
    value, observations = results.figure(column)[done], results.figure("observations")[done]
    partly = partly_open(results, symbol)[done]
    sentences = []
    if WITHIN in results.frame and np.isfinite(results.figure(WITHIN)[done]).any():
        share = results.figure(WITHIN)[done]
        meets = share == 1.0
        sentences += _of_target(results, done, meets, share, observations, value)
        order = np.lexsort((value, observations, ~meets))
        if not meets.any():
            order = np.lexsort((value, -np.nan_to_num(share, nan=-1.0)))
    else:
        order = np.lexsort((np.nan_to_num(value, nan=math.inf), partly))
        best = order[0]
        if np.isfinite(value[best]):
            told = f"{_words(symbol)} on average {number(1e6 * value[best], 3)} µm"
            sentences.append(
                "The sweep states no target uncertainty. The smallest is"
                f" {_setting(results, done[best])}: {told}."
            )
    deficient = results.figure("rank_deficiency")[done] > 0
    if deficient.any():
        sentences.append(f"{deficient.sum()} of {len(done)} settings leave something undetermined.")
    if len(done) < len(results.cells):
        sentences.append(
            f"{len(results.cells) - len(done)} of {len(results.cells)} settings are not computed;"
            " the answer is that of the others."
        )
    return SweepAnswer(
        tuple(sentences),
        _table(results, done[order[:LISTED]], column, symbol),
        tuple(_worths(results, column, done[~partly & np.isfinite(value)])),
    )


def _of_target(
    results: ReportedSweep,
    done: Integers,
    meets: NDArray[np.bool_],
    share: NDArray[np.float64],
    observations: NDArray[np.float64],
    value: NDArray[np.float64],
) -> list[str]:
    if not meets.any():
        best = np.lexsort((value, -np.nan_to_num(share, nan=-1.0)))[0]
        return [
            f"None of the {len(done)} settings meets the target uncertainty with all lengths. The"
            f" nearest is {_setting(results, done[best])}, with {percent(float(share[best]))} of"
            " the lengths."
        ]
    candidates = np.flatnonzero(meets)
    best = candidates[np.lexsort((value[candidates], observations[candidates]))[0]]
    return [
        f"{meets.sum()} of {len(done)} settings meet the target uncertainty with all lengths.",
        f"The one with the fewest observations is {_setting(results, done[best])}:"
        f" {observations[best]:.0f} observations.",
    ]


def _setting(results: ReportedSweep, row: int) -> str:
    return results.label(int(results.frame["cell"].to_numpy()[row]))


def _words(symbol: str) -> str:
    return symbol.replace("_", " ")


def _table(results: ReportedSweep, rows: Integers, column: str, symbol: str) -> Table:
    cells = results.frame["cell"].to_numpy()
    of_largest = column.replace("_average_", "_maximum_")
    columns = [
        ("observations", "observations", 1.0),
        (f"{_words(symbol)} average, µm", column, 1e6),
    ]
    if of_largest in results.frame:
        columns.append((f"{_words(symbol)} maximum, µm", of_largest, 1e6))
    if WITHIN in results.frame:
        columns.append(("lengths within target", WITHIN, 100.0))
    found = []
    for row in rows.tolist():
        entries = []
        for _, name, factor in columns:
            value = results.value(name, row)
            text = percent(value) if name == WITHIN else number(factor * value, 4)
            if name == "observations":
                text = f"{value:.0f}"
            entries.append(Entry(text, value, int(cells[row]), name))
        labels = [axis.labels[k] for axis, k in zip(results.axes, results.chosen[row], strict=True)]
        found.append(Row(tuple(labels), tuple(entries)))
    headings = tuple(axis.name for axis in results.axes)
    told = tuple(name for name, _, _ in columns)
    return Table(
        "answer", "The settings that come first", headings, told, (Block("", tuple(found)),)
    )


def _worths(results: ReportedSweep, column: str, rows: Integers) -> list[AxisWorth]:
    value = results.figure(column)[rows]
    found = []
    for k, axis in enumerate(results.axes):
        others = [i for i in range(len(results.axes)) if i != k]
        _, group = np.unique(results.chosen[rows][:, others], axis=0, return_inverse=True)
        group, place = group.ravel(), results.chosen[rows, k]
        if axis.numbers:
            place = np.argsort(np.argsort(np.array(axis.numbers), kind="stable"))[place]
        order = np.lexsort((place, group))
        starts = np.flatnonzero(np.r_[True, np.diff(group[order]) != 0])
        ends = np.r_[starts[1:], len(order)] - 1
        is_wide = place[order[ends]] - place[order[starts]] == len(axis.labels) - 1
        if axis.numbers:
            ratios = value[order[ends]] / value[order[starts]]
            sorted_labels = [axis.labels[i] for i in np.argsort(axis.numbers, kind="stable")]
            told = (sorted_labels[0], sorted_labels[-1])
        else:
            least = np.minimum.reduceat(value[order], starts)
            ratios, told = np.maximum.reduceat(value[order], starts) / least, None
        # Settings in which only some of the axis's values were computed say less.
        ratios = ratios[is_wide & (starts != ends) & np.isfinite(ratios)]
        if len(ratios):
            found.append(
                AxisWorth(axis.name, told, float(ratios.min()), float(ratios.max()), len(ratios))
            )
    return found
