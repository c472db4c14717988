"""Comparison of two sweeps: settings that both have, by the average uncertainty that cells are
judged by.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.presentation import Block, Entry, Row, Table, number
from ballplate.simulator.inputs import listing, number_of
from ballplate.simulator.machines import Array

from .answer import WITHIN
from .axis_worth import SAME
from .measures import column_unit
from .results import Integers, ReportedSweep, best_first, criterion, partly_open

# Settings that are listed, those that differ most.
LISTED = 12

# Digits to which values of an axis are the same in both sweeps, in whichever unit they are written;
# values of one sweep that are alike in these are told apart by more, up to those that tell any two
# numbers apart.
DIGITS, ALL_DIGITS = 9, 17


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
    here, there = _by_setting(results, other)
    both = [key for key in here if key in there]
    sentences = [
        f"{_settings_are(len(both))} done in both; {len(here) - len(both)} in this store alone,"
        f" {len(there) - len(both)} in {name} alone."
    ]
    told = symbol.replace("_", " ")
    rows = np.array([here[key] for key in both], np.int64)
    rows_there = np.array([there[key] for key in both], np.int64)
    value, before = results.figure(column)[rows], other.figure(column)[rows_there]
    # Averages that leave out what is undetermined are not of the same lengths.
    open_ = partly_open(results, symbol)[rows] | partly_open(other, symbol)[rows_there]
    open_ |= ~(np.isfinite(value) & np.isfinite(before))
    ratio = np.full(len(rows), np.nan)
    np.divide(value, before, out=ratio, where=~open_ & (value > 0.0) & (before > 0.0))
    if open_.any():
        sentences.append(
            f"In {open_.sum()} of them some of {told} is undetermined in one or both: these are not"
            " compared."
        )
    for words, changed in (("smaller", ratio < 1 - SAME), ("larger", ratio > 1 + SAME)):
        if changed.any():
            ends = ratio[changed].min(), ratio[changed].max()
            by = " to ".join(dict.fromkeys(number(float(one), 3) for one in ends))
            sentences.append(
                f"The average of {told} is {words} than in {name} in"
                f" {changed.sum()} of them, by a factor of {by}."
            )
    same = int((np.abs(ratio - 1) <= SAME).sum())
    if same:
        which = f"{number_of(same, 'average')} {'is' if same == 1 else 'are'}"
        which = "All averages are" if same == len(both) > 1 else which
        sentences.append(f"{which} the same.")
    for words, name_of, least in (
        ("rank-deficient", "rank_deficiency", 1.0),
        ("within the target, each store's own, with all lengths", WITHIN, 1.0),
    ):
        now = results.figure(name_of)[rows] >= least
        then = other.figure(name_of)[rows_there] >= least
        if (now != then).any():
            sentences.append(
                f"{_settings_are(int((now & ~then).sum()))} {words} only in this store,"
                f" {(then & ~now).sum()} only in {name}."
            )
    order = best_first(-np.abs(np.log(ratio)))
    shown = [k for k in order.tolist() if np.isfinite(ratio[k]) and abs(ratio[k] - 1) > SAME]
    return StoreComparison(
        tuple(sentences), _table(results, rows, before, ratio, shown[:LISTED], column, name)
    )


def _settings_are(count: int) -> str:
    """So many settings with the verb.

    >>> _settings_are(1), _settings_are(2)
    ('1 setting is', '2 settings are')
    """
    return f"{number_of(count, 'setting')} {'is' if count == 1 else 'are'}"


def _by_setting(*sweeps: ReportedSweep) -> list[dict[tuple[str, ...], int]]:
    """Rows of the cells of each sweep that are done, by the values of the axes in the order of
    their names.
    """
    orders = [np.argsort([axis.name for axis in one.axes], kind="stable") for one in sweeps]
    axes = [
        [one.definition["axes"][i] for i in order]
        for one, order in zip(sweeps, orders, strict=True)
    ]
    keys = zip(*(_values(*alike) for alike in zip(*axes, strict=True)), strict=True)
    found = []
    for one, order, own in zip(sweeps, orders, keys, strict=True):
        rows = np.flatnonzero(one.done).tolist()
        chosen = one.chosen[:, order].tolist()
        found.append(
            {tuple(key[k] for key, k in zip(own, chosen[row], strict=True)): row for row in rows}
        )
    return found


def _values(*axes: dict[str, Any]) -> list[list[str]]:
    """Values of an axis in several stores, alike for the same size in another unit and different
    for any two of one store; texts as they are.

    >>> inch = {"unit": "m", "values": [25.4e-3]}
    >>> _values({"unit": "m", "values": [0.0254 + 1e-17]}, inch)
    [['0.0254 m'], ['0.0254 m']]
    >>> _values({"unit": "m", "values": [1.0, 1.0000000001]}, {"unit": "m", "values": [1.0]})
    [['1 m', '1.0000000001 m'], ['1 m']]
    """
    found: list[list[str]] = []
    for digits in range(DIGITS, ALL_DIGITS + 1):
        found = [_rounded(axis, digits) for axis in axes]
        if all(
            len(set(one)) == len(set(_rounded(axis, ALL_DIGITS)))
            for one, axis in zip(found, axes, strict=True)
        ):
            break
    return found


def _rounded(axis: dict[str, Any], digits: int) -> list[str]:
    if not axis["unit"]:
        return [str(label) for label in axis["labels"]]
    return [f"{float(value) + 0.0:.{digits}g} {axis['unit']}" for value in axis["values"]]


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
    unit = column_unit(column)
    columns = (f"average here, {unit}", f"in {name}, {unit}", "ratio")
    caption = "Settings that differ most"
    return Table("comparison", caption, headings, columns, (Block("", tuple(found)),))
