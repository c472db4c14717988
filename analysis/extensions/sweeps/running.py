"""A sweep from its file into its store, for the command and for Python."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path

from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.inputs import UnusableError, in_one_line
from filelock import FileLock, Timeout

from .answer import answer
from .bundle import Bundle, bundle_of, changes, definition
from .execute import Runner, Summary, run_sweep
from .frame import frame_of
from .local import local_runner
from .model import Sweep
from .result import SweepResult
from .store import (
    Store,
    add_details,
    add_sweep,
    chosen_sweep,
    definitions,
    details_of,
    ensure_in_place,
    keys,
    open_store,
    results,
    statuses,
)
from .store_file import StoreError, check_place
from .stored import StoredRow
from .task import GIVEN_ONLY, CellTask

# Changes between two sweeps that are listed.
MOST_CHANGES = 20

# Reasons of failures that are listed.
MOST_REASONS = 10


class OtherSweepError(UnusableError):
    """The store holds another sweep; the text lists the differences, one per row."""


@contextmanager
def writable_store(path: Path) -> Iterator[Store]:
    """Open the store at a path for this process alone; a missing store is made.

    :raises StoreError: no store, a damaged one, one that cannot be written, or one that another
        process has opened.
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


def enter(store: Store, sweep: Sweep, bundle: Bundle, beside: bool) -> int:
    """Find a sweep in its store, or enter it; with `beside`, in addition to others. Return its
    number.

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
    return add_sweep(store, new) if number is None else number


def compute_sweep(
    store: Store,
    sweep: Sweep,
    number: int,
    runner: AbstractContextManager[Runner],
    retry_failed: bool = False,
    fail_fast: bool = False,
    report: Report = unreported,
) -> Summary:
    """Compute the remaining cells of sweep `number` of a store, then what the figures of those that
    its answer names take for granted.

    :raises StoreError: the store cannot be written, or was moved.
    :raises ChangedError: files of the sweep have changed meanwhile.
    """
    with runner as working:
        summary = run_sweep(store, number, sweep, working, retry_failed, fail_fast, report)
        if not summary.left:
            result = stored_result(store, number)
            found, by_cell = answer(result), keys(store, number)
            rows = [] if found is None else [found.best[0], *found.outstanding]
            for cell in dict.fromkeys(map(int, result.table["cell"][rows])):
                _assess(store, by_cell[cell], working, cell)
    ensure_in_place(store)
    return summary


def _assess(store: Store, key: str, runner: Runner, cell: int) -> None:
    """Enter what the figures of a cell take for granted, assumptions included."""
    if "assessed" not in details_of(store, key):
        for row in runner([CellTask(cell, GIVEN_ONLY)]):
            given = row.details.get("given", [f"assumptions not assessed ({row.reason})"])
            add_details(store, key, {"given": given, "assessed": True})


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
        number = enter(store, sweep, bundle, beside)
        runner = nullcontext(local_runner(sweep, bundle, workers))
        summary = compute_sweep(store, sweep, number, runner, retry_failed, fail_fast, report)
        result = stored_result(store, number)
    return replace(result, label=sweep.source.stem, summary=summary)


def shortcomings(path: Path, rows: Sequence[StoredRow]) -> tuple[str, ...]:
    """Return notes on the rows of a sweep: different versions, parts of the volume that are no
    longer spanned, differences of Monte Carlo from linear theory, and reasons of failed cells.
    """
    notes = []
    versions = {tuple(row.versions.items()) for row in rows}
    if len(versions) > 1:
        text = f"the rows were computed with {len(versions)} different sets of versions"
        notes.append(in_one_line(f"{path}: {text}"))
    reasons: dict[str, list[int]] = {}
    for row in rows:
        flags = row.details.get("flags", {}).items()
        differences = "; ".join(f"{symbol} {', '.join(names)}" for symbol, names in flags)
        texts = {
            " failed: ": row.reason,
            ": ": row.details.get("unspanned", ""),
            ": no Monte Carlo: ": row.details.get("monte_carlo", ""),
            ": Monte Carlo differs from linear theory: ": differences,
        }
        for start, text in texts.items():
            if text:
                reasons.setdefault(f"{start}{text}", []).append(row.number)
    for reason, cells in list(reasons.items())[:MOST_REASONS]:
        more = f" and {len(cells) - 1} more" if len(cells) > 1 else ""
        notes.append(f"case {cells[0]}{more}{reason}")
    if len(reasons) > MOST_REASONS:
        more_reasons = len(reasons) - MOST_REASONS
        notes.append(f"and {more_reasons} reasons more; see ballplate sweep --export")
    return tuple(notes)


def stored_result(store: Store, sweep: int | None = None) -> SweepResult:
    """Return a sweep of a store, by default the newest, as computed so far.

    :raises StoreError: there is no such sweep, or its definition cannot be read.
    """
    number, defined = chosen_sweep(store, sweep)
    cells = len(defined["cells"])
    stored = results(store, number, cells)
    status = [row.status for row in stored.rows]
    summary = Summary(cells, len(status), status.count("done"), status.count("failed"))
    return SweepResult(
        Path(store.path).stem,
        Path(store.path),
        number,
        defined,
        summary,
        frame_of(stored, defined),
        shortcomings(store.path, stored.rows),
    )
