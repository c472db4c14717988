"""Tables of a report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ballplate.montecarlo import MonteCarloEstimate, with_error
from ballplate.presentation import Block, Entry, Row, Table, number, percent

from ..store_columns import symbol_column
from .answer import answer
from .measures import (
    Measure,
    descriptions,
    rank_measures,
    trial_measures,
    uncertainty_measures,
)
from .results import (
    ReportedSweep,
    given_sentences,
    texts_of_all,
    texts_of_cell,
    unspanned_sentences,
)

DIGITS = 3

# Limits of a readable table: columns, blocks and rows.
MOST_COLUMNS, MOST_BLOCKS, MOST_ROWS = 12, 12, 200

NOT_DONE = "left"
UNREADABLE = "unreadable"


def report_tables(results: ReportedSweep) -> tuple[Table, ...]:
    """Return all tables: uncertainties and, if there were trials, Monte Carlo."""
    in_columns = _fits_columns(results)
    given = tuple(given_sentences(results))
    measures = [*rank_measures(results), *uncertainty_measures(results, in_columns)]
    tables = (
        [_table(results, "uncertainties", "Standard uncertainties", measures, in_columns, given)]
        if measures
        else []
    )
    of_trials = trial_measures(results, in_columns)
    if of_trials:
        caption = "Monte Carlo and the uncertainties"
        note = (
            "In parentheses: standard error in units of the last digit. Actual: root mean square"
            " of the errors, averaged as U is. Covered: share of true values within the expanded"
            " uncertainty for 95 %. Of more than 1000 distances of U5 and U6, a sample of 1000"
            " gives actual, and spread / U with the U of the sample."
        )
        tables.append(_table(results, "monte-carlo", caption, of_trials, in_columns, (note,)))
    return tuple(tables)


def text_tables(results: ReportedSweep) -> tuple[Table, ...]:
    """Return the tables of a report without a page; those of many cases begin with the best."""
    found = None if _fits_columns(results) else answer(results)
    tables = (*([found.settings] if found else []), *report_tables(results))
    lost = tuple(unspanned_sentences(results))
    return (*(replace(table, notes=(*lost, *table.notes)) for table in tables[:1]), *tables[1:])


def _fits_columns(results: ReportedSweep) -> bool:
    """Return whether the cells fit one axis as columns, and another as blocks."""
    counts = [len(axis.labels) for axis in results.axes]
    return (
        len(counts) <= 2
        and counts[-1] <= MOST_COLUMNS
        and (len(counts) == 1 or counts[0] <= MOST_BLOCKS)
        and len(results.cells) <= MOST_ROWS
    )


def _table(
    results: ReportedSweep,
    name: str,
    caption: str,
    measures: Sequence[Measure],
    in_columns: bool,
    notes: tuple[str, ...] = (),
) -> Table:
    words = (*notes, *([f"{'; '.join(descriptions(measures))}."] if descriptions(measures) else []))
    build = _columns_table if in_columns else _rows_table
    return build(results, name, caption, measures, words)


def _columns_table(
    results: ReportedSweep,
    name: str,
    caption: str,
    measures: Sequence[Measure],
    notes: tuple[str, ...],
) -> Table:
    """Return a table with a column for each value of the last axis, a block for each of the
    first of two.
    """
    cells = {tuple(choice): cell for cell, choice in enumerate(results.cells.tolist())}
    rows = {int(cell): row for row, cell in enumerate(results.frame["cell"])}
    axis = results.axes[-1]
    firsts = range(len(results.axes[0].labels)) if len(results.axes) == 2 else [None]
    texts = texts_of_all(results)
    blocks = []
    for first in firsts:
        here = [
            cells.get((last,) if first is None else (first, last))
            for last in range(len(axis.labels))
        ]
        measure_rows = [
            Row(
                (measure.name, measure.unit),
                tuple(
                    Entry("") if cell is None else _entry(results, measure, cell, rows.get(cell))
                    for cell in here
                ),
                texts,
            )
            for measure in measures
        ]
        title = "" if first is None else f"{results.axes[0].name} {results.axes[0].labels[first]}"
        if any(entry.text for row in measure_rows for entry in row.entries):
            blocks.append(Block(title, tuple(measure_rows)))
    block = "" if len(results.axes) == 1 else results.axes[0].name
    return Table(name, caption, ("", "unit"), axis.labels, tuple(blocks), axis.name, block, notes)


def _rows_table(
    results: ReportedSweep,
    name: str,
    caption: str,
    measures: Sequence[Measure],
    notes: tuple[str, ...],
) -> Table:
    """Return a table with a row for each cell, up to MOST_ROWS."""
    cell_rows = []
    for row in range(min(len(results.frame), MOST_ROWS)):
        cell = results.cell(row)
        entries = tuple(_entry(results, measure, cell, row) for measure in measures)
        cell_rows.append(
            Row((str(cell), *results.labels(row)), entries, texts_of_cell(results, cell))
        )
    more = len(results.frame) - len(cell_rows)
    if more > 0:
        notes = (
            f"Cases not shown here: {more}; ballplate sweep --export gives all.",
            *notes,
        )
    headings = ("cell", *(axis.name for axis in results.axes))
    columns = tuple(measure.title for measure in measures)
    return Table(name, caption, headings, columns, (Block("", tuple(cell_rows)),), notes=notes)


def _entry(results: ReportedSweep, measure: Measure, cell: int, row: int | None) -> Entry:
    if row is None:
        text = UNREADABLE if cell in results.found.damaged else NOT_DONE
        return Entry(text, None, cell, measure.figure)
    if results.statuses[row] != "done":
        return Entry(results.statuses[row], None, cell, measure.figure)
    value = results.value(measure.figure, row)
    if math.isnan(value) and not _is_open(results, measure, row):
        # Not recorded, as opposed to undetermined.
        return Entry("", value, cell, measure.figure)
    if measure.is_count:
        text = "-" if math.isnan(value) else f"{value:.0f}"
    elif measure.error:
        text = with_error(
            MonteCarloEstimate(value, results.value(measure.error, row)), measure.factor
        )
    elif measure.statistic == "within target":
        # Never rounded up: 100 % means all.
        text = "-" if math.isnan(value) else percent(value).removesuffix(" %")
    else:
        text = number(measure.factor * value, DIGITS)
    return Entry(text, value, cell, measure.figure)


def _is_open(results: ReportedSweep, measure: Measure, row: int) -> bool:
    """Return whether a cell leaves some values of a measure undetermined."""
    return results.value(f"{symbol_column(measure.symbol)}_undetermined", row) > 0
