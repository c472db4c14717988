"""Comparison of two sweeps: common settings, by the average uncertainty that cells are judged
by.
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
from .results import Integers, ReportedSweep, best_first, criterion

# Settings in the table, those that differ most.
LISTED = 12

# Significant digits in which an axis's values must agree in both sweeps, whose units may differ;
# more, up to all digits, if values of one sweep would be equal.
DIGITS, ALL_DIGITS = 9, 17


class IncomparableError(ValueError):
    """Two sweeps cannot be compared; the text states the difference."""


@dataclass(frozen=True)
class StoreComparison:
    """Comparison of two sweeps at the same settings, as sentences and a table."""

    sentences: tuple[str, ...]
    settings: Table | None


def compared(results: ReportedSweep, reference: ReportedSweep, name: str) -> StoreComparison:
    """Compare a sweep with a reference called `name`; settings match by the names and values of
    their axes.

    :raises IncomparableError: their axes differ, or they have no criterion in common.
    """
    axes_here, axes_there = ({axis.name for axis in sweep.axes} for sweep in (results, reference))
    if axes_here != axes_there:
        raise IncomparableError(
            f"{name} is swept over {listing(sorted(axes_there))} and this store over"
            f" {listing(sorted(axes_here))}; compare sweeps of the same axes"
        )
    judged, theirs = criterion(results), criterion(reference)
    if judged is None or theirs is None or judged != theirs:
        raise IncomparableError(f"{name} and this store record no quantity that both are judged by")
    column, symbol = judged
    here, there = _by_setting(results, reference)
    common = [key for key in here if key in there]
    sentences = [
        f"{_settings_are(len(common))} done in both; {len(here) - len(common)} in this store alone,"
        f" {len(there) - len(common)} in {name} alone."
    ]
    quantity = symbol.replace("_", " ")
    rows = np.array([here[key] for key in common], np.int64)
    rows_there = np.array([there[key] for key in common], np.int64)
    value, before = results.figure(column)[rows], reference.figure(column)[rows_there]
    open_ = ~(np.isfinite(value) & np.isfinite(before))
    ratio = np.full(len(rows), np.nan)
    np.divide(value, before, out=ratio, where=~open_ & (value > 0.0) & (before > 0.0))
    if open_.any():
        sentences.append(
            f"{_settings_are(int(open_.sum()))} not compared: some of {quantity} is undetermined."
        )
    for words, changed in (("smaller", ratio < 1 - SAME), ("larger", ratio > 1 + SAME)):
        if changed.any():
            ends = ratio[changed].min(), ratio[changed].max()
            factor = " to ".join(dict.fromkeys(number(sweep, 3) for sweep in ends))
            sentences.append(
                f"The average of {quantity} is {words} than in {name} in"
                f" {number_of(int(changed.sum()), 'case')}, by a factor of {factor}."
            )
    same = int((np.abs(ratio - 1) <= SAME).sum())
    if same:
        which = f"{number_of(same, 'average')} {'is' if same == 1 else 'are'}"
        which = "All averages are" if same == len(common) > 1 else which
        sentences.append(f"{which} the same.")
    for words, name_of, least in (
        ("rank-deficient", "rank_deficiency", 1.0),
        ("within the target, each store's own, with all lengths", WITHIN, 1.0),
    ):
        now = results.figure(name_of)[rows] >= least
        then = reference.figure(name_of)[rows_there] >= least
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
    """Return a number of settings with its verb.

    >>> _settings_are(1), _settings_are(2)
    ('1 case is', '2 cases are')
    """
    return f"{number_of(count, 'case')} {'is' if count == 1 else 'are'}"


def _by_setting(*sweeps: ReportedSweep) -> list[dict[tuple[str, ...], int]]:
    """Return each sweep's rows of finished cells by the values of the axes, sorted by name."""
    orders = [np.argsort([axis.name for axis in sweep.axes], kind="stable") for sweep in sweeps]
    axes = [
        [sweep.definition["axes"][i] for i in order]
        for sweep, order in zip(sweeps, orders, strict=True)
    ]
    keys = zip(*(_values(*alike) for alike in zip(*axes, strict=True)), strict=True)
    rows_by_setting = []
    for sweep, order, sweep_keys in zip(sweeps, orders, keys, strict=True):
        rows = np.flatnonzero(sweep.done).tolist()
        chosen = sweep.chosen[:, order].tolist()
        rows_by_setting.append(
            {
                tuple(key[k] for key, k in zip(sweep_keys, chosen[row], strict=True)): row
                for row in rows
            }
        )
    return rows_by_setting


def _values(*axes: dict[str, Any]) -> list[list[str]]:
    """Return values of an axis in several stores as texts: equal for equal sizes in any unit,
    distinct in one store.

    >>> inch = {"unit": "m", "values": [25.4e-3]}
    >>> _values({"unit": "m", "values": [0.0254 + 1e-17]}, inch)
    [['0.0254 m'], ['0.0254 m']]
    >>> _values({"unit": "m", "values": [1.0, 1.0000000001]}, {"unit": "m", "values": [1.0]})
    [['1 m', '1.0000000001 m'], ['1 m']]
    """
    texts = []
    for digits in range(DIGITS, ALL_DIGITS + 1):
        texts = [_rounded(axis, digits) for axis in axes]
        if all(
            len(set(rounded)) == len(set(_rounded(axis, ALL_DIGITS)))
            for rounded, axis in zip(texts, axes, strict=True)
        ):
            break
    return texts


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
    table_rows = []
    for k in shown:
        row = int(rows[k])
        value = results.value(column, row)
        entries = (
            Entry(number(1e6 * value, 4), value, results.cell(row), column),
            Entry(number(1e6 * before[k], 4)),
            Entry(number(ratio[k], 4)),
        )
        table_rows.append(Row(results.labels(row), entries))
    headings = tuple(axis.name for axis in results.axes)
    unit = column_unit(column)
    columns = (f"average here, {unit}", f"in {name}, {unit}", "ratio")
    caption = "Cases that differ most"
    return Table("comparison", caption, headings, columns, (Block("", tuple(table_rows)),))
