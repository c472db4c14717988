"""A sweep from its file into its store, for the command and for Python."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.presentation import Data, Result, picked
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.inputs import UnusableError, in_one_line
from filelock import FileLock, Timeout

from .bundle import Bundle, bundle_of, changes, definition
from .execute import Runner, Summary, run_sweep
from .frame import frame_of
from .local import local_runner
from .model import Sweep
from .store import (
    Store,
    add_sweep,
    chosen_sweep,
    damaged_cells,
    definitions,
    ensure_in_place,
    of_other_methods,
    open_store,
    results,
    statuses,
)
from .store_file import StoreError, check_place
from .stored import StoredRow

if TYPE_CHECKING:
    import pandas

# Changes between two sweeps that are listed.
MOST_CHANGES = 20

# Columns of a printed table; the data frame has all.
AVERAGE = re.compile(r"U\d+(_lengths)?_average_\w+")

# Reasons of failures that are listed.
MOST_REASONS = 10


class OtherSweepError(UnusableError):
    """The store holds another sweep; the text lists the differences, one per row."""


@dataclass(frozen=True)
class Entered:
    """A sweep in its store: its number, whether there are others, notes on unusable rows."""

    number: int
    has_others: bool
    remarks: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class SweepResult(Result):
    """A sweep as computed so far: a row of the store for each cell.

    `remarks` are notes on stored rows that could not be used; `shortcomings` are reasons of failed
    cells and differences of versions. `number` is the sweep's in its store.
    """

    label: str
    title: str
    store: Path
    summary: Summary
    table: pandas.DataFrame
    number: int
    remarks: tuple[str, ...] = ()
    shortcomings: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        return self.shortcomings

    def page_text(self, run_modules: bool, compare: str | Path | None, report: Report) -> str:
        """Return the sweep's page, compared with the newest sweep of another store if given."""
        from .report.sweep_page import sweep_page

        reference = None if compare is None else Path(compare)
        return sweep_page(self.store, self.number, run_modules, reference, report)

    def headline(self) -> str:
        summary = self.summary
        remaining = f", {summary.left} left" if summary.left else ""
        return f"{summary.cells} cases, {summary.done} done, {summary.failed} failed{remaining}"

    def lines(self) -> list[str]:
        names = list(self.table.columns)
        averages = [name for name in names if AVERAGE.fullmatch(name)]
        axes = names[: names.index("status") + 1]
        rank = [name for name in ("rank_deficiency",) if name in names]
        shown = [*axes, *rank, *averages, "given"]
        table = self.table[shown].to_string(index=False).splitlines()
        return [self.heading, self.headline(), *self.remarks, "", *table]

    def data(self) -> Data:
        return {
            "sweep": self.label,
            "title": self.title,
            "store": str(self.store),
            **picked(self.summary, "cells", "done", "failed", "left"),
            "shortcomings": self.shortcomings,
            "rows": self.rows(),
        }

    def rows(self) -> list[Data]:
        """Return one mapping per cell, with its axes' values and its results; None for missing
        ones.
        """
        table = self.table.astype(object)
        return [
            {str(k): v for k, v in row.items()}
            for row in table.where(table.notna(), None).to_dict("records")
        ]

    def to_frame(self) -> pandas.DataFrame:
        return self.table


@contextmanager
def writable_store(path: Path) -> Iterator[Store]:
    """Open the store at a path for this process alone; a missing store is made.

    :raises StoreError: no store, one that cannot be written, or one that another process has
        opened.
    """
    check_place(path, create=True)
    try:
        with FileLock(f"{path}.lock", timeout=0):
            store = open_store(path, create=True)
            try:
                yield store
            finally:
                store.close()
    except Timeout:
        raise StoreError(
            f"{path}: another process is computing into it; wait for it, or end it"
        ) from None


