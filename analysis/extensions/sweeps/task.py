"""The task of a worker for one cell of a sweep: rank, U1 to U6, replicates."""

from __future__ import annotations

import hashlib
import time
import traceback
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.montecarlo import (
    Accumulator,
    MonteCarloEstimate,
    MonteCarloOutcome,
    Trials,
    block_of_trials,
    combined,
    trials,
)
from ballplate.results import Prediction, predict
from ballplate.simulator.computing import single_threaded, versions, want_of_memory
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ExperimentError, UnusableError

from .fingerprint import fingerprint, with_method, without_method
from .load import experiment_of
from .model import Sweep
from .store_columns import symbol_column, unit_suffix

# Replicates of a block, a multiple of a batch's; a cell with no more is computed at one go.
BLOCK = 8192


# What helps a cell that found no memory.
WITH_MEMORY = "with fewer --workers there is more for each, and --retry-failed tries it again"

# Block of a task that is to tell the cell's key only.
KEY_ONLY = -1


@dataclass(frozen=True)
class CellTask:
    """Work on cell `number`: replicate block `block`, counted from 1, or, with 0, everything that
    is left, or the cell's key alone.

    `total` are the sums over all blocks, where the replicates are in several.
    """

    number: int
    block: int = 0
    total: Accumulator | None = None


@dataclass(frozen=True)
class CellResult:
    """Result of a task. `figures` by name, in SI units with the unit in the name; `details` are
    texts.

    `key` is the number of the method and the fingerprint of the cell, or a hash of its choices
    where these make no valid experiment. A failed row has its `reason`. `seconds` is the time that
    it took, `tally` the sums of a replicate block.
    """

    number: int
    block: int
    key: str
    status: str
    reason: str = ""
    seed: int = 0
    figures: dict[str, float] = field(default_factory=dict)
    details: dict[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    tally: Accumulator | None = None
    versions: tuple[tuple[str, str], ...] = ()


def blocks_of(sweep: Sweep) -> int:
    """Number of replicate blocks that are tasks of their own; none where one task does all."""
    return -(-sweep.trials // BLOCK) if sweep.trials is not None and sweep.trials > BLOCK else 0


@single_threaded
def compute(sweep: Sweep, task: CellTask) -> CellResult:
    """Do a task; whatever goes wrong with the cell is told by its row."""
    start = time.perf_counter()
    row = _computed(sweep, task)
    return replace(row, seconds=time.perf_counter() - start, versions=versions())


def _computed(sweep: Sweep, task: CellTask) -> CellResult:
    number, block = task.number, task.block
    try:
        experiment = experiment_of(sweep, number)
    except (ExperimentError, MemoryError) as error:
        return CellResult(number, block, invalid_key(sweep, number), "failed", _reason(error))
    key = key_of(sweep, experiment)
    seed = seed_of(sweep, key)
    if block == KEY_ONLY:
        return CellResult(number, block, key, "done")
    try:
        if block:
            tally = block_of_trials(experiment, sweep.trials or 0, seed, block - 1, BLOCK)
            return CellResult(number, block, key, "done", seed=seed, tally=tally)
        return _whole(sweep, experiment, task, key, seed)
    except Exception as error:
        # Of an error model written in Python anything may come; the other cells do not suffer from
        # it.
        return CellResult(number, block, key, "failed", _reason(error), seed)


def _reason(error: Exception) -> str:
    """What went wrong, in one line."""
    if isinstance(error, ExperimentError):
        return "; ".join(map(str, error.messages))
    if isinstance(error, UnusableError):
        return str(error)
    want = want_of_memory(error)
    if want is not None:
        return f"it {want}; {WITH_MEMORY}"
    place = traceback.extract_tb(error.__traceback__)[-1]
    text = "; ".join(str(error).splitlines())
    return f"{type(error).__name__}: {text} ({Path(place.filename).name}, line {place.lineno})"


def _whole(sweep: Sweep, experiment: Experiment, task: CellTask, key: str, seed: int) -> CellResult:
    planned = predict(experiment)
    figures, details = plan_figures(planned, sweep.record)
    if sweep.trials is not None:
        if task.total is not None:
            found = Trials(seed, combined(experiment, task.total))
        else:
            found = trials(experiment, sweep.trials, seed)
        if found.outcome is None:
            details["monte_carlo"] = found.reason
        else:
            figures |= trial_figures(found.outcome, sweep.record)
            if found.outcome.reason:
                details["monte_carlo"] = found.outcome.reason
            details["not_converged"] = list(found.outcome.failed)
            details["flags"] = {
                name: list(one.flags)
                for name, one in found.outcome.comparisons.items()
                if one.flags
            }
    return CellResult(task.number, 0, key, "done", "", seed, figures, details)


def lost(sweep: Sweep, task: CellTask) -> CellResult:
    """The row of a task whose process ends whenever it is tried."""
    reason = "the process that computed it was ended, by lack of memory perhaps"
    # Without the experiment, which may be what ends the process.
    return CellResult(
        task.number,
        task.block,
        invalid_key(sweep, task.number),
        "failed",
        reason,
        versions=versions(),
    )


def key_of(sweep: Sweep, experiment: Experiment) -> str:
    """Key of a cell: of its experiment, what is recorded, and the data sets if there are any."""
    trials = None if sweep.trials is None else (sweep.trials, sweep.seed)
    return with_method(fingerprint(experiment, trials, sorted(set(sweep.record)), sweep.code))


def invalid_key(sweep: Sweep, number: int) -> str:
    """Key of a cell that makes no valid experiment: of its choices, and of the files."""
    text = f"{sweep.label(number)}\n{sweep.digest}"
    digest = hashlib.blake2b(text.encode("utf-8", "surrogatepass"), digest_size=16).hexdigest()
    return with_method(f"invalid {digest}")


def seed_of(sweep: Sweep, key: str) -> int:
    """Seed of a cell's data sets: of the sweep's seed and of what is computed, not of its place,
    nor of the method.
    """
    text = f"{sweep.seed} {without_method(key)}"
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=6).digest(), "big")


