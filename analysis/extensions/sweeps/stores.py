"""Sweeps and their stores from Python: what `ballplate sweep`, `export` and `report` do.

Every function raises `ballplate.StoreError` for a store that cannot be used, and otherwise what
those of `ballplate.api` raise.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.inputs import (
    ensure_one_of,
    ensure_path,
    ensure_report,
    ensure_type,
    ensure_whole,
)

if TYPE_CHECKING:
    from .running import SweepResult

PathLike = str | os.PathLike[str]

FORMS = ("html", "text", "markdown", "csv", "latex")


def sweep(
    path: PathLike,
    store: PathLike | None = None,
    workers: int = 1,
    retry_failed: bool = False,
    beside: bool = False,
    fail_fast: bool = False,
    folders: Sequence[PathLike] = (),
    report: Report = unreported,
) -> SweepResult:
    """A family of experiments, computed into a store, which continues where it stopped.

    The store is the sweep file's name with .sqlite, unless another is named. A sweep other than the
    one that it holds is refused, or entered `beside` that. `folders` are those, besides those of
    the sweep file and of its base, whose files the sweep may name; with `fail_fast` it ends when a
    cell fails.

    :raises StoreError: the store cannot be used.
    :raises OtherSweepError: it holds another sweep.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sweep("designs/sweeps/plate-size.yaml", f"{folder}/plates.sqlite")
    <SweepResult of plate-size: 12 cells, 12 done, 0 failed>
    """
    from contextlib import nullcontext

    from .bundle import bundle_of
    from .load import load_sweep
    from .local import local_runner
    from .running import compute_sweep, enter, result_of, writable_store

    ensure_path("path", path)
    ensure_whole(1, workers=workers)
    ensure_type(bool, "True or False", retry_failed=retry_failed, beside=beside)
    ensure_type(bool, "True or False", fail_fast=fail_fast)
    ensure_report(report)
    given = load_sweep(path, folders=tuple(Path(os.path.abspath(one)) for one in folders))
    bundle = bundle_of(given)
    with writable_store(
        Path(path).with_suffix(".sqlite") if store is None else Path(store)
    ) as opened:
        entered = enter(opened, given, bundle, beside)
        runner = nullcontext(local_runner(given, bundle, workers))
        summary = compute_sweep(opened, given, entered, runner, retry_failed, fail_fast, report)
        return result_of(opened, given, entered, summary)


def stored(store: PathLike, sweep: int | None = None) -> SweepResult:
    """A sweep of a store, the newest unless its number is given, as far as it is computed.

    What of a damaged store cannot be read is in the result's `remarks`, and its cells are left out.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = f"{folder}/plates.sqlite"
    ...     computed = sweep("designs/sweeps/plate-size.yaml", path)
    ...     stored(path).to_frame().equals(computed.to_frame())
    True
    """
    from contextlib import closing

    from .running import stored_result
    from .store import open_store

    ensure_path("store", store)
    ensure_whole(1, sweep=sweep)
    with closing(open_store(Path(store))) as opened:
        return stored_result(opened, sweep)


def sweep_report(
    store: PathLike,
    sweep: int | None = None,
    form: Literal["html", "text", "markdown", "csv", "latex"] = "html",
    run_modules: bool = False,
    report: Report = unreported,
    compare: PathLike | None = None,
) -> str:
    r"""A sweep of a store as an HTML page, or its tables in another form.

    Drawings of designs whose error models are in Python need `run_modules`. On a page the newest
    sweep of a store to `compare` with is set beside it.

    :raises ImportError: what pages need is not installed.
    :raises ValueError: the two sweeps cannot be compared.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = f"{folder}/plates.sqlite"
    ...     computed = sweep("designs/sweeps/plate-size.yaml", path)
    ...     print(*sweep_report(path, form="markdown").splitlines()[:3], sep="\n")
    # size of the plate and number of its balls
    <BLANKLINE>
    ## Standard uncertainties
    """
    from contextlib import closing

    from .report.results import read_results
    from .store import open_store

    ensure_path("store", store)
    ensure_whole(1, sweep=sweep)
    ensure_one_of(FORMS, form=form)
    if compare is not None:
        ensure_path("compare", compare)
        if form != "html":
            raise ValueError("compare goes with a page only; leave it out")
    ensure_type(bool, "True or False", run_modules=run_modules)
    ensure_report(report)
    with closing(open_store(Path(store))) as opened:
        results = read_results(opened, sweep)
        if form == "html":
            from .report.page import page
            from .report.store_comparison import compared

            beside = None
            if compare is not None:
                with closing(open_store(Path(compare))) as other:
                    beside = compared(results, read_results(other, None), Path(compare).name)
            return page(opened, results, run_modules, report, beside)
        from ballplate.presentation import FORMATS

        from .report.tables import report_tables

        return FORMATS[form](results.title, report_tables(results))
