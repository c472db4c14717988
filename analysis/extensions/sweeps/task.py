"""The task of a worker for one cell of a sweep: rank, U1 to U6, replicates."""

from __future__ import annotations

import hashlib
import time
import traceback
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.extensions.planning import Request, Spent, campaign, spent_as_drawn
from ballplate.montecarlo import (
    Accumulator,
    MonteCarloEstimate,
    MonteCarloOutcome,
    Trials,
    block_of_trials,
    combined,
    trials,
)
from ballplate.results import Prediction, Qualification, predict, qualifications_of
from ballplate.simulator.computing import single_threaded, versions, want_of_memory
from ballplate.simulator.experiment import Experiment, unspanned
from ballplate.simulator.inputs import ExperimentError, UnusableError
from ballplate.uncertainty import exact_offsets

from .fingerprint import fingerprint
from .load import base_tree, experiment_of
from .model import Sweep
from .planned import choice_figures, cost_figures, drawing, request_of
from .store_columns import symbol_column, unit_suffix

# Replicates of a block, a multiple of a batch's; a cell with more is computed in several blocks.
BLOCK = 8192


WITH_MEMORY = "use fewer --workers, and --retry-failed to compute it again"

# Blocks of tasks that compute only the cell's key, or what its figures take for granted with the
# effects of assumptions, which take longer than the figures.
KEY_ONLY, GIVEN_ONLY = -1, -2

# What a case costs, or what chooses its positions, on which its cost depends.
Cost = Spent | Request


@dataclass(frozen=True)
class CellTask:
    """Work on cell `number`: replicate block `block`, counted from 1; 0 for the rest, KEY_ONLY or
    GIVEN_ONLY.

    `total` has the sums over all blocks if there are several.
    """

    number: int
    block: int = 0
    total: Accumulator | None = None


