"""Alternative estimators of NPL Report CISE 15/98, section 3.4: a fit, and a comparison as in
section 6.2.7.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from ballplate.presentation import (
    Data,
    FitResult,
    MainTable,
    Result,
    by_name,
    given,
    picked,
    table_lines,
)
from ballplate.results import ESTIMATE_COLUMNS, ParameterEstimate, iteration_lines
from ballplate.simulator.computing import ProgressStep, Report, unreported
from ballplate.simulator.design import Design, Lengths, State
from ballplate.simulator.estimation import GaussNewtonSettings, as_drawn, estimate, linearise
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.simulator.geometry import pairs
from ballplate.simulator.inputs import refused
from ballplate.simulator.machines import Array, Integers
from ballplate.simulator.readings import (
    NoReadingError,
    ObservedReadings,
    noisy_certificate,
    noisy_readings,
    observe,
    on_stated_machine,
    too_large,
)
from ballplate.uncertainty import uncertainties

from .alternative_estimators import AlternativeName, AlternativeSolution, alternative_estimate
from .length_equations import LengthEstimator, NotAMetricError, length_estimate
from .length_fits import has_all_errors
from .reversal_fits import reversal_beside_full
from .truth_errors import TruthErrors, truth_errors

QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)

# Limit of derivatives (terms times parameters), some 70 bytes each, more for few parameters.
MOST_DERIVATIVES = 15_000_000

# Pairs of points of a comparison, and pairs followed through all data sets.
MOST_POINTS = 100_000
MOST_SAME_PAIRS = 200

# Differences of a tenth of a micrometre are compared: the last iteration leaves a millionth of it.
COMPARISON_TOLERANCE = GaussNewtonSettings(smallest_step=1e-8)


ComparedEstimator = AlternativeName | LengthEstimator | Literal["reversal"]


@dataclass(frozen=True, repr=False)
class AlternativeFit(FitResult):
    """Estimates of the machine's parameters by an alternative estimator from `pairs` pairs of
    balls, without uncertainties.
    """

    label: str
    title: str
    observed: ObservedReadings
    solution: AlternativeSolution
    pairs: int
    estimates: tuple[ParameterEstimate, ...]

    @property
    def lengths(self) -> int:
        """Number of lengths of standards used."""
        return len(self.observed.design.of(Lengths))

    @property
    def converged(self) -> bool:
        return self.solution.status == "converged"

    @property
    def complaint(self) -> str:
        if not self.converged:
            return f"the estimate has {self.solution.status}; see the record of iterations"
        count = self.solution.deficiency
        return f"rank deficiency {count}: undetermined parameters are left out" if count else ""

    def headline(self) -> str:
        count = self.solution.deficiency
        rank = f"rank deficiency {count}" if count else "full rank"
        return f"{self.solution.estimator}, {self.solution.status}, {rank}"

    def lines(self) -> list[str]:
        """The fit as lines of text: iterations and the machine's parameters."""
        record = self.solution.iterations
        rank = (
            f"rank deficiency {self.solution.deficiency}"
            if self.solution.deficiency
            else "full rank"
        )
        data = _used(self.pairs, self.lengths)
        lines = [
            self.heading,
            (
                f"estimator {self.solution.estimator}: {data}, {self.solution.observations} terms;"
                f" {rank}"
            ),
            (
                f"{self.solution.status} after {len(record) - 1} iterations; S^2 ="
                f" {record[-1].sum_of_squares:.6g} (its terms are not independent, so that no sigma"
                " is estimated and no uncertainties are given here)"
            ),
            "",
        ]
        columns = {"parameter": "name", "value": ("value", 6), "unit": "unit"}
        return [*lines, *iteration_lines(record), "", *table_lines(columns, self.estimates)]

    def data(self) -> Data:
        """The fit as plain data in metres and radians; None if undetermined."""
        return {
            **self.named,
            **picked(self, "pairs", "lengths"),
            **picked(self.solution, "estimator", "observations", "status"),
            "rank_deficiency": self.solution.deficiency,
            "iterations": [
                picked(iteration, "step", "sum_of_squares")
                for iteration in self.solution.iterations
            ],
            "estimates": by_name(self.estimates, "value", "unit"),
            **self.notes_data(),
        }

    def columns(self) -> MainTable:
        """One row per parameter of the machine."""
        return ESTIMATE_COLUMNS, self.estimates


