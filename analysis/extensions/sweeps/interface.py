"""Sweeps and their stores from Python, as `ballplate sweep` computes them.

Every function raises `ballplate.StoreError` for a store that it cannot use, otherwise the errors of
`ballplate.api`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.inputs import ensure_path, ensure_report, ensure_type, ensure_whole

if TYPE_CHECKING:
    from .result import SweepResult

PathLike = str | os.PathLike[str]


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
    """Compute a family of experiments into a store, or continue an interrupted sweep.

    The default store is the sweep file's name with .sqlite. A store that holds another sweep is
    refused, unless `beside` adds this one. The sweep may name files in its own folder, that of its
    base, and `folders`; `fail_fast` stops it when a cell fails.

    :raises StoreError: the store cannot be used.
    :raises OtherSweepError: it holds another sweep.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = f"{folder}/plates.sqlite"
    ...     computed = sweep("designs/sweeps/plate-size.yaml", path)
    ...     computed, stored(path).to_frame().equals(computed.to_frame())
    (<SweepResult of plate-size: 12 cases, 12 done, 0 failed>, True)
    """
    from .load import load_sweep
    from .running import computed

    ensure_path("path", path)
    ensure_whole(1, workers=workers)
    ensure_type(bool, "True or False", retry_failed=retry_failed, beside=beside)
    ensure_type(bool, "True or False", fail_fast=fail_fast)
    ensure_report(report)
    loaded = load_sweep(path, folders=tuple(Path(os.path.abspath(folder)) for folder in folders))
    into = Path(path).with_suffix(".sqlite") if store is None else Path(store)
    return computed(loaded, into, workers, retry_failed, beside, fail_fast, report)


def stored(store: PathLike, sweep: int | None = None) -> SweepResult:
    """Return a sweep of a store, the newest unless its number is given, with the cells computed so
    far.

    :raises StoreError: the store cannot be used, or is damaged.

    What it reads is what `sweep` has written; other files are refused.

    >>> stored("designs/quickstart.yaml")  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    StoreError: designs/quickstart.yaml is no store
    """
    from contextlib import closing

    from .running import stored_result
    from .store import open_store

    ensure_path("store", store)
    ensure_whole(1, sweep=sweep)
    with closing(open_store(Path(store))) as opened:
        return stored_result(opened, sweep)