def enter(store: Store, sweep: Sweep, bundle: Bundle, beside: bool) -> Entered:
    """Find a sweep in its store, or enter it; with `beside`, in addition to others.

    :raises OtherSweepError: the store holds another one with results.
    :raises StoreError: the store cannot be read.
    """
    new = definition(sweep, bundle)
    stored = definitions(store)
    number = next((k for k, old in stored.items() if not changes(old, new)), None)
    has_results = "done" in statuses(store).values()
    if number is None and stored and has_results and not beside:
        differences = [
            f"  {in_one_line(line)}" for line in changes(stored[max(stored)], new)[:MOST_CHANGES]
        ]
        first = in_one_line(f"{store.path}: holds another sweep; what has changed:")
        last = "name another store with --store, or add the sweep to this one with --beside"
        raise OtherSweepError("\n".join([first, *differences, last]))
    if number is None:
        number = add_sweep(store, new, bundle.files)
    rows = results(store, number, len(sweep.cells))
    remarks = [damaged_cells(store.path, rows, "replaced in this run")]
    for text in of_other_methods(rows.keys):
        remarks.append(in_one_line(f"{store.path}: {text}; replaced in this run"))
    has_others = len({*stored, number}) > 1
    return Entered(number, has_others, tuple(filter(None, remarks)))


def compute_sweep(
    store: Store,
    sweep: Sweep,
    entered: Entered,
    runner: AbstractContextManager[Runner],
    retry_failed: bool = False,
    fail_fast: bool = False,
    report: Report = unreported,
) -> Summary:
    """Compute the remaining cells of a sweep that is entered.

    :raises StoreError: the store cannot be written, or was moved.
    :raises ChangedError: files of the sweep have changed meanwhile.
    """
    with runner as working:
        summary = run_sweep(store, entered.number, sweep, working, retry_failed, fail_fast, report)
    ensure_in_place(store)
    return summary


def computed(
    sweep: Sweep,
    path: Path,
    workers: int = 1,
    retry_failed: bool = False,
    beside: bool = False,
    fail_fast: bool = False,
    report: Report = unreported,
) -> SweepResult:
    """Compute a sweep into the store at a path on this machine; see `ballplate.sweep`."""
    bundle = bundle_of(sweep)
    with writable_store(path) as store:
        entered = enter(store, sweep, bundle, beside)
        runner = nullcontext(local_runner(sweep, bundle, workers))
        summary = compute_sweep(store, sweep, entered, runner, retry_failed, fail_fast, report)
        return result_of(store, sweep, entered, summary)


def shortcomings(path: Path, rows: Sequence[StoredRow]) -> tuple[str, ...]:
    """Return notes on the rows of a sweep: different versions, parts of the volume that are no
    longer spanned, and reasons of failed cells.
    """
    notes = []
    versions = {tuple(row.versions.items()) for row in rows}
    if len(versions) > 1:
        text = f"the rows were computed with {len(versions)} different sets of versions"
        notes.append(in_one_line(f"{path}: {text}"))
    reasons: dict[str, list[int]] = {}
    for row in rows:
        of_size = row.details.get("unspanned")
        if row.status == "failed" or of_size:
            text = f": {of_size}" if of_size else f" failed: {row.reason}"
            reasons.setdefault(text, []).append(row.number)
    for reason, cells in list(reasons.items())[:MOST_REASONS]:
        more = f" and {len(cells) - 1} more" if len(cells) > 1 else ""
        notes.append(f"case {cells[0]}{more}{reason}")
    if len(reasons) > MOST_REASONS:
        more_reasons = len(reasons) - MOST_REASONS
        notes.append(f"and {more_reasons} reasons more; see ballplate sweep --export")
    return tuple(notes)


def result_of(store: Store, sweep: Sweep, entered: Entered, summary: Summary) -> SweepResult:
    """Return a sweep that has been computed, with its rows in the store."""
    return replace(
        stored_result(store, entered.number),
        label=sweep.source.stem,
        title=sweep.title,
        summary=summary,
        remarks=entered.remarks,
    )


def stored_result(store: Store, sweep: int | None = None) -> SweepResult:
    """Return a sweep of a store, by default the newest, as computed so far.

    :raises StoreError: there is no such sweep, or its definition cannot be read.
    """
    number, defined = chosen_sweep(store, sweep)
    cells = len(defined["cells"])
    stored = results(store, number, cells)
    status = [row.status for row in stored.rows]
    summary = Summary(cells, len(status), status.count("done"), status.count("failed"))
    damage = damaged_cells(store.path, stored, "not in this result")
    return SweepResult(
        Path(store.path).stem,
        str(defined["title"]),
        Path(store.path),
        summary,
        frame_of(stored, defined),
        number,
        (damage,) if damage else (),
        shortcomings(store.path, stored.rows),
    )
