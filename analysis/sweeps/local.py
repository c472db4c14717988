"""Runs tasks of a sweep in processes of this machine; a process that is killed costs nothing but time."""

from __future__ import annotations

import multiprocessing
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path

from ..processes import in_processes
from .bundle import Bundle, unpack
from .execute import Runner
from .load import load_sweep
from .model import Sweep
from .task import Row, Task, compute, lost

# Deaths of processes, without a result in between, after which the tasks at the front are tried one by one.
DEATHS = 3
# Tries of a task in a process of its own.
TRIES = 2


@contextmanager
def local_runner(bundle: Bundle, workers: int) -> Iterator[Runner]:
    """A runner in processes of this machine; with one worker in this process."""
    with tempfile.TemporaryDirectory(prefix="ballplate-") as name:
        folder = Path(name)
        yield _runner(folder, unpack(bundle, folder), workers)


def _runner(folder: Path, source: Path, workers: int) -> Runner:

    def run(tasks: Sequence[Task]) -> Iterator[Row]:
        if workers == 1 or len(tasks) == 1:
            for task in tasks:
                yield compute_in(folder, source, task)
            return
        yield from _in_workers(folder, source, tasks, workers)

    return run


def _in_workers(folder: Path, source: Path, tasks: Sequence[Task], workers: int) -> Iterator[Row]:
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    left = {(task.number, task.block): task for task in tasks}
    deaths = 0
    while left:
        if deaths >= DEATHS:
            # One of those under way ends its process each time; each gets a process of its own.
            for task in list(left.values())[: 2 * workers]:
                del left[task.number, task.block]
                yield _alone(folder, source, task)
            deaths = 0
        arguments = ((folder, source, task) for task in list(left.values()))
        try:
            for row in in_processes(compute_in, arguments, workers, ordered=False, batch_size="auto"):
                del left[row.number, row.block]
                deaths = 0
                yield row
        except TerminatedWorkerError:
            deaths += 1


def _alone(folder: Path, source: Path, task: Task) -> Row:
    context = multiprocessing.get_context("spawn")
    for _ in range(TRIES):
        with ProcessPoolExecutor(1, mp_context=context) as pool:
            try:
                return pool.submit(compute_in, folder, source, task).result()
            except BrokenProcessPool:
                continue
    return lost(_loaded(source), task)


def compute_in(folder: Path, source: Path, task: Task) -> Row:
    """Do a task of the sweep file `source` in `folder`; texts tell files by their place in the folder."""
    row = compute(_loaded(source), task)
    return replace(row, reason=row.reason.replace(f"{folder.as_posix()}/", ""))


@cache
def _loaded(source: Path) -> Sweep:
    return load_sweep(source)
