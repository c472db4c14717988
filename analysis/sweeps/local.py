"""Runs tasks of a sweep in processes of this machine; a process that is killed costs nothing but time."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from functools import cache
from pathlib import Path

from ..processes import in_processes
from .execute import Runner
from .load import load_sweep
from .model import Sweep
from .task import Row, Task, compute, lost

# Deaths of processes, without a result in between, after which the tasks at the front are tried one by one.
DEATHS = 3
# Tries of a task in a process of its own.
TRIES = 2


def local_runner(sweep: Sweep, workers: int) -> Runner:
    """A runner in processes of this machine; with one worker in this process."""
    source = Path(os.path.abspath(sweep.source))

    def run(tasks: Sequence[Task]) -> Iterator[Row]:
        if workers == 1 or len(tasks) == 1:
            for task in tasks:
                yield _told(compute(sweep, task), sweep.source)
            return
        yield from _in_workers(sweep, source, tasks, workers)

    return run


def _in_workers(sweep: Sweep, source: Path, tasks: Sequence[Task], workers: int) -> Iterator[Row]:
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    left = {(task.number, task.block): task for task in tasks}
    deaths = 0
    while left:
        if deaths >= DEATHS:
            # One of those under way ends its process each time; each gets a process of its own.
            for task in list(left.values())[: 2 * workers]:
                del left[task.number, task.block]
                row = _alone(source, task)
                yield row if row is not None else lost(sweep, task)
            deaths = 0
        arguments = ((source, task) for task in list(left.values()))
        try:
            for row in in_processes(compute_in, arguments, workers, ordered=False, batch_size="auto"):
                del left[row.number, row.block]
                deaths = 0
                yield row
        except TerminatedWorkerError:
            deaths += 1


def _alone(source: Path, task: Task) -> Row | None:
    """The row of a task in a process of its own; None if the process ends each time."""
    context = multiprocessing.get_context("spawn")
    for _ in range(TRIES):
        with ProcessPoolExecutor(1, mp_context=context) as pool:
            try:
                return pool.submit(compute_in, source, task).result()
            except BrokenProcessPool:
                continue
    return None


def compute_in(source: Path, task: Task) -> Row:
    """Do a task of a sweep file, which is loaded once in each process."""
    return _told(compute(_loaded(source), task), source)


def _told(row: Row, source: Path) -> Row:
    """The row with files told from the sweep file's folder, wherever that is."""
    return replace(row, reason=row.reason.replace(f"{source.parent}/", "")) if row.reason else row


@cache
def _loaded(source: Path) -> Sweep:
    return load_sweep(source)