def plan_figures(
    planned: Prediction, record: tuple[str, ...]
) -> tuple[dict[str, float], dict[str, Any]]:
    """Figures and texts of a plan."""
    judged = planned.verdict
    counted = judged.singular_values[: len(judged.singular_values) - judged.deficiency]
    figures = {
        "parameters": float(judged.parameters),
        "observations": float(judged.observations),
        "rank_deficiency": float(judged.deficiency),
        "as_expected": float(judged.as_expected),
        "weakly_determined": float(len(judged.weak)),
        "smallest_singular_value_per_um": float(counted[-1]) if len(counted) else np.nan,
        "gap": float(judged.gap),
    }
    for symbol, one in planned.quantities.items():
        if symbol.partition(" ")[0] not in record:
            continue
        name, unit = symbol_column(symbol), unit_suffix(one.unit)
        figures[f"{name}_maximum_{unit}"] = one.maximum
        figures[f"{name}_average_{unit}"] = one.average
        figures[f"{name}_undetermined"] = float(one.undetermined)
        figures[f"{name}_count"] = float(one.count)
        if one.within_target is not None:
            figures[f"{name}_within_target"] = one.within_target
    details = {
        "undetermined": [str(direction) for direction in judged.null],
        "weak": [str(direction) for direction in judged.weak],
        "largest_at": {
            symbol: one.largest for symbol, one in planned.quantities.items() if one.largest
        },
    }
    return figures, details


def trial_figures(outcome: MonteCarloOutcome, record: tuple[str, ...]) -> dict[str, float]:
    """Figures of replicates."""
    figures = {"trials": float(outcome.trials), "not_converged": float(len(outcome.failed))}

    def add(name: str, figure: MonteCarloEstimate) -> None:
        figures[name] = figure.value
        figures[f"{name}_standard_error"] = figure.error

    for symbol, one in outcome.comparisons.items():
        if symbol.rstrip("'").partition(" ")[0] not in record:
            continue
        name, unit = symbol_column(symbol), unit_suffix(one.unit)
        figures[f"{name}_actual_maximum_{unit}"] = one.actual_maximum
        figures[f"{name}_actual_average_{unit}"] = one.actual_average
        add(f"{name}_spread_ratio", one.spread)
        add(f"{name}_actual_ratio", one.actual)
        add(f"{name}_bias_ratio", one.bias)
        add(f"{name}_coverage_sigma_given", one.known)
        add(f"{name}_coverage_sigma_estimated", one.estimated)
    if outcome.comparisons:
        add("sum_of_squares", outcome.misfit.mean)
    figures["degrees_of_freedom"] = float(outcome.misfit.degrees_of_freedom)
    return figures