@dataclass(frozen=True)
class CellResult:
    """Result of a task. `figures` by name, in SI units with the unit in the name; `details` are
    texts.

    `key` is the fingerprint of the cell, or a hash of its choices if they make no valid experiment.
    A failed row has a `reason`. `seconds` is the computing time, `tally` the sums of a replicate
    block.
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
    """Return the number of replicate blocks with tasks of their own; 0 if one task computes all, as
    where each would choose its positions anew.
    """
    if sweep.trials is None or sweep.trials <= BLOCK:
        return 0
    if sweep.planning is not None or any(axis.choices[0].estimator for axis in sweep.axes):
        return 0
    return -(-sweep.trials // BLOCK)


@single_threaded
def compute(sweep: Sweep, task: CellTask) -> CellResult:
    """Compute a task; its row states any failure of the cell."""
    start = time.perf_counter()
    row = _computed(sweep, task)
    return replace(row, seconds=time.perf_counter() - start, versions=versions())


def _computed(sweep: Sweep, task: CellTask) -> CellResult:
    number, block = task.number, task.block
    try:
        experiment = experiment_of(sweep, number)
    except (ExperimentError, MemoryError) as error:
        return CellResult(number, block, invalid_key(sweep, number), "failed", _reason(error))
    request = request_of(sweep, number)
    cost = request or spent_as_drawn(experiment)
    key = key_of(sweep, experiment, cost, sweep.estimators(number))
    seed = seed_of(sweep, key)
    if block == KEY_ONLY:
        return CellResult(number, block, key, "done")
    try:
        if block == GIVEN_ONLY:
            given = _given(predict(experiment).qualifications)
            return CellResult(number, block, key, "done", details={"given": given})
        if block:
            tally = block_of_trials(experiment, sweep.trials or 0, seed, block - 1, BLOCK)
            return CellResult(number, block, key, "done", seed=seed, tally=tally)
        return _whole(sweep, experiment, cost, task, key, seed)
    except Exception as error:
        # An error model in Python may raise anything; the other cells go ahead.
        return CellResult(number, block, key, "failed", _reason(error), seed)


def _reason(error: Exception) -> str:
    """Return the cause of a failure in one line."""
    if isinstance(error, ExperimentError):
        return "; ".join(map(str, error.messages))
    if isinstance(error, UnusableError):
        return str(error)
    want = want_of_memory(error)
    if want is not None:
        return f"it {want}; {WITH_MEMORY}"
    last_call = traceback.extract_tb(error.__traceback__)[-1]
    text = "; ".join(str(error).splitlines())
    return (
        f"{type(error).__name__}: {text} ({Path(last_call.filename).name}, line {last_call.lineno})"
    )


def _whole(
    sweep: Sweep, experiment: Experiment, cost: Cost, task: CellTask, key: str, seed: int
) -> CellResult:
    details: dict[str, Any] = {}
    if isinstance(cost, Request):
        choice = campaign(experiment, cost)
        experiment, planned = choice.chosen_experiment, choice.prediction
        figures = choice_figures(choice)
        given = [each.given for each in choice.qualifications]
        details |= {"chosen": [candidate.name for candidate in choice.chosen], "assessed": True}
        names = {short: name for name, short in choice.sheet.names.items()}
    else:
        planned, figures, names = predict(experiment), cost_figures(cost), {}
        deficiency = planned.verdict.deficiency
        given = _given(qualifications_of(deficiency, None, None, experiment))
        # Whether the scale rests on them takes longer than the figures.
        given += ["exact probe offsets"] * bool(exact_offsets(experiment))
        if lost := unspanned(base_tree(sweep, task.number), experiment):
            details["unspanned"] = lost
    estimators = sweep.estimators(task.number)
    # U1 to U6 are those of the full estimator.
    figures |= plan_figures(planned, () if estimators[:1] not in ((), ("full",)) else sweep.record)
    details |= {"given": list(dict.fromkeys(given)), "drawing": drawing(experiment, names)}
    if estimators:
        seed = sweep.seed
        figures |= distance_errors(sweep, experiment, *estimators)
    elif sweep.trials is not None:
        if task.total is not None:
            replicates = Trials(seed, combined(experiment, task.total))
        else:
            replicates = trials(experiment, sweep.trials, seed)
        outcome = replicates.outcome
        if outcome is None or outcome.reason:
            details["monte_carlo"] = replicates.reason if outcome is None else outcome.reason
        if outcome is not None:
            figures |= trial_figures(outcome, sweep.record)
            details["flags"] = {
                symbol: list(comparison.flags)
                for symbol, comparison in outcome.comparisons.items()
                if comparison.flags
            }
    return CellResult(task.number, 0, key, "done", "", seed, figures, details)


def _given(qualifications: Iterable[Qualification]) -> list[str]:
    """Return the conditions of a cell's figures, the assumptions in one of them."""
    found = list(qualifications)
    given = [each.given for each in found if each.kind != "assumption"]
    # Too slow for each cell.
    assumed = [each.given for each in found if each.kind == "assumption"]
    return given + [f"{' and '.join(assumed)} (assessed for the first cases only)"] * bool(assumed)


def lost(sweep: Sweep, task: CellTask) -> CellResult:
    """Return the row of a task whose process dies at every attempt."""
    reason = "the process that computed it was ended, by lack of memory perhaps"
    # Making the experiment for a proper key might kill this process, too.
    return CellResult(
        task.number,
        task.block,
        invalid_key(sweep, task.number),
        "failed",
        reason,
        versions=versions(),
    )


def key_of(sweep: Sweep, experiment: Experiment, cost: Cost, estimators: tuple[str, ...]) -> str:
    """Return the key of a cell: of its experiment, its cost or the request for its plan, the
    recorded quantities, and any data sets with the estimators that are compared.
    """
    trials = None if sweep.trials is None else (sweep.trials, sweep.seed)
    return fingerprint(experiment, cost, trials, estimators, sorted(set(sweep.record)), sweep.code)


def invalid_key(sweep: Sweep, number: int) -> str:
    """Return the key of a cell without a valid experiment: of its choices and of all files."""
    text = f"{sweep.label(number)}\n{sweep.digest}"
    return f"invalid {hashlib.sha256(text.encode('utf-8', 'surrogatepass')).hexdigest()}"