@dataclass(frozen=True, repr=False)
class EstimatorComparison(Result):
    """Differences of corrected distances between an alternative and the full estimator, over
    `trials` synthetic data sets.

    For each data set on which both converged: root mean square `rms` and largest absolute value
    `maximum` (m,), in metres, at `points` random pairs of points. `failed` lists the other data
    sets, from 0.
    `of_truth` has, by estimator, errors of distances between the same pairs of points in all data
    sets; it is empty if distances are undetermined.
    """

    label: str
    title: str
    estimator: ComparedEstimator
    trials: int
    pairs: int
    lengths: int
    across_probes: bool
    points: int
    rms: Array
    maximum: Array
    failed: tuple[int, ...]
    of_truth: Mapping[str, TruthErrors] = field(default_factory=dict)

    def headline(self) -> str:
        median = f"{1e6 * float(np.median(self.rms)):.3g} µm" if len(self.rms) else "unknown"
        failed = f", {len(self.failed)} not converged" if self.failed else ""
        return (
            f"{self.estimator}, {self.trials} data sets, median of the differences {median}{failed}"
        )

    def lines(self) -> list[str]:
        """The comparison as lines of text: quantiles."""
        across = ", across probes" if self.across_probes else ""
        used = f" ({_used(self.pairs, self.lengths)}{across})"
        used = "" if self.estimator == "reversal" else used
        lines = [
            self.heading,
            (
                f"estimator {self.estimator}{used} against the full one: corrected"
                f" distances of {self.points} random pairs of points in each of"
                f" {self.trials} data sets, differences in µm"
            ),
        ]
        if self.failed:
            lines.append(
                f"not converged: {len(self.failed)} data sets, numbers"
                f" {', '.join(map(str, self.failed[:20]))}"
            )
        if not len(self.rms):
            return lines
        quantiles = ["least", *(f"{100 * q:.0f} %" for q in QUANTILES[1:-1]), "largest"]
        values = np.quantile([self.rms, self.maximum], QUANTILES, axis=1)
        columns: dict[str, Any] = {"": ["root mean square", "largest"]}
        columns |= dict(zip(quantiles, 1e6 * values, strict=True))
        lines += table_lines(columns)
        if not self.of_truth:
            return lines
        columns = {
            "distances against the true machine's": list(self.of_truth),
            "bias, µm": ("bias", 3),
            "by chance, µm": ("chance", 3),
            "scatter, µm": ("scatter", 3),
            "rms, µm": ("rms", 3),
            "": lambda errors: "<- biased" if errors.is_biased else "",
        }
        return [*lines, "", *table_lines(columns, list(self.of_truth.values()))]

    def data(self) -> Data:
        """The comparison as plain data in metres."""
        data: Data = {
            **self.named,
            **picked(self, "estimator", "trials", "pairs", "lengths"),
            **picked(self, "across_probes", "points"),
            "not_converged": self.failed,
        }
        for key, values in (("rms", self.rms), ("maximum", self.maximum)):
            quantiles = np.quantile(values, QUANTILES) if len(values) else ()
            data[key] = {
                "quantiles": dict(zip(map(str, QUANTILES), quantiles, strict=False)),
                "values": values,
            }
        errors_data = {
            name: {**vars(errors), "unit": "m"} for name, errors in self.of_truth.items()
        }
        return data | given(against_truth=errors_data)

    def columns(self) -> MainTable:
        """One row per data set on which both estimators converged."""
        converged = [k for k in range(self.trials) if k not in self.failed]
        columns = {
            "data set": converged,
            "root mean square, µm": self.rms,
            "maximum, µm": self.maximum,
            "unit": ["m"] * len(converged),
        }
        return columns, ()


