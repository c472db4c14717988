"""Estimate of a sweep's duration from some of its cells."""

from __future__ import annotations

from dataclasses import replace

from .model import Sweep
from .task import CellResult, CellTask, compute

# Data sets that are timed, from which the time of the others is extrapolated.
SOME = 256


def seconds_of(sweep: Sweep) -> tuple[float, list[CellResult]]:
    """Return seconds of all cells in one process, and the rows of the first, middle and last."""
    last = len(sweep.cells) - 1
    numbers = sorted({0, last // 2, last})
    total, rows = 0.0, []
    for number in numbers:
        row = compute(replace(sweep, trials=None), CellTask(number))
        alone = row.seconds
        total += alone
        if sweep.trials is not None and row.status == "done":
            some = min(sweep.trials, SOME)
            row = compute(replace(sweep, trials=some), CellTask(number))
            total += max(row.seconds - alone, 0.0) * sweep.trials / some
        rows.append(row)
    return total / len(numbers) * len(sweep.cells), rows