def seed_of(sweep: Sweep, key: str) -> int:
    """Return the seed of a cell's data sets: of the sweep's seed and of the cell's computation."""
    # So a cell has the same data sets in any sweep.
    text = f"{sweep.seed} {key}"
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=6).digest(), "big")


def plan_figures(planned: Prediction, record: tuple[str, ...]) -> dict[str, float]:
    """Return the values of a plan."""
    verdict = planned.verdict
    determined = verdict.singular_values[: len(verdict.singular_values) - verdict.deficiency]
    figures = {
        "parameters": float(verdict.parameters),
        "observations": float(verdict.observations),
        "rank_deficiency": float(verdict.deficiency),
        "as_expected": float(verdict.as_expected),
        "weakly_determined": float(len(verdict.weak)),
        "smallest_singular_value_per_um": float(determined[-1]) if len(determined) else np.nan,
        "gap": float(verdict.gap),
    }
    for symbol, quantity in planned.quantities.items():
        if symbol.partition(" ")[0] not in record:
            continue
        name, unit = symbol_column(symbol), unit_suffix(quantity.unit)
        figures[f"{name}_maximum_{unit}"] = quantity.maximum
        figures[f"{name}_average_{unit}"] = quantity.average
        figures[f"{name}_undetermined"] = float(quantity.undetermined)
        figures[f"{name}_count"] = float(quantity.count)
        if quantity.within_target is not None:
            figures[f"{name}_within_target"] = quantity.within_target
        shares = [one.share_of_target for one in quantity.named if one.target is not None]
        if shares:
            figures[f"{name}_largest_share_of_target"] = max(shares)
    return figures


def distance_errors(
    sweep: Sweep, experiment: Experiment, estimator: str, *compared: Any
) -> dict[str, float]:
    """Return errors of distances that an estimator corrects, over the data sets of a sweep on which
    it and the full one, or the first of `compared` that the design allows, converge; none if
    distances are undetermined.

    :raises ExperimentError: the design allows none.
    """
    from ballplate.extensions.estimators import compare_estimators

    first, *others = compared
    try:
        found = compare_estimators(experiment, sweep.trials or 2, first, seed=sweep.seed)
    except ExperimentError:
        if not others:
            raise
        return distance_errors(sweep, experiment, estimator, *others)
    figures = {"trials": float(found.trials), "not_converged": float(len(found.failed))}
    if errors := found.of_truth.get(estimator):
        figures |= {"distance_error_rms_m": errors.rms, "distance_error_bias_m": errors.bias}
        figures["distance_error_rms_m_standard_error"] = errors.rms_error
    return figures


def trial_figures(outcome: MonteCarloOutcome, record: tuple[str, ...]) -> dict[str, float]:
    """Return the values of replicates."""
    figures = {"trials": float(outcome.trials), "not_converged": float(len(outcome.failed))}

    def add(name: str, figure: MonteCarloEstimate) -> None:
        figures[name] = figure.value
        figures[f"{name}_standard_error"] = figure.error

    for symbol, comparison in outcome.comparisons.items():
        if symbol.rstrip("'").partition(" ")[0] not in record:
            continue
        name, unit = symbol_column(symbol), unit_suffix(comparison.unit)
        figures[f"{name}_actual_maximum_{unit}"] = comparison.actual_maximum
        figures[f"{name}_actual_average_{unit}"] = comparison.actual_average
        add(f"{name}_spread_ratio", comparison.spread)
        add(f"{name}_actual_ratio", comparison.actual)
        add(f"{name}_bias_ratio", comparison.bias)
        add(f"{name}_coverage_sigma_given", comparison.known)
        add(f"{name}_coverage_sigma_estimated", comparison.estimated)
    if outcome.comparisons:
        add("sum_of_squares", outcome.misfit.mean)
    figures["degrees_of_freedom"] = float(outcome.misfit.degrees_of_freedom)
    return figures
