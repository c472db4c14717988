"""How long a sweep will take, judged by some of its cells."""

from __future__ import annotations

from dataclasses import replace

from .model import Sweep
from .task import Task, compute

# Data sets by which the others are judged.
SOME = 256


def seconds_of(sweep: Sweep) -> tuple[float, int]:
    """Seconds that all cells take in one process, and the number of cells that were tried: first, middle and last."""
    last = len(sweep.cells) - 1
    numbers = sorted({0, last // 2, last})
    total = 0.0
    for number in numbers:
        alone = compute(replace(sweep, trials=None), Task(number)).seconds
        total += alone
        if sweep.trials is not None:
            some = min(sweep.trials, SOME)
            together = compute(replace(sweep, trials=some), Task(number)).seconds
            total += max(together - alone, 0.0) * sweep.trials / some
    return total / len(numbers) * len(sweep.cells), len(numbers)
