"""`ballplate sweep`: compute a family of experiments into a store that survives interruptions."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser, Namespace
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import UsageError, add_workers, complain, duration, progress

if TYPE_CHECKING:
    from ballplate.simulator.computing import ProgressStep

    from .bundle import Bundle
    from .execute import Runner, Summary
    from .model import Sweep
    from .store import Store

BAD_FILE = 3


DESCRIPTION = (
    "Compute every case of a sweep file: rank, U1 to U6 and, if the file sets trials, Monte Carlo."
    " Each finished case is stored on disk; after an interruption, the same command computes the"
    " remaining cases. Exit status: 0 if all cases are done, 1 if some have failed."
)


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="sweep file (YAML)")
    parser.add_argument(
        "--store",
        metavar="FILE",
        type=Path,
        help="store; default: the sweep file's name with .sqlite",
    )
    parser.add_argument(
        "--dry-run", action="store_true", help="only list the cases and estimate the time"
    )
    add_workers(parser)
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="compute on the dask.distributed cluster of this scheduler instead",
    )
    parser.add_argument("--retry-failed", action="store_true", help="compute failed cases again")
    parser.add_argument("--fail-fast", action="store_true", help="stop when a case fails")
    parser.add_argument(
        "--beside",
        action="store_true",
        help="add a changed sweep to a store that holds another",
    )
    parser.add_argument(
        "--folder",
        metavar="FOLDER",
        type=Path,
        action="append",
        default=[],
        help=(
            "further folder whose files the sweep may name; default: the"
            " folders of the sweep file and of its base; may be repeated"
        ),
    )


def run(options: Namespace) -> int:
    """Run a sweep and return 1 if cells have failed."""
    from .bundle import bundle_of
    from .load import load_sweep
    from .running import writable_store

    sweep = load_sweep(
        options.file, folders=tuple(Path(os.path.abspath(folder)) for folder in options.folder)
    )
    if options.dry_run:
        return _dry_run(sweep, options)
    bundle = bundle_of(sweep)
    path = options.store or options.file.with_suffix(".sqlite")
    if os.path.realpath(path) in map(os.path.realpath, (options.file, sweep.base)):
        raise UsageError(f"--store {path} is the sweep's own file; name another")
    try:
        with writable_store(path) as store:
            return _run(sweep, bundle, store, options)
    except OSError as error:
        where = error.filename or path
        complain(
            f"{where}: cannot be written ({error.strerror}); check the folder and its permissions"
        )
        return BAD_FILE


def _run(sweep: Sweep, bundle: Bundle, store: Store, options: Namespace) -> int:
    from .local import ChangedError
    from .running import compute_sweep, enter

    number = enter(store, sweep, bundle, options.beside)
    options.interruption.kept = lambda: (
        f"finished cases are in {store.path}, and the same command continues from there"
    )
    try:
        with progress(options) as shown:

            def report(step: ProgressStep) -> None:
                options.interruption.answer()
                shown.show(step)

            runner = _runner(sweep, bundle, options)
            summary = compute_sweep(
                store, sweep, number, runner, options.retry_failed, options.fail_fast, report
            )
        if summary.left:
            options.interruption.answer()
    except ChangedError:
        text = (
            "files of the sweep have changed while it ran; start it again: finished cases are"
            " stored"
        )
        complain(f"{options.file}: {text}")
        return BAD_FILE
    _report(store, number, summary)
    return 1 if summary.failed or summary.left else 0


def _runner(sweep: Sweep, bundle: Bundle, options: Namespace) -> AbstractContextManager[Runner]:
    from ballplate.simulator.computing import processors

    from .cluster import cluster_runner
    from .local import local_runner

    if options.scheduler is not None:
        return cluster_runner(options.scheduler, sweep, bundle)
    return nullcontext(local_runner(sweep, bundle, options.workers or processors()))


def _report(store: Store, number: int, summary: Summary) -> None:
    from ballplate.simulator.inputs import in_one_line, number_of

    from .running import shortcomings
    from .store import definitions, results

    which = f" of sweep {number}" if len(definitions(store)) > 1 else ""
    before = f" ({summary.before} of them before)" if summary.before else ""
    remaining = f", {summary.left} left" if summary.left else ""
    counted = f"{number_of(summary.cells, 'case')}{which}"
    counts = f"{summary.done} done, {summary.failed} failed{before}{remaining}"
    print(in_one_line(f"{store.path}: {counted}, {counts}"))
    for text in shortcomings(store.path, results(store, number, summary.cells).rows):
        complain(text)


def _dry_run(sweep: Sweep, options: Namespace) -> int:
    from ballplate.simulator.computing import processors
    from ballplate.simulator.inputs import number_of

    from .estimate import seconds_of

    for number in range(len(sweep.cells)):
        print(f"{number}: {sweep.label(number)}")
    workers = options.workers or processors()
    seconds, rows = seconds_of(sweep)
    words = f"with {number_of(workers, 'worker')}, estimated from {len(rows)}"
    cells = number_of(len(sweep.cells), "case")
    print(f"{cells}, about {duration(seconds / workers)} {words}", file=sys.stderr)
    failed = [row for row in rows if row.status == "failed"]
    for row in failed:
        print(f"case {row.number} fails: {row.reason}", file=sys.stderr)
    return 1 if failed else 0
