"""Execution of a sweep's tasks in processes of this machine; a killed process costs only time."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from ballplate.simulator.computing import begin_worker, in_processes, safe_path
from ballplate.simulator.inputs import ExperimentError, Trust

from .bundle import Bundle, bundle_of, files_of
from .execute import Runner
from .load import load_sweep
from .model import Sweep
from .task import CellResult, CellTask, compute, lost

# Deaths of processes, without a result in between, after which each of the next tasks gets its own
# process.
DEATHS = 3
# Tries of a task in a process of its own.
TRIES = 2


class ChangedError(Exception):
    """Files of a sweep have changed since its start."""


@dataclass(frozen=True)
class _Source:
    """Source of a sweep for another process: its file, further folders, the trust in them."""

    file: Path
    folders: tuple[Path, ...]
    trust: Trust


def local_runner(sweep: Sweep, bundle: Bundle, workers: int) -> Runner:
    """Return a runner in processes of this machine; with one worker in this process.

    It raises ChangedError instead of returning a row from changed files.
    """
    source = _Source(Path(os.path.abspath(sweep.source)), sweep.folders, sweep.trust)
    digest = bundle.digest

    def run(tasks: Sequence[CellTask]) -> Iterator[CellResult]:
        if workers > 1 and tasks:
            yield from _in_workers(sweep, source, digest, tasks, workers)
            return
        watched = _watched(sweep, digest)
        for task in tasks:
            yield _row(watched, task)

    return run


def _in_workers(
    sweep: Sweep, source: _Source, digest: str, tasks: Sequence[CellTask], workers: int
) -> Iterator[CellResult]:
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    remaining = {(task.number, task.block): task for task in tasks}
    deaths = 0
    while remaining:
        if deaths >= DEATHS:
            # One of the current tasks kills its process each time: separate them.
            for task in list(remaining.values())[: 2 * workers]:
                del remaining[task.number, task.block]
                row = _alone(source, digest, task)
                yield row if row is not None else lost(sweep, task)
            deaths = 0
        arguments = ((source, digest, task) for task in list(remaining.values()))
        try:
            for row in in_processes(
                compute_unchanged, arguments, workers, ordered=False, batch_size="auto"
            ):
                del remaining[row.number, row.block]
                deaths = 0
                yield row
        except TerminatedWorkerError:
            deaths += 1


def _alone(source: _Source, digest: str, task: CellTask) -> CellResult | None:
    """Return the row of a task in a process of its own; None if the process dies each time."""
    context = multiprocessing.get_context("spawn")
    for _ in range(TRIES):
        with (
            safe_path(),
            ProcessPoolExecutor(
                1, context, initializer=begin_worker, initargs=(os.getpid(),)
            ) as pool,
        ):
            try:
                return pool.submit(compute_unchanged, source, digest, task).result()
            except BrokenProcessPool:
                continue
    return None


def compute_unchanged(source: _Source, digest: str, task: CellTask) -> CellResult:
    """Compute a task of a sweep file, which each process loads once.

    :raises ChangedError: its files differ from those of the bundle with this digest.
    """
    return _row(_loaded(source, digest), task)


@dataclass(frozen=True)
class _Watched:
    """A sweep with the paths and the signature of its files, by which changes are detected."""

    sweep: Sweep
    paths: list[Path]
    signature: object


def _watched(sweep: Sweep, digest: str) -> _Watched:
    try:
        paths = files_of(sweep)
        # Signed before they are read, so that no change goes undetected.
        watched = _Watched(sweep, paths, _signature(paths))
        if bundle_of(sweep).digest == digest:
            return watched
    except ExperimentError:
        pass
    raise ChangedError


def _row(watched: _Watched, task: CellTask) -> CellResult:
    row = compute(watched.sweep, task)
    if _signature(watched.paths) != watched.signature:
        raise ChangedError
    return with_relative_paths(row, watched.sweep.source)


def with_relative_paths(row: CellResult, source: Path) -> CellResult:
    """Return the row, with files in its reason relative to the sweep file's folder."""
    if not row.reason or source.parent == Path("."):
        return row
    return replace(row, reason=row.reason.replace(f"{source.parent}{os.sep}", ""))


@cache
def _loaded(source: _Source, digest: str) -> _Watched:
    try:
        sweep = load_sweep(source.file, folders=source.folders, trust=source.trust)
    except ExperimentError:
        raise ChangedError from None
    return _watched(sweep, digest)


def _signature(paths: Sequence[Path]) -> object:
    """Return times, sizes and inodes of files."""
    try:
        statuses = [os.stat(path) for path in paths]
    except OSError:
        return None
    return [(status.st_mtime_ns, status.st_size, status.st_ino) for status in statuses]
