"""Sweeps and their stores from Python, as `ballplate sweep` computes them.

Every function raises `ballplate.StoreError` for a store that it cannot use, otherwise the errors of
`ballplate.api`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.arguments import PathLike, experiment_of
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import (
    ExperimentError,
    ensure_path,
    ensure_report,
    ensure_type,
    ensure_whole,
    listing,
    refused,
)

if TYPE_CHECKING:
    from .result import SweepResult


def sweep(
    experiment: Experiment | PathLike,
    axes: Mapping[str | tuple[str, ...], Any] | None = None,
    store: PathLike | None = None,
    workers: int = 1,
    criterion: str | None = None,
    trials: int | None = None,
    seed: int | None = None,
    record: Sequence[str] = (),
    retry_failed: bool = False,
    beside: bool = False,
    fail_fast: bool = False,
    folders: Sequence[PathLike] = (),
    report: Report = unreported,
) -> SweepResult:
    """Compute a family of experiments: an experiment over axes, or the path of a sweep file.

    `axes` maps paths of the experiment to values, as a list or by name; a tuple of paths takes the
    same values, or one of each row. A name maps to an axis as a sweep file has it. `hours`,
    `positions` and `readings` with numbers are limits of plans from the experiment's pool, which
    minimise the `criterion`, by default U6: then each case chooses its positions as
    `ballplate.plan` does. `estimator` lists estimators to compare. `trials` are synthetic data sets
    of each case, from the `seed`; `record` names the quantities that are kept, by default U1 to U6.

    Without a `store` axes are computed in memory; the results of a sweep file are stored in its
    name with .sqlite. An interrupted sweep continues from its store. A store that holds another
    sweep is refused, unless `beside` adds this one. A sweep file may name files in its own folder,
    that of its base, and `folders`; `fail_fast` stops when a case fails.

    :raises StoreError: the store cannot be used.
    :raises OtherSweepError: it holds another sweep.
    :raises ValueError: settings that a sweep file states itself.

    >>> import ballplate as bp
    >>> bp.sweep(bp.quickstart(), {"machine.repeatability": ["0.2 um", "0.4 um"]})
    <SweepResult of quickstart: 2 cases, 2 done, 0 failed>
    """
    from dataclasses import replace
    from tempfile import TemporaryDirectory

    from .load import load_sweep
    from .running import computed
    from .temporary import sweep_of

    ensure_whole(1, workers=workers, trials=trials)
    ensure_whole(0, seed=seed)
    ensure_type(bool, "True or False", retry_failed=retry_failed, beside=beside)
    ensure_type(bool, "True or False", fail_fast=fail_fast)
    ensure_report(report)
    ways = (workers, retry_failed, beside, fail_fast, report)
    stated: dict[str, Any] = {"trials": trials, "seed": seed, "record": list(record) or None}
    stated["plan"] = None if criterion is None else {"criterion": criterion}
    stated = {key: value for key, value in stated.items() if value is not None}
    if axes is None:
        ensure_path("experiment", experiment)
        assert not isinstance(experiment, Experiment)
        if stated:
            raise ValueError(f"a sweep file has {listing(stated)} itself; leave them out")
        within = tuple(Path(os.path.abspath(folder)) for folder in folders)
        loaded = load_sweep(experiment, folders=within)
        into = Path(experiment).with_suffix(".sqlite") if store is None else Path(store)
        return computed(loaded, into, *ways)
    ensure_type(Mapping, "a mapping of paths to values", axes=axes)
    chosen = experiment_of(experiment)
    with TemporaryDirectory() as folder:
        file = sweep_of(chosen, axes, stated, Path(folder))
        try:
            loaded = load_sweep(file, trust=chosen.trust)
        except ExperimentError as error:
            # Nobody has seen the file.
            texts = (f"{message.path}: {message.text}" for message in error.messages)
            raise refused(chosen.source, "; ".join(texts)) from None
        into = file.with_suffix(".sqlite") if store is None else Path(store)
        found = computed(loaded, into, *ways)
    return replace(found, label=chosen.label, store=None if store is None else into)


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
