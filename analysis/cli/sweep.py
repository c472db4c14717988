"""`ballplate sweep`: a family of experiments, into a store that survives interruptions."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser, Namespace
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from .common import count

if TYPE_CHECKING:
    from ..sweeps.bundle import Bundle
    from ..sweeps.execute import Runner, Summary
    from ..sweeps.model import Sweep
    from ..sweeps.store import Store

WRONG_USAGE, BAD_FILE = 2, 3


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser: ArgumentParser = commands.add_parser(
        "sweep",
        help="compute a family of experiments into a store",
        description="Compute every cell of a sweep file: rank, U1 to U6, Monte Carlo if it asks for trials. Each "
        "finished cell is stored on disk; started again, the command goes on where it ended. The exit status is 0 if "
        "all cells are done, 1 if some have failed.",
    )
    parser.add_argument("file", metavar="FILE", type=Path, help="sweep file (YAML)")
    parser.add_argument("--store", metavar="FILE", type=Path, help="store; default: the sweep file's name with .sqlite")
    parser.add_argument("--dry-run", action="store_true", help="list the cells and estimate the time; store nothing")
    parser.add_argument("--workers", metavar="N", type=count, help="processes; default: one for each processor")
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="compute on the dask.distributed cluster of this scheduler instead"
    )
    parser.add_argument("--retry-failed", action="store_true", help="compute cells again that have failed")
    parser.add_argument("--fail-fast", action="store_true", help="end when a cell fails")
    parser.add_argument(
        "--beside", action="store_true", help="enter a changed sweep beside the one that is in the store"
    )
    parser.add_argument(
        "--folder",
        metavar="FOLDER",
        type=Path,
        action="append",
        default=[],
        help="a folder, besides those of the sweep file and of its base, whose files the sweep may name; the store "
        "keeps a copy of them; may be repeated",
    )
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Run a sweep; 1 if cells have failed."""
    from filelock import FileLock, Timeout

    from simulator.experiment.messages import in_one_line

    from ..sweeps.bundle import bundle_of
    from ..sweeps.cluster import ClusterError
    from ..sweeps.load import load_sweep
    from ..sweeps.store import StoreError, open_store
    from ..sweeps.store_file import check_place, is_same_file

    sweep = load_sweep(options.file, folders=tuple(Path(os.path.abspath(folder)) for folder in options.folder))
    if options.dry_run:
        return _dry_run(sweep, options)
    bundle = bundle_of(sweep)
    path = options.store or options.file.with_suffix(".sqlite")
    if any(is_same_file(path, file) for file in (options.file, sweep.base)):
        print(f"ballplate sweep: --store {path} is the sweep's own file; name another", file=sys.stderr)
        return WRONG_USAGE
    try:
        check_place(path, create=True)
        with FileLock(f"{path}.lock", timeout=0):
            store = open_store(path, create=True)
            try:
                return _run(sweep, bundle, store, options)
            finally:
                store.close()
    except Timeout:
        print(in_one_line(f"{path}: another process is computing into it; wait for it, or end it"), file=sys.stderr)
    except OSError as error:
        where = error.filename or path
        text = f"{where}: cannot be written ({error.strerror}); check the folder and its permissions"
        print(in_one_line(text), file=sys.stderr)
    except (StoreError, ClusterError) as error:
        print(error, file=sys.stderr)
    return BAD_FILE


