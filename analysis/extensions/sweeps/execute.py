"""Execution of the remaining tasks of a sweep, and storage of their results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

from ballplate.montecarlo import Accumulator
from ballplate.simulator.computing import ProgressStep, Report, unreported

from .fingerprint import METHOD, method_of
from .model import Sweep
from .store import Store, add_keys, add_rows, block_tally, keys, statuses
from .task import KEY_ONLY, CellResult, CellTask, blocks_of

# Does tasks, anywhere, and yields their rows as they come.
Runner = Callable[[Sequence[CellTask]], Iterator[CellResult]]


# Replicate blocks that are done before the cells that they belong to.
BLOCKS_AT_ONCE = 16


@dataclass(frozen=True)
class Summary:
    """How far a sweep has come: cells in all, done or failed, `before` of them in an earlier run.

    `blocks` counts the replicate blocks done in this run.
    """

    cells: int
    before: int
    done: int
    failed: int
    blocks: int = 0

    @property
    def left(self) -> int:
        return self.cells - self.done - self.failed

    @property
    def step(self) -> ProgressStep:
        """The same as a step, for whoever shows how far it has come."""
        told = [f"{self.blocks} blocks of data sets"] if self.blocks else []
        told += [f"{self.failed} failed"] if self.failed else []
        return ProgressStep(
            "cells", self.done + self.failed, self.cells, ", ".join(told), self.before
        )


@dataclass
class _Run:
    """What is known of the cells while a sweep runs: keys by cell, statuses by key and block."""

    store: Store
    cells: int
    known: dict[int, str]
    found: dict[tuple[str, int], str]
    before: int = 0

    def status(self, cell: int, block: int = 0) -> str:
        return self.found.get((self.known[cell], block), "") if cell in self.known else ""

    def summary(self) -> Summary:
        states = [self.status(cell) for cell in range(self.cells)]
        return Summary(self.cells, self.before, states.count("done"), states.count("failed"))


def run_sweep(
    store: Store,
    number: int,
    sweep: Sweep,
    runner: Runner,
    retry_failed: bool = False,
    fail_fast: bool = False,
    report: Report = unreported,
) -> Summary:
    """Do what is left of sweep `number` of a store; each row is on disk before it is reported.

    :raises StoreError: the store cannot be written.
    """
    known = {cell: key for cell, key in keys(store, number).items() if method_of(key) == METHOD}
    run = _Run(store, len(sweep.cells), known, statuses(store))
    if {key for key, _ in run.found} - set(run.known.values()):
        # What another sweep of this store has computed needs no second time. Rows of another method
        # give way before the first is computed anew, so that none stand beside one another.
        unknown = [CellTask(k, KEY_ONLY) for k in range(run.cells) if k not in run.known]
        fresh = {row.number: row.key for row in runner(unknown)}
        add_keys(store, number, fresh)
        run.known |= fresh
    done_with = ("done",) if retry_failed else ("done", "failed")
    left = [k for k in range(run.cells) if run.status(k) not in done_with]
    run.before = run.cells - len(left)
    summary = run.summary() if not retry_failed else Summary(run.cells, run.before, run.before, 0)
    report(summary.step)
    failed: set[int] = set()
    for cells in _groups(left, blocks_of(sweep)):
        for tasks in _waves(run, cells, blocks_of(sweep)):
            for row in runner(tasks) if tasks else ():
                # A block that fails is its cell's failure.
                row = replace(row, block=0) if row.status == "failed" else row
                was_failed = row.number in failed
                add_rows(store, number, [row])
                run.known[row.number], run.found[row.key, row.block] = row.key, row.status
                if row.status == "failed":
                    failed.add(row.number)
                done = summary.done + (row.block == 0 and row.status == "done")
                more = int(row.status == "failed" and not was_failed)
                counted = summary.failed + more, summary.blocks + (row.block > 0)
                summary = Summary(run.cells, run.before, done, *counted)
                report(summary.step)
                if row.status == "failed" and fail_fast:
                    return run.summary()
    return run.summary()


def _groups(cells: list[int], blocks: int) -> Iterator[list[int]]:
    """Cells whose replicate blocks are done together, before the cells themselves; all at once
    where there are none.
    """
    size = max(BLOCKS_AT_ONCE // blocks, 1) if blocks else max(len(cells), 1)
    for start in range(0, len(cells), size):
        yield cells[start : start + size]


def _waves(run: _Run, cells: list[int], blocks: int) -> Iterator[list[CellTask]]:
    """Tasks of the blocks that are not done yet, then those of the cells, which take the blocks'
    sums.
    """
    numbers = range(1, blocks + 1)
    yield [CellTask(k, block) for k in cells for block in numbers if run.status(k, block) != "done"]
    sound = [
        k for k in cells if not blocks or all(run.status(k, block) == "done" for block in numbers)
    ]
    yield [CellTask(k, 0, _total(run, k, numbers) if blocks else None) for k in sound]


def _total(run: _Run, cell: int, blocks: range) -> Accumulator | None:
    """Sums over all replicate blocks of a cell, which are done; None where it has no replicates for
    a reason.
    """
    parts = [block_tally(run.store, run.known[cell], block) for block in blocks]
    tallies = [part for part in parts if part is not None]
    return reduce(add, tallies) if len(tallies) == len(parts) else None