def ball_pairs(experiment: Experiment, name: str | None = None) -> Integers:
    """Return pairs (p, 2) of balls of all plates: of the named set, by default `braced` if
    defined.

    :raises ExperimentError: an artefact lacks the set.
    """
    pair_indices, first = [np.zeros((0, 2), np.int64)], 0
    for artefact, layout in experiment.layouts.items():
        if experiment.artefacts[artefact].role == "plate":
            chosen = name or ("braced" if "braced" in layout.pair_sets else "all")
            try:
                pair_indices.append(pairs(layout, chosen) + first)
            except ValueError as error:
                raise refused(experiment.source, str(error), f"artefacts.{artefact}") from None
        first += len(layout.names)
    return np.concatenate(pair_indices)


def count_terms(
    experiment: Experiment,
    design: Design,
    estimator: AlternativeName,
    name: str | None = None,
    across_probes: bool = False,
) -> int:
    """Return the number of terms of an alternative estimator, without certificates and priors, if
    every position has all balls.
    """
    count = 0
    artefact_of = design.balls.artefact[design.readings.ball]
    for k, (artefact, layout) in enumerate(experiment.layouts.items()):
        if experiment.artefacts[artefact].role != "plate":
            continue
        chosen = name or ("braced" if "braced" in layout.pair_sets else "all")
        balls = len(layout.names)
        pair_count = (
            balls * (balls - 1) // 2 if chosen == "all" else len(layout.pair_sets.get(chosen, ()))
        )
        of_artefact = artefact_of == k
        combinations = np.stack(
            [design.readings.position[of_artefact], design.readings.probe[of_artefact]], axis=1
        )
        probes = np.unique(np.unique(combinations, axis=0)[:, 0], return_counts=True)[1]
        times = int((probes**2 if across_probes else probes).sum())
        count += pair_count * (times * (times - 1) // 2 if estimator == "cresto" else times)
    return count


def _refuse_many_terms(
    experiment: Experiment,
    design: Design,
    estimator: AlternativeName,
    name: str | None,
    across_probes: bool,
) -> None:
    """Refuse estimates that exceed the memory, before pairs are made.

    :raises ExperimentError: too many terms.
    """
    count = count_terms(experiment, design, estimator, name, across_probes)
    most = MOST_DERIVATIVES // max(len(design.model.parameters), 1)
    if count > most:
        text = (
            f"{estimator} with these pairs of balls has {count} terms; at most {most} are possible"
            " with "
        )
        text += (
            f"{len(design.model.parameters)} parameters: take fewer --pairs, such as corners, or"
            " fewer balls"
        )
        raise refused(experiment.source, text, "artefacts")


def _refuse_unknown_places(experiment: Experiment, design: Design) -> None:
    """Refuse features that estimators of distances alone cannot use.

    :raises ExperimentError: a gauge, a length standard without a certificate, holes, a star, or
        correlated values.
    """
    if experiment.stars:
        text = "estimators of distances alone cannot follow where a star points; use the full one"
        raise refused(experiment.source, text, "stars")
    if design.positions.across is not None:
        text = "estimators of distances alone cannot use readings in plane; use the full one"
        raise refused(experiment.source, text, "artefacts")
    for k, item in enumerate(experiment.calibration):
        if item.root is not None:
            text = (
                "estimators of distances alone take certified distances as independent; use the"
                " full estimator for correlated values and functions of your own"
            )
            raise refused(experiment.source, text, f"calibration[{k}]")
    gauges, unknown = len(design.gauge_positions), design.unknown_lengths.names
    if gauges or unknown:
        feature = "a Bryan gauge's pivot" if gauges else f"an unknown length ({unknown[0]})"
        text = f"estimators of distances alone cannot follow {feature}"
        text += "; use --estimator length-equations"
        raise refused(experiment.source, text, "artefacts")


def _refuse_other_lengths(experiment: Experiment, design: Design) -> None:
    """Refuse designs for which length equations and the full estimator estimate different
    errors.

    :raises ExperimentError: no lengths, another error model than three scales and squareness, or
        undetermined errors.
    """
    key, text = "artefacts", ""
    if not len(design.of(Lengths)):
        text = "has no ball bar or Bryan gauge whose lengths are read; use another estimator"
    elif not has_all_errors(design):
        key, text = (
            "error_model",
            "length equations have the errors of {kind: metric}, in three dimensions, only",
        )
    elif as_drawn(design).deficiency:
        text = (
            "the design leaves errors undetermined, so that estimates hold different errors fixed;"
            " see ballplate check"
        )
    if text:
        raise refused(experiment.source, text, key)


def fit_alternative(
    experiment: Experiment,
    observed: ObservedReadings,
    estimator: AlternativeName,
    pair_set: str | None = None,
    across_probes: bool = False,
    monomials: bool = False,
) -> AlternativeFit:
    """Estimate machine errors from the distances of readings.

    Undetermined parameters are NaN; with `monomials` they are the coefficients of t, t^2, ...
    """
    design = observed.design
    _refuse_unknown_places(experiment, design)
    _refuse_many_terms(experiment, design, estimator, pair_set, across_probes)
    chosen = ball_pairs(experiment, pair_set)
    solution = alternative_estimate(design, observed.x, chosen, estimator, across_probes)
    parameters = design.model.parameters
    names, units = [p.name for p in parameters], [p.unit for p in parameters]
    matrix = np.eye(len(parameters))
    if monomials:
        reported = design.model.reported()
        names, units, matrix = list(reported.names), list(reported.units), reported.matrix
    effect = np.array([1.0 / p.effect for p in parameters])
    size = 1e-6 * np.sqrt(((matrix * effect) ** 2).sum(axis=1))
    open_ = np.sqrt(((matrix @ solution.null) ** 2).sum(axis=1)) > 1e-7 * size
    values = np.where(open_, np.nan, matrix @ solution.a)
    estimates = tuple(
        ParameterEstimate(name, float(value), np.nan, unit)
        for name, value, unit in zip(names, values, units, strict=True)
    )
    return AlternativeFit(
        experiment.label, experiment.title, observed, solution, len(chosen), estimates
    )


def compare_estimators(
    experiment: Experiment,
    trials: int,
    estimator: ComparedEstimator = "distances",
    pair_set: str | None = None,
    across_probes: bool = False,
    seed: int | None = None,
    points: int = 200,
    report: Report = unreported,
) -> EstimatorComparison:
    """Compare an alternative with the full estimator on readings of the file's true machine.

    Each data set has its own noise, certificate and `points` random pairs of points in the volume,
    drawn from `seed` (default: the file's) and its number, so that more data sets extend fewer.
    Points are corrected with the probe of the file's evaluation. `report` receives the number of
    finished data sets.
    """
    design = lay_out(experiment)
    chosen = np.zeros((0, 2), np.int64)
    if estimator == "length-equations" or estimator == "sphere-then-metric":
        _refuse_other_lengths(experiment, design)
    elif estimator != "reversal":
        _refuse_unknown_places(experiment, design)
        _refuse_many_terms(experiment, design, estimator, pair_set, across_probes)
        chosen = ball_pairs(experiment, pair_set)
    on_truth, truth = on_stated_machine(experiment, design)
    seed = experiment.seed if seed is None else seed
    rms, maximum, failed = [], [], []
    same, true = _same_pairs(design, on_truth, truth, seed, points)
    errors = []
    for trial in range(trials):
        generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(trial,)))
        try:
            solutions = _both_estimates(
                experiment, design, on_truth, truth, chosen, estimator, across_probes, generator
            )
        except NoReadingError as error:
            raise too_large(experiment, error) from None
        if solutions is None:
            failed.append(trial)
        else:
            ends = design.machine.volume.lower + design.machine.volume.size * generator.random(
                (2, points, design.dimension)
            )
            difference = _distances(design, solutions[1], ends) - _distances(
                design, solutions[0], ends
            )
            rms.append(float(np.sqrt((difference**2).mean())))
            maximum.append(float(np.abs(difference).max()))
            errors.append(np.stack([_distances(design, a, same) - true for a in solutions]))
        report(ProgressStep(f"data sets of {experiment.label}", trial + 1, trials))
    return EstimatorComparison(
        experiment.label,
        experiment.title,
        estimator,
        trials,
        len(chosen),
        len(design.of(Lengths)),
        across_probes,
        points,
        np.array(rms),
        np.array(maximum),
        tuple(failed),
        _of_truth(design, estimator, errors),
    )


