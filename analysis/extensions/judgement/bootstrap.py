"""Data sets of a fit's own parameters, each fitted again: what linear theory says, tried out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.presentation import Data, MainTable, Result, picked, table_lines
from ballplate.results import EstimatedFunctions, Function, estimated_functions
from ballplate.simulator.computing import (
    ProgressStep,
    Report,
    in_processes,
    single_threaded,
    unreported,
)
from ballplate.simulator.design import Design, State, reading_noise
from ballplate.simulator.estimation import Status, estimate, linearised_fit
from ballplate.simulator.machines import Array
from ballplate.simulator.readings import NoReadingError, true_readings

# Data sets of a task: the progress is told after each.
AT_ONCE = 16

# Share of data sets within the intervals.
COVERED = 0.95

# Standard errors from which on a standard deviation differs from its linear one.
DIFFERS = 4.0

# Relative deviation that has to show for data sets to be enough.
TOO_FEW = 0.5

# Share of the largest uncertainty in its unit below which one is rounding.
EXACT = 1e-6

# Numbers of data sets that are named where they did not converge.
MOST_NAMED = 20


@dataclass(frozen=True)
class Replicate:
    """Estimates (m,) from one data set, NaN if undetermined or not converged, and its sigma."""

    status: Status
    values: Array
    sigma: float


@dataclass(frozen=True, repr=False)
class Bootstrap(Result):
    """A fit's estimates over data sets of its own parameters.

    `values` and `uncertainties` (m,) are those of the fit, the latter by linear theory;
    `deviations` (t, m) are the results of converged data sets less their true parameters, and
    `sigmas` (t,) their own sigmas over the fit's. `failed` has the numbers of the others with
    their status.
    """

    label: str
    title: str
    trials: int
    seed: int
    failed: tuple[tuple[int, str], ...]
    functions: tuple[Function, ...]
    values: Array
    uncertainties: Array
    deviations: Array
    sigmas: Array
    sigma_is_estimated: bool

    @property
    def standard_deviations(self) -> Array:
        """Of each estimate (m,) over the data sets; NaN with less than two."""
        if len(self.deviations) < 2:
            return np.full(len(self.values), np.nan)
        return self.deviations.std(axis=0, ddof=1)

    @property
    def biases(self) -> Array:
        """Mean deviations (m,) of the estimates."""
        if not len(self.deviations):
            return np.full(len(self.values), np.nan)
        return self.deviations.mean(axis=0)

    @property
    def intervals(self) -> Array:
        """Of 95 % for each parameter (m, 2): of estimates over their own sigma where the fit's is
        estimated.
        """
        if len(self.deviations) < 2:
            return np.full((len(self.values), 2), np.nan)
        scaled = self.deviations / (self.sigmas[:, None] if self.sigma_is_estimated else 1.0)
        tail = 0.5 * (1.0 - COVERED)
        low, high = np.quantile(scaled, (tail, 1.0 - tail), axis=0)
        return np.stack([self.values - high, self.values - low], axis=1)

    @property
    def ratio_error(self) -> float:
        """Standard error of a ratio of standard deviations."""
        return 1.0 / float(np.sqrt(2.0 * max(len(self.deviations) - 1, 1)))

    def _ratios(self) -> Array:
        """Standard deviations (m,) over the linear ones; NaN if these are rounding."""
        units = np.array([function.unit for function in self.functions])
        u = np.nan_to_num(self.uncertainties)
        largest = np.array([u[units == unit].max() for unit in units])
        return self.standard_deviations / np.where(u > EXACT * largest, u, np.nan)

    @property
    def differing(self) -> tuple[str, ...]:
        """Names of estimates whose standard deviation is not what linear theory says."""
        off = np.abs(self._ratios() - 1.0) > DIFFERS * self.ratio_error
        return tuple(self.functions[k].name for k in np.flatnonzero(off))

    def headline(self) -> str:
        failed = f", {len(self.failed)} not converged" if self.failed else ""
        finite_ratios = self._ratios()[np.isfinite(self._ratios())]
        if not len(finite_ratios):
            return f"{self.trials} data sets{failed}"
        return (
            f"{self.trials} data sets{failed}, standard deviations {finite_ratios.min():.3g} to"
            f" {finite_ratios.max():.3g} times the linear ones"
        )

    def lines(self) -> list[str]:
        lines = [
            (
                f"data sets of the fitted parameters: {self.trials}, seed {self.seed}; each fitted"
                " as the readings were"
            )
        ]
        if self.failed:
            named = ", ".join(f"{k} ({words})" for k, words in self.failed[:MOST_NAMED])
            named += ", …" if len(self.failed) > MOST_NAMED else ""
            lines.append(
                f"{len(self.failed)} did not converge and are left out of all results: {named}"
            )
        if len(self.deviations) < 2:
            return [*lines, "too few converged for a result"]
        shown = [
            row
            for row in self.rows()
            if row["kind"] not in ("origin", "ball") and np.isfinite(row["standard uncertainty"])
        ]
        lines += table_lines(COLUMNS, shown)
        open_ = int(np.isnan(self.uncertainties).sum())
        if open_:
            lines.append(f"{open_} estimates are undetermined, and are left out")
        if DIFFERS * self.ratio_error > TOO_FEW:
            return [*lines, "too few data sets for standard deviations; use 100 or more"]
        differing = self.differing
        comparison = f"within {100 * DIFFERS * self.ratio_error:.2g} % of the linear ones"
        if not differing:
            return [*lines, f"all standard deviations are {comparison}"]
        names = ", ".join(differing[:5]) + (", …" if len(differing) > 5 else "")
        count = len(differing)
        return [*lines, f"{count} standard deviations are not {comparison}: {names}"]

    def data(self) -> Data:
        return {
            **picked(self, "trials", "seed"),
            "not_converged": {str(k): words for k, words in self.failed},
            "differing": self.differing,
            "estimates": self.rows(),
        }

    def columns(self) -> MainTable:
        """Columns with one row per estimate; undetermined ones are NaN."""
        columns = {
            "parameter": "name",
            "kind": "kind",
            "value": self.values,
            "standard uncertainty": self.uncertainties,
            "standard deviation": self.standard_deviations,
            "bias": self.biases,
            "95 % from": self.intervals[:, 0],
            "95 % to": self.intervals[:, 1],
            "unit": "unit",
        }
        return columns, self.functions


U = "standard uncertainty"
COLUMNS = {
    "parameter": "parameter",
    "value": ("value", U),
    "u": (U, 3),
    "standard deviation": ("standard deviation", 3),
    "bias": ("bias", U),
    "95 %": ("95 % from", U),
    "": ("95 % to", U),
    "unit": "unit",
}


@single_threaded
def replicated(
    design: Design, truth: State, sigma: float, monomials: bool, seed: int, trial: int
) -> Replicate:
    """Return estimates from one data set of `truth`, whose stated uncertainties `sigma`
    multiplies; a function of seed and number alone.
    """
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(trial,)))
    readings = design.readings
    x = true_readings(design, truth, readings)
    noise = design.noise.draw(generator, x.shape, readings.position, 0)
    x = x + sigma * noise * reading_noise(design, readings)
    drawn = [
        observation.given(
            value=observation.true_values(design, truth, design.model)
            + sigma * observation.errors(generator, 1)[0]
        )
        for observation in design.observations
    ]
    drawn_design = design.observed(*drawn)
    solution = estimate(drawn_design, x)
    if solution.status != "converged":
        return Replicate(solution.status, np.zeros(0), float("nan"))
    linearisation = linearised_fit(drawn_design, solution)
    freedom = linearisation.degrees_of_freedom
    variance = solution.factor.sum_of_squares / max(freedom, 1)
    return Replicate(
        "converged", estimated_functions(linearisation, monomials).values, float(np.sqrt(variance))
    )


def _task(
    design: Design, truth: State, sigma: float, monomials: bool, seed: int, first: int, last: int
) -> list[Replicate]:
    return [
        replicated(design, truth, sigma, monomials, seed, trial) for trial in range(first, last)
    ]


def bootstrap(
    label: str,
    title: str,
    functions: EstimatedFunctions,
    sigma: float,
    sigma_is_estimated: bool,
    trials: int,
    seed: int,
    workers: int = 1,
    report: Report = unreported,
) -> Bootstrap:
    """Fit data sets of a fit's own parameters, of which it estimated `functions`.

    Lengths of standards without certificates are nominal. The result of a data set depends neither
    on `workers` nor on the number of trials.

    :raises ValueError: the errors are too large to generate readings.
    """
    linearisation = functions.at
    design = linearisation.design
    names = [function.name for function in functions.functions if function.kind == "machine"]
    monomials = names != [parameter.name for parameter in design.model.parameters]
    truth = replace(linearisation.state, lengths=design.unknown_lengths.drawn)
    true = functions.values.copy()
    of_lengths = [k for k, item in enumerate(functions.functions) if item.kind == "length"]
    true[of_lengths] = design.unknown_lengths.drawn
    tasks = (
        (design, truth, sigma, monomials, seed, first, min(first + AT_ONCE, trials))
        for first in range(0, trials, AT_ONCE)
    )
    replicates = []
    try:
        for some in in_processes(_task, tasks, workers):
            replicates += some
            report(ProgressStep(f"data sets of {label}", len(replicates), trials))
    except NoReadingError as error:
        raise ValueError(str(error)) from None
    converged = [replicate for replicate in replicates if replicate.status == "converged"]
    uncertainties = sigma * functions.uncertainties()
    is_open = np.isnan(uncertainties)
    values = np.array([replicate.values for replicate in converged]).reshape(
        len(converged), len(true)
    )
    return Bootstrap(
        label,
        title,
        trials,
        seed,
        tuple((k, item.status) for k, item in enumerate(replicates) if item.status != "converged"),
        functions.functions,
        np.where(is_open, np.nan, functions.values),
        uncertainties,
        np.where(is_open, np.nan, values - true),
        np.array([replicate.sigma for replicate in converged]) / sigma
        if sigma > 0.0
        else np.ones(len(converged)),
        sigma_is_estimated,
    )
