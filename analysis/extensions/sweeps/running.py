"""A sweep from its file into its store: what the command and the face for Python share."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.presentation import Result
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.inputs import UnusableError, in_one_line
from filelock import FileLock, Timeout

from .bundle import Bundle, changes, definition
from .execute import Runner, Summary, run_sweep
from .frame import frame, frame_of
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

if TYPE_CHECKING:
    import pandas

# Changes between two sweeps that are listed.
MOST_CHANGES = 20

# How columns end that stand for a cell where a table is printed; the others are in the data frame.
AVERAGE = re.compile(r"U\d+(_lengths)?_average_\w+")

# Reasons of failures that are told.
MOST_REASONS = 10


class OtherSweepError(UnusableError):
    """The store holds another sweep; the text says what is different, a line for each."""


@dataclass(frozen=True)
class Entered:
    """A sweep in its store: its number there, whether there are others, and what is to be said of
    what it found.
    """

    number: int
    has_others: bool
    remarks: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class SweepResult(Result):
    """A sweep as far as it is computed: a row of the store for each cell.

    `remarks` say what the store held that could not be used, and is computed anew, and
    `shortcomings` why cells have failed, and that versions differ. `number` is the sweep's in its
    store.
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
        """The page of the sweep, with another store to `compare` with beside it."""
        from .report.sweep_page import sweep_page

        beside = None if compare is None else Path(compare)
        return sweep_page(self.store, self.number, run_modules, beside, report)

    def headline(self) -> str:
        one = self.summary
        left = f", {one.left} left" if one.left else ""
        return f"{one.cells} cells, {one.done} done, {one.failed} failed{left}"

    def lines(self) -> list[str]:
        names = list(self.table.columns)
        averages = [name for name in names if AVERAGE.fullmatch(name)]
        axes = names[: names.index("status") + 1]
        shown = [*axes, *(name for name in ("rank_deficiency",) if name in names), *averages]
        table = self.table[shown].to_string(index=False).splitlines()
        return [self.heading, self.headline(), *self.remarks, "", *table]

    def data(self) -> dict[str, Any]:
        one = self.summary
        counts = {"cells": one.cells, "done": one.done, "failed": one.failed, "left": one.left}
        return {
            "sweep": self.label,
            "title": self.title,
            "store": str(self.store),
            **counts,
            "shortcomings": list(self.shortcomings),
            "rows": self.rows(),
        }

    def rows(self) -> list[dict[str, Any]]:
        """One row for each cell, with its values of the axes and its figures; None where there is
        none.
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
    """The store at a path, made where there is none, for one process alone.

    :raises StoreError: no store, one that cannot be written, or one that another process is writing
        to.
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
    """Find a sweep in its store, or enter it; `beside` others that are there.

    :raises OtherSweepError: the store holds another one with results.
    :raises StoreError: what it holds cannot be read.
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
        last = "name another store with --store, or keep both in this one with --beside"
        raise OtherSweepError("\n".join([first, *differences, last]))
    if number is None:
        number = add_sweep(store, new, bundle.files)
    found = results(store, number, len(sweep.cells))
    remarks = [damaged_cells(store.path, found, "they are computed anew")]
    for text in of_other_methods(found.keys):
        remarks.append(in_one_line(f"{store.path}: {text}, and computes these cells anew"))
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
    """Compute what is left of a sweep that is entered.

    :raises StoreError: the store cannot be written, or is not in its place any more.
    :raises ChangedError: files of the sweep have been changed meanwhile.
    """
    with runner as working:
        summary = run_sweep(store, entered.number, sweep, working, retry_failed, fail_fast, report)
    ensure_in_place(store)
    return summary


def shortcomings(store: Store, number: int, cells: int) -> tuple[str, ...]:
    """What is to be said of the rows of a sweep: that versions differ, and why cells have
    failed.
    """
    found, told = results(store, number, cells), []
    versions = {tuple(row.versions.items()) for row in found.rows}
    if len(versions) > 1:
        text = f"the rows were computed with {len(versions)} different sets of versions"
        told.append(in_one_line(f"{store.path}: {text}"))
    reasons: dict[str, list[int]] = {}
    for row in found.rows:
        if row.status == "failed":
            reasons.setdefault(row.reason, []).append(row.number)
    for reason, failed in list(reasons.items())[:MOST_REASONS]:
        more = f" and {len(failed) - 1} more" if len(failed) > 1 else ""
        told.append(f"cell {failed[0]}{more} failed: {reason}")
    if len(reasons) > MOST_REASONS:
        told.append(f"and {len(reasons) - MOST_REASONS} reasons more; see ballplate sweep --export")
    return tuple(told)


def result_of(store: Store, sweep: Sweep, entered: Entered, summary: Summary) -> SweepResult:
    """The rows of a sweep in its store."""
    table = frame(store, entered.number)
    return SweepResult(
        sweep.source.stem,
        sweep.title,
        Path(store.path),
        summary,
        table,
        entered.number,
        entered.remarks,
        shortcomings(store, entered.number, summary.cells),
    )


def stored_result(store: Store, sweep: int | None = None) -> SweepResult:
    """A sweep of a store, by default the newest, as far as it is computed.

    :raises StoreError: there is no such sweep, or its definition cannot be read.
    """
    number, defined = chosen_sweep(store, sweep)
    cells = len(defined["cells"])
    found = results(store, number, cells)
    status = [row.status for row in found.rows]
    summary = Summary(cells, len(status), status.count("done"), status.count("failed"))
    damage = damaged_cells(store.path, found, "they are left out")
    return SweepResult(
        Path(store.path).stem,
        str(defined["title"]),
        Path(store.path),
        summary,
        frame_of(found, defined),
        number,
        (damage,) if damage else (),
        shortcomings(store, number, cells),
    )