def _same_pairs(
    design: Design, on_truth: Design, truth: State, seed: int, points: int
) -> tuple[Array, Array]:
    """Return pairs of points (2, p, d) common to all data sets, and the true machine's distances
    (p,).
    """
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0, 0)))
    count = min(points, MOST_SAME_PAIRS)
    volume = design.machine.volume
    ends = volume.lower + volume.size * generator.random((2, count, design.dimension))
    return ends, _distances(on_truth, truth.a, ends)


def _of_truth(
    design: Design, estimator: ComparedEstimator, errors: list[Array]
) -> dict[str, TruthErrors]:
    """Return the errors of both estimators, from errors (2, p) of each data set."""
    lengths = uncertainties(linearise(design), symbols=("U6",)).get("U6")
    if lengths is None or lengths.undetermined or len(errors) < 2:
        return {}
    by_estimator = zip(("full", estimator), np.stack(errors, axis=1), strict=True)
    return {name: truth_errors(own_errors) for name, own_errors in by_estimator}


def _both_estimates(
    experiment: Experiment,
    design: Design,
    on_truth: Design,
    truth: State,
    chosen: Integers,
    estimator: ComparedEstimator,
    across_probes: bool,
    generator: np.random.Generator,
) -> tuple[Array, Array] | None:
    """Return parameters by the full and by the alternative estimator from one data set; None unless
    both converged.
    """
    drawn = noisy_certificate(design, truth, generator, on_truth.model)
    observed = observe(drawn, *noisy_readings(on_truth, truth, generator))
    if estimator == "reversal":
        return reversal_beside_full(experiment, observed)
    full = estimate(observed.design, observed.x, COMPARISON_TOLERANCE)
    if estimator == "length-equations" or estimator == "sphere-then-metric":
        try:
            solved = length_estimate(observed.design, observed.x, estimator)
        except NotAMetricError:
            return None
        return (
            (full.state.a, solved.parameters)
            if full.status == "converged" and solved.converged
            else None
        )
    alternative = alternative_estimate(
        observed.design,
        observed.x,
        chosen,
        estimator,
        across_probes,
        COMPARISON_TOLERANCE,
        start=full.state.a,
    )
    if full.status != "converged" or alternative.status != "converged":
        return None
    return full.state.a, alternative.a


def _distances(design: Design, a: Array, ends: Array) -> Array:
    """Return distances (m,) between corrected points of scale readings `ends` (2, m, d)."""
    offsets = np.broadcast_to(design.probes.offsets[design.evaluation.probe], ends.shape[1:])
    corrected = [x + design.model.error(x, a, offsets) for x in ends]
    return np.sqrt(((corrected[0] - corrected[1]) ** 2).sum(axis=1))


def _used(pairs: int, lengths: int) -> str:
    """Return the distances that an estimator uses as text.

    >>> _used(0, 12), _used(1, 0)
    ('12 lengths of standards', '1 pairs of balls')
    """
    words = [f"{pairs} pairs of balls"] if pairs or not lengths else []
    return " and ".join([*words, *([f"{lengths} lengths of standards"] if lengths else [])])
