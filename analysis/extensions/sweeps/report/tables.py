"""The tables of a report."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ballplate.montecarlo import MonteCarloEstimate, with_error
from ballplate.presentation import Block, Entry, Row, Table, number, percent

from ..store_columns import symbol_column
from .measures import (
    Measure,
    descriptions,
    rank_measures,
    trial_measures,
    uncertainty_measures,
)
from .results import ReportedSweep, criterion, partly_open, ranked

DIGITS = 3

# Columns beside each other, blocks below each other and rows of a table that can still be read.
MOST_COLUMNS, MOST_BLOCKS, MOST_ROWS = 12, 12, 200
MOST_BEST = 10

NOT_DONE = "left"
UNREADABLE = "unreadable"

# Behind a value that leaves out what is undetermined.
STAR = "*"


def report_tables(results: ReportedSweep) -> tuple[Table, ...]:
    """All tables of figures: the uncertainties and, where trials were made, those of Monte
    Carlo.
    """
    beside = _is_beside(results)
    measures = [*rank_measures(results), *uncertainty_measures(results, beside)]
    open_ = f"Maxima and averages leave out what is undetermined; {STAR} marks those that do."
    notes = (open_,) if rank_measures(results) else ()
    found = (
        [_table(results, "uncertainties", "Standard uncertainties", measures, beside, notes)]
        if measures
        else []
    )
    if not beside and len(results.frame) > 1:
        found = [*_best(results), *found]
    of_trials = trial_measures(results, beside)
    if of_trials:
        caption = "Monte Carlo beside the uncertainties"
        note = (
            "In parentheses the standard error in units of the last digit; actual is the root mean"
            " square of the errors, averaged as U is; covered is the share of true values within"
            " the expanded uncertainty for 95 %. U5 and U6 are followed over 1000 distances where"
            " there are more, of which actual is the average and which spread / U compares with"
            " their own U."
        )
        found.append(_table(results, "monte-carlo", caption, of_trials, beside, (note, *notes)))
    return tuple(found)


def _best(results: ReportedSweep) -> list[Table]:
    """The best cells first, where cells do not stand beside each other anyway."""
    judged = criterion(results)
    if judged is None:
        return []
    own = [one for one in uncertainty_measures(results, of_parts=False) if one.symbol == judged[1]]
    measures = [*rank_measures(results), *own]
    rows = ranked(results)[:MOST_BEST].tolist()
    note = f"By average {judged[1]}; cells that leave less undetermined come first."
    return [_below(results, "best", "Best cells", measures, (note,), rows)] if rows else []


def _is_beside(results: ReportedSweep) -> bool:
    """Whether cells fit beside each other: one axis as columns, another as blocks."""
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
    beside: bool,
    notes: tuple[str, ...] = (),
) -> Table:
    words = (*notes, *([f"{'; '.join(descriptions(measures))}."] if descriptions(measures) else []))
    build = _beside if beside else _below
    return build(results, name, caption, measures, words)


def _beside(
    results: ReportedSweep,
    name: str,
    caption: str,
    measures: Sequence[Measure],
    notes: tuple[str, ...],
) -> Table:
    """A column for each value of the last axis, a block for each of the first where there are
    two.
    """
    cells = {tuple(choice): cell for cell, choice in enumerate(results.cells.tolist())}
    rows = {int(cell): row for row, cell in enumerate(results.frame["cell"])}
    axis = results.axes[-1]
    firsts = range(len(results.axes[0].labels)) if len(results.axes) == 2 else [None]
    blocks = []
    for first in firsts:
        found = []
        for measure in measures:
            entries = []
            for last in range(len(axis.labels)):
                cell = cells.get((last,) if first is None else (first, last))
                entries.append(
                    Entry("") if cell is None else _entry(results, measure, cell, rows.get(cell))
                )
            found.append(Row((measure.name, measure.unit), tuple(entries)))
        title = "" if first is None else f"{results.axes[0].name} {results.axes[0].labels[first]}"
        if any(entry.text for row in found for entry in row.entries):
            blocks.append(Block(title, tuple(found)))
    block = "" if len(results.axes) == 1 else results.axes[0].name
    return Table(name, caption, ("", "unit"), axis.labels, tuple(blocks), axis.name, block, notes)


def _below(
    results: ReportedSweep,
    name: str,
    caption: str,
    measures: Sequence[Measure],
    notes: tuple[str, ...],
    rows: Sequence[int] | None = None,
) -> Table:
    """A row for each cell, as far as they can be read, or for some of them."""
    found = []
    for row in range(min(len(results.frame), MOST_ROWS)) if rows is None else rows:
        cell = int(results.frame["cell"].to_numpy()[row])
        labels = tuple(
            axis.labels[k]
            for axis, k in zip(results.axes, results.cells[cell].tolist(), strict=True)
        )
        entries = tuple(_entry(results, measure, cell, row) for measure in measures)
        found.append(Row((str(cell), *labels), entries))
    more = len(results.frame) - len(found)
    if more > 0 and rows is None:
        notes = (
            f"{more} cells more are not shown here; ballplate sweep --export gives all.",
            *notes,
        )
    headings = ("cell", *(axis.name for axis in results.axes))
    columns = tuple(measure.title for measure in measures)
    return Table(name, caption, headings, columns, (Block("", tuple(found)),), notes=notes)


def _entry(results: ReportedSweep, measure: Measure, cell: int, row: int | None) -> Entry:
    if row is None:
        text = UNREADABLE if cell in results.found.damaged else NOT_DONE
        return Entry(text, None, cell, measure.figure)
    if results.statuses[row] != "done":
        return Entry(results.statuses[row], None, cell, measure.figure)
    value = results.value(measure.figure, row)
    if math.isnan(value) and not _is_open(results, measure, row):
        # Not recorded of this cell, as opposed to undetermined.
        return Entry("", value, cell, measure.figure)
    if measure.is_count:
        text = "-" if math.isnan(value) else f"{value:.0f}"
    elif measure.error:
        text = with_error(
            MonteCarloEstimate(value, results.value(measure.error, row)), measure.factor
        )
    elif measure.is_share:
        # Never rounded up: what is told to be all is all.
        text = "-" if math.isnan(value) else percent(value).removesuffix(" %")
    else:
        text = number(measure.factor * value, DIGITS)
    if (
        measure.stands_for_all
        and partly_open(results, measure.symbol)[row]
        and not math.isnan(value)
    ):
        text += STAR
    return Entry(text, value, cell, measure.figure)


def _is_open(results: ReportedSweep, measure: Measure, row: int) -> bool:
    """Whether the observations of a cell leave open all that a measure tells of."""
    column = f"{symbol_column(measure.symbol)}_undetermined"
    return column in results.frame and results.value(column, row) > 0