def _run(sweep: Sweep, bundle: Bundle, store: Store, options: Namespace) -> int:
    from simulator.experiment.messages import in_one_line

    from ..sweeps.bundle import changes, definition
    from ..sweeps.execute import run_sweep
    from ..sweeps.local import ChangedError
    from ..sweeps.store import add_sweep, definitions, ensure_in_place, keys, mend, of_other_methods, statuses, unread
    from .progress import ProgressBar

    new = definition(sweep, bundle)
    stored, unreadable = definitions(store)
    number = next((k for k, old in stored.items() if not changes(old, new)), None)
    has_results = "done" in statuses(store).values()
    if number is None and unreadable and not options.beside:
        which, why = next(iter(unreadable.items()))
        text = f"what sweep {which} in it is of cannot be read ({why}); enter this one anew with --beside, where what"
        print(in_one_line(f"{store.path}: {text} is the same is not computed again"), file=sys.stderr)
        return BAD_FILE
    if number is None and stored and has_results and not options.beside:
        print(in_one_line(f"{store.path}: holds another sweep; what has changed:"), file=sys.stderr)
        for line in changes(stored[max(stored)], new)[:20]:
            print(f"  {in_one_line(line)}", file=sys.stderr)
        print("name another store with --store, or keep both in this one with --beside", file=sys.stderr)
        return BAD_FILE
    if number is None:
        number = add_sweep(store, new, bundle.files)
    mended, strays = mend(store, number, len(sweep.cells))
    told = unread(store.path, mended, strays, len(sweep.cells), "", "what is missing is computed anew")
    if told:
        print(told, file=sys.stderr)
    found = statuses(store)
    for text in of_other_methods(key for key in keys(store, number).values() if (key, 0) in found):
        print(in_one_line(f"{store.path}: {text}, and computes these cells anew"), file=sys.stderr)
    options.interruption.kept = lambda: f"what is done is in {store.path}, and the same command goes on from there"
    bar = ProgressBar("cells")

    def report(summary: Summary) -> None:
        options.interruption.answer()
        remark = ", ".join(
            ([f"{summary.blocks} blocks of data sets"] if summary.blocks else [])
            + ([f"{summary.failed} failed"] if summary.failed else [])
        )
        bar.show(summary.done + summary.failed, summary.cells, remark, summary.before)

    try:
        with _runner(sweep, bundle, options) as runner:
            summary = run_sweep(store, number, sweep, runner, options.retry_failed, options.fail_fast, report)
        if summary.left:
            options.interruption.answer()
    except ChangedError:
        bar.close()
        text = "the files of the sweep have been changed while it ran; what is done is stored, start it again"
        print(in_one_line(f"{options.file}: {text}"), file=sys.stderr)
        return BAD_FILE
    finally:
        bar.close()
    ensure_in_place(store)
    _tell(store, f" of sweep {number}" if len({*stored, *unreadable, number}) > 1 else "", number, summary)
    return 1 if summary.failed or summary.left else 0


def _runner(sweep: Sweep, bundle: Bundle, options: Namespace) -> AbstractContextManager[Runner]:
    from ..processes import processors
    from ..sweeps.cluster import cluster_runner
    from ..sweeps.local import local_runner

    if options.scheduler is not None:
        return cluster_runner(options.scheduler, sweep, bundle)
    return nullcontext(local_runner(sweep, bundle, options.workers or processors()))


def _tell(store: Store, which: str, number: int, summary: Summary) -> None:
    from simulator.experiment.messages import in_one_line

    from ..sweeps.store import results

    before = f" ({summary.before} of them before)" if summary.before else ""
    left = f", {summary.left} left" if summary.left else ""
    counted = f"{summary.cells} cell{'s' if summary.cells > 1 else ''}"
    told = f"{store.path}: {counted}{which}, {summary.done} done, {summary.failed} failed{before}{left}"
    print(in_one_line(told))
    found = results(store, number, summary.cells)
    versions = set(zip(*found.versions.values(), strict=True))
    if len(versions) > 1:
        text = f"{store.path}: the rows were computed with {len(versions)} different sets of versions"
        print(in_one_line(text), file=sys.stderr)
    if summary.failed:
        reasons: dict[str, list[int]] = {}
        for cell, status, reason in zip(found.cells.tolist(), found.statuses, found.reasons, strict=True):
            if status == "failed":
                reasons.setdefault(reason, []).append(cell)
        for reason, cells in list(reasons.items())[:10]:
            more = f" and {len(cells) - 1} more" if len(cells) > 1 else ""
            print(f"cell {cells[0]}{more} failed: {reason}", file=sys.stderr)
        if len(reasons) > 10:
            print(f"and {len(reasons) - 10} reasons more; see ballplate export", file=sys.stderr)


def _dry_run(sweep: Sweep, options: Namespace) -> int:
    from ..processes import processors
    from ..sweeps.estimate import seconds_of
    from .progress import duration

    for number in range(len(sweep.cells)):
        print(f"{number}: {sweep.label(number)}")
    workers = options.workers or processors()
    seconds, rows = seconds_of(sweep)
    words = f"with {workers} worker{'s' if workers > 1 else ''}, judged by {len(rows)} of them"
    cells = f"{len(sweep.cells)} cell{'s' if len(sweep.cells) > 1 else ''}"
    print(f"{cells}, about {duration(seconds / workers)} {words}", file=sys.stderr)
    failed = [row for row in rows if row.status == "failed"]
    for row in failed:
        print(f"cell {row.number} fails: {row.reason}", file=sys.stderr)
    return 1 if failed else 0
