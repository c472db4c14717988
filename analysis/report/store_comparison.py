"""Comparison of two sweeps: settings that both have, by the average uncertainty that cells are
judged by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.inputs.settings import listing
from ballplate.simulator.machines.protocol import Array

from ..presentation.formatting import number
from ..presentation.table import Block, Entry, Row, Table
from .answer import WITHIN
from .results import Integers, ReportedSweep, criterion, partly_open

# Settings that are listed, those that differ most.
LISTED = 12

# Averages within this part of one another are the same but for rounding.
SAME = 1e-9


class IncomparableError(ValueError):
    """Two sweeps have nothing in common that can be compared; the text says what."""


@dataclass(frozen=True)
class StoreComparison:
    """What two sweeps say of the same settings, as sentences and a table."""

    sentences: tuple[str, ...]
    settings: Table | None


def compared(results: ReportedSweep, other: ReportedSweep, name: str) -> StoreComparison:
    """A sweep compared with another one, called by its `name`; settings are matched by the names
    and values of their axes, in any order.

    :raises IncomparableError: their axes differ, or they record nothing that both can be judged by.
    """
    own, others = ({axis.name for axis in one.axes} for one in (results, other))
    if own != others:
        raise IncomparableError(
            f"{name} is swept over {listing(sorted(others))} and this store over"
            f" {listing(sorted(own))}; compare sweeps of the same axes"
        )
    judged, theirs = criterion(results), criterion(other)
    if judged is None or theirs is None or judged != theirs:
        raise IncomparableError(f"{name} and this store record no quantity that both are judged by")
    column, symbol = judged
    here, there = _by_setting(results), _by_setting(other)
    both = [key for key in here if key in there]
    sentences = [
        f"{len(both)} settings are done in both; {len(here) - len(both)} in this store alone,"
        f" {len(there) - len(both)} in {name} alone."
    ]
    rows = np.array([here[key] for key in both], np.int64)
    rows_there = np.array([there[key] for key in both], np.int64)
    determined = ~partly_open(results, symbol)[rows] & ~partly_open(other, symbol)[rows_there]
    value, before = results.figure(column)[rows], other.figure(column)[rows_there]
    ratio = np.where(determined, value / before, np.nan)
    for words, changed in (("smaller", ratio < 1 - SAME), ("larger", ratio > 1 + SAME)):
        if changed.any():
            ends = ratio[changed].min(), ratio[changed].max()
            by = sorted({number(float(one), 3) for one in ends})
            told = " to ".join(by)
            sentences.append(
                f"The average of {symbol.replace('_', ' ')} is {words} than in {name} in"
                f" {changed.sum()} of them, by a factor of {told}."
            )
    if len(both) and determined.all() and (np.abs(ratio - 1) <= SAME).all():
        sentences.append("All averages are the same.")
    for words, name_of, least in (
        ("rank-deficient", "rank_deficiency", 1.0),
        ("within the target with all lengths", WITHIN, 1.0),
    ):
        now = results.figure(name_of)[rows] >= least
        then = other.figure(name_of)[rows_there] >= least
        if (now != then).any():
            sentences.append(
                f"{(now & ~then).sum()} settings are {words} only in this store,"
                f" {(then & ~now).sum()} only in {name}."
            )
    order = np.argsort(-np.abs(np.log(ratio)), kind="stable")
    shown = [k for k in order.tolist() if np.isfinite(ratio[k]) and abs(ratio[k] - 1) > SAME]
    return StoreComparison(
        tuple(sentences), _table(results, rows, before, ratio, shown[:LISTED], column, name)
    )


def _by_setting(results: ReportedSweep) -> dict[tuple[str, ...], int]:
    """Rows of cells that are done, by the labels of the axes in the order of their names."""
    order = np.argsort([axis.name for axis in results.axes], kind="stable")
    return {
        tuple(results.axes[i].labels[results.chosen[row, i]] for i in order): row
        for row in np.flatnonzero(results.done).tolist()
    }


def _table(
    results: ReportedSweep,
    rows: Integers,
    before: Array,
    ratio: Array,
    shown: list[int],
    column: str,
    name: str,
) -> Table | None:
    if not shown:
        return None
    cells = results.frame["cell"].to_numpy()
    found = []
    for k in shown:
        row = int(rows[k])
        labels = [axis.labels[i] for axis, i in zip(results.axes, results.chosen[row], strict=True)]
        value = results.value(column, row)
        entries = (
            Entry(number(1e6 * value, 4), value, int(cells[row]), column),
            Entry(number(1e6 * float(before[k]), 4)),
            Entry(number(float(ratio[k]), 4)),
        )
        found.append(Row(tuple(labels), entries))
    headings = tuple(axis.name for axis in results.axes)
    columns = ("average here, µm", f"in {name}, µm", "ratio")
    caption = "Settings that differ most"
    return Table("comparison", caption, headings, columns, (Block("", tuple(found)),))
