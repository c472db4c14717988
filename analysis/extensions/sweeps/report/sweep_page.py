"""The page of a sweep in a store, for the function and for results of sweeps."""

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
    """Return a sweep of a store as HTML, compared with the newest sweep of another store if given.

    :raises ValueError: the two sweeps cannot be compared.
    """
    with closing(open_store(store)) as opened:
        results, comparison = read_results(opened, sweep), None
        if compare is not None:
            with closing(open_store(compare)) as reference:
                comparison = compared(results, read_results(reference, None), compare.name)
        return page(opened, results, run_modules, report, comparison)
