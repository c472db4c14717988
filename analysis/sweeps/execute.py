"""Does the tasks of a sweep that are left, and stores what comes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

from ..montecarlo.tally import Tally
from .model import Sweep
from .store import Store, add_keys, add_rows, block_tally, keys, statuses
from .task import KEY_ONLY, Row, Task, blocks_of

# Does tasks, anywhere, and yields their rows as they come.
Runner = Callable[[Sequence[Task]], Iterator[Row]]


@dataclass(frozen=True)
class Summary:
    """How far a sweep has come: cells in all, done or failed, `before` of them in an earlier run."""

    cells: int
    before: int
    done: int
    failed: int

    @property
    def left(self) -> int:
        return self.cells - self.done - self.failed


@dataclass
class _Run:
    """What is known of the cells while a sweep runs: keys by cell, statuses by key and block."""

    store: Store
    number: int
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
    report: Callable[[Summary], None] = lambda summary: None,
) -> Summary:
    """Do what is left of sweep `number` of a store; each row is on disk before it is reported.

    :raises StoreError: the store cannot be written.
    """
    run = _Run(store, number, len(sweep.cells), keys(store, number), statuses(store))
    if {key for key, _ in run.found} - set(run.known.values()):
        # What another sweep of this store has computed needs no second time.
        unknown = [Task(k, KEY_ONLY) for k in range(run.cells) if k not in run.known]
        fresh = {row.number: row.key for row in runner(unknown)}
        add_keys(store, number, fresh)
        run.known |= fresh
    done_with = ("done",) if retry_failed else ("done", "failed")
    left = [k for k in range(run.cells) if run.status(k) not in done_with]
    summary = run.summary()
    run.before = summary.done + summary.failed
    summary = run.summary()
    report(summary)
    blocks = range(1, blocks_of(sweep) + 1)
    parts = [Task(k, block) for k in left for block in blocks if run.status(k, block) != "done"]
    for tasks in (parts, [Task(k) for k in left]):
        if tasks and tasks[0].block == 0 and blocks:
            tasks = [Task(one.number, 0, _total(run, one.number, blocks)) for one in tasks]
        done, failed = summary.done, summary.failed
        rows = runner(tasks) if tasks else iter(())
        for row in rows:
            before = run.found.get((row.key, row.block))
            add_rows(store, number, [row])
            run.known[row.number], run.found[row.key, row.block] = row.key, row.status
            if row.block == 0:
                done += row.status == "done"
                failed += (row.status == "failed") - (before == "failed")
                report(Summary(run.cells, run.before, done, failed))
            if row.status == "failed" and fail_fast:
                return run.summary()
    return run.summary()


def _total(run: _Run, cell: int, blocks: range) -> Tally | None:
    """Sums over all replicate blocks of a cell; None where a block could not be computed."""
    if any(run.status(cell, block) != "done" for block in blocks):
        return None
    parts = [block_tally(run.store, run.known[cell], block) for block in blocks]
    tallies = [part for part in parts if part is not None]
    return reduce(add, tallies) if len(tallies) == len(parts) else None
