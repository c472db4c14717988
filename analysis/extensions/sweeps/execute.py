"""Execution of the remaining tasks of a sweep, and storage of their results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

from ballplate.montecarlo import Accumulator
from ballplate.simulator.computing import ProgressStep, Report, unreported
from ballplate.simulator.inputs import number_of

from .model import Sweep
from .store import Store, add_keys, add_rows, block_tally, keys, statuses
from .task import KEY_ONLY, CellResult, CellTask, blocks_of

# Computes tasks on any machine, and yields their rows in the order of completion.
Runner = Callable[[Sequence[CellTask]], Iterator[CellResult]]


# Replicate blocks that are computed together, before the cells that use their sums.
BLOCKS_AT_ONCE = 16


@dataclass(frozen=True)
class Summary:
    """Progress of a sweep: cells in all, done or failed, `before` of them in an earlier run.

    `blocks` counts the replicate blocks of this run.
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
        """The same as a step for a progress display."""
        notes = [f"{number_of(self.blocks, 'block')} of data sets"] if self.blocks else []
        notes += [f"{self.failed} failed"] if self.failed else []
        return ProgressStep(
            "cases", self.done + self.failed, self.cells, ", ".join(notes), self.before
        )


@dataclass
class _Run:
    """State of a running sweep: keys by cell, statuses by key and block."""

    store: Store
    cells: int
    keys: dict[int, str]
    statuses: dict[tuple[str, int], str]
    before: int = 0

    def status(self, cell: int, block: int = 0) -> str:
        return self.statuses.get((self.keys[cell], block), "") if cell in self.keys else ""

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
    """Compute the remaining cells of sweep `number` of a store; each row is on disk before its
    report.

    :raises StoreError: the store cannot be written.
    """
    run = _Run(store, len(sweep.cells), keys(store, number), statuses(store))
    if {key for key, _ in run.statuses} - set(run.keys.values()):
        # Another sweep of this store may have computed a cell already.
        unknown = [CellTask(k, KEY_ONLY) for k in range(run.cells) if k not in run.keys]
        fresh = {row.number: row.key for row in runner(unknown)}
        add_keys(store, number, fresh)
        run.keys |= fresh
    final = ("done",) if retry_failed else ("done", "failed")
    remaining = [k for k in range(run.cells) if run.status(k) not in final]
    run.before = run.cells - len(remaining)
    summary = run.summary() if not retry_failed else Summary(run.cells, run.before, run.before, 0)
    report(summary.step)
    failed = set()
    for cells in _groups(remaining, blocks_of(sweep)):
        for tasks in _waves(run, cells, blocks_of(sweep)):
            for row in runner(tasks) if tasks else ():
                # A block that fails is its cell's failure.
                row = replace(row, block=0) if row.status == "failed" else row
                was_failed = row.number in failed
                add_rows(store, number, [row])
                run.keys[row.number], run.statuses[row.key, row.block] = row.key, row.status
                if row.status == "failed":
                    failed.add(row.number)
                finished = summary.done + (row.block == 0 and row.status == "done")
                more = int(row.status == "failed" and not was_failed)
                counted = summary.failed + more, summary.blocks + (row.block > 0)
                summary = Summary(run.cells, run.before, finished, *counted)
                report(summary.step)
                if row.status == "failed" and fail_fast:
                    return run.summary()
    return run.summary()


def _groups(cells: list[int], blocks: int) -> Iterator[list[int]]:
    """Return groups of cells whose replicate blocks are computed together; one group without
    blocks.
    """
    size = max(BLOCKS_AT_ONCE // blocks, 1) if blocks else max(len(cells), 1)
    for start in range(0, len(cells), size):
        yield cells[start : start + size]


def _waves(run: _Run, cells: list[int], blocks: int) -> Iterator[list[CellTask]]:
    """Return tasks of the missing blocks, then of the cells, which use the blocks' sums."""
    numbers = range(1, blocks + 1)
    yield [CellTask(k, block) for k in cells for block in numbers if run.status(k, block) != "done"]
    sound = [
        k for k in cells if not blocks or all(run.status(k, block) == "done" for block in numbers)
    ]
    yield [CellTask(k, 0, _total(run, k, numbers) if blocks else None) for k in sound]


def _total(run: _Run, cell: int, blocks: range) -> Accumulator | None:
    """Return sums over all replicate blocks of a cell; None if it cannot have replicates."""
    stored = [block_tally(run.store, run.keys[cell], block) for block in blocks]
    tallies = [part for part in stored if part is not None]
    return reduce(add, tallies) if len(tallies) == len(stored) else None
