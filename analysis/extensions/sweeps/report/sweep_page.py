"""The page of a sweep in a store, as the command and results of sweeps ask for it."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

from ballplate.simulator.computing import Report

from ..store import open_store
from .page import page
from .results import read_results
from .store_comparison import compared


def sweep_page(
    store: Path, sweep: int | None, run_modules: bool, compare: Path | None, report: Report
) -> str:
    """A sweep of a store as HTML, with the newest sweep of a store to `compare` with beside it.

    :raises ImportError: what pages need is not installed.
    :raises ValueError: the two sweeps cannot be compared.
    """
    with closing(open_store(store)) as opened:
        results, beside = read_results(opened, sweep), None
        if compare is not None:
            with closing(open_store(compare)) as other:
                beside = compared(results, read_results(other, None), compare.name)
        return page(opened, results, run_modules, report, beside)
