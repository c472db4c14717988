"""Comparison of error models on an experiment's readings: the smallest sufficient one.

Kinematic models with more and more coefficients, empirical ones and the file's own are fitted.
Models of one kind are compared by tests of the sum of squares that a larger one explains, as NPL
Report CISE 15/98, section 5.3, compares two, and those of several kinds by Schwarz's criterion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.extensions.diagnosis.remainders import too_many_entries
from ballplate.extensions.diagnosis.searched_fit import diagnosed
from ballplate.presentation import chance_words
from ballplate.simulator.computing import ProgressStep, Report, single_threaded, unreported
from ballplate.simulator.design import Design, State
from ballplate.simulator.estimation import Linearisation, corrected_points, estimate, linearised_fit
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import refused
from ballplate.simulator.machines import Array
from ballplate.simulator.readings import ObservedReadings
from ballplate.uncertainty import uncertainties

from .compared_models_result import FALSE_STEP, Beaten, ComparedModels, Rung
from .lack_of_fit import PureError, chance_of, pure_error
from .rungs import MOST_COEFFICIENTS, LadderModel, determined_rungs, rung_of_file, with_model

NO_RICHER = (
    "this design determines no larger model of the recommended kind: its sufficiency is untested"
)

NEEDS_MORE = (
    "the readings need as many coefficients as were tried, and may need more, for example for an"
    " error that repeats over short distances"
)

# Chance below which residuals do not come from the scatter of the readings.
MISFIT = 1e-3

# BIC above that of a model of another kind, from which on the other is better.
CLEARLY_WORSE = 10.0

# Sums of squares for each degree of freedom below this are rounding.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class RungFit:
    """An error model, the linearisation at its estimate, S^2 and the degrees of freedom left."""

    model: LadderModel
    at: Linearisation
    sum_of_squares: float
    degrees_of_freedom: int

    def bic(self, is_given: bool) -> float:
        """Schwarz's criterion of a normal likelihood with all parameters, sigma among them unless
        it is given.
        """
        count = self.at.count
        parameters, misfit = count - self.degrees_of_freedom, self.sum_of_squares
        if not is_given:
            parameters += 1
            misfit = count * float(np.log(max(misfit / count, ROUNDING)))
        return misfit + float(np.log(count)) * parameters

    def chance(self, larger: RungFit, is_given: bool) -> float:
        """Chance of what a larger model explains if this one is right."""
        freedom = larger.degrees_of_freedom
        sum_left = max(larger.sum_of_squares, ROUNDING * freedom)
        gain = max(self.sum_of_squares, ROUNDING * freedom) - sum_left
        return chance_of(gain, self.degrees_of_freedom - freedom, sum_left, freedom, is_given)

    def beaten(self, rivals: list[RungFit], is_given: bool) -> Beaten:
        """The larger model of the same kind that explains most, by chance."""
        chances = [
            (self.chance(rival, is_given), rival.model.words)
            for rival in rivals
            if rival.model.contains(self.model)
        ]
        least, by = min(chances, default=(1.0, ""))
        return Beaten(least, len(chances), by)


def first_adequate(fits: list[RungFit], is_given: bool) -> RungFit:
    """The model with the fewest parameters, of several in this order, that no larger one beats by
    a test or, if of another kind, by BIC; the largest if each is beaten.
    """
    for place, fit in enumerate(fits[:-1]):
        worse = fit.bic(is_given) - CLEARLY_WORSE
        is_beaten = fit.beaten(fits, is_given).chance < FALSE_STEP
        if not is_beaten and all(rival.bic(is_given) >= worse for rival in fits[place + 1 :]):
            return fit
    return fits[-1]


def fit_rung(experiment: Experiment, observed: ObservedReadings, model: LadderModel) -> RungFit:
    """The estimate with one model.

    :raises ExperimentError: it does not converge.
    """
    design = with_model(observed.design, model.model)
    solution = estimate(design, observed.x)
    if solution.status != "converged":
        text = (
            f"the estimate with another error model ({model.words}) has {solution.status}; see"
            " ballplate fit"
        )
        raise refused(experiment.source, text, "error_model")
    at = linearised_fit(design, solution)
    return RungFit(model, at, solution.factor.sum_of_squares, at.degrees_of_freedom)


@single_threaded
def compared_models(
    experiment: Experiment,
    observed: ObservedReadings,
    sigma: Literal["estimated", "given"] | None = None,
    most: int = MOST_COEFFICIENTS,
    report: Report = unreported,
) -> ComparedModels:
    """Return the smallest sufficient error model of an experiment's readings, and the effect of
    the others on lengths.

    `sigma` overrides the file; polynomials have `most` coefficients at most.

    :raises ExperimentError: as `determined_rungs`, or an estimate that does not converge.
    """
    is_given = (sigma or experiment.sigma) == "given"
    models, beyond = determined_rungs(experiment, observed.design, most)
    file = rung_of_file(experiment, observed.design.model)
    candidates = []
    for model in models:
        candidates.append(fit_rung(experiment, observed, model))
        report(ProgressStep(f"error models of {experiment.label}", len(candidates), len(models)))
    of_file = next((fit for fit in candidates if fit.model.words == file.words), None)
    fits = candidates
    if of_file is None:
        of_file = fit_rung(experiment, observed, file)
        fits = sorted([*candidates, of_file], key=lambda fit: fit.model.count)
    chosen, largest = first_adequate(candidates, is_given), candidates[-1]
    repeats = pure_error(chosen.at.design, chosen.at.state, observed.x)
    faults = _faults(chosen, observed.x, repeats, is_given)
    if faults and largest is not chosen and not _faults(largest, observed.x, repeats, is_given):
        chosen, faults = largest, ()
    beaten, unsure = chosen.beaten(candidates, is_given), ""
    if not beaten.count and type(chosen.model.settings) in beyond:
        unsure = NO_RICHER
    elif not beaten.count:
        faults = (*faults, NEEDS_MORE)
    mistakes = _mistakes(of_file, observed.x, is_given)
    variance = chosen.sum_of_squares / chosen.degrees_of_freedom
    scale = 1.0 if is_given else float(np.sqrt(variance))
    rungs = (
        Rung(
            fit.model.words,
            fit.model.count,
            fit.sum_of_squares,
            fit.degrees_of_freedom,
            fit.bic(is_given),
            fit.beaten(candidates, is_given),
            *_change_of_lengths(fit.at, chosen.at),
            fit is chosen,
            fit is of_file,
            max(fit.at.deficiency - largest.at.deficiency, 0),
        )
        for fit in fits
    )
    return ComparedModels(
        experiment.label,
        experiment.title,
        observed,
        tuple(rungs),
        chosen.model.words,
        chosen.model.settings.model_dump(mode="json", exclude_unset=True, exclude_none=True),
        mistakes or faults,
        is_given,
        scale,
        repeats,
        _lack_of_fit(chosen, repeats),
        beaten,
        tuple(beyond.values()),
        uncertainties(chosen.at, scale, None, ("U6",))["U6"],
        2.0 if experiment.coverage_factor == 1.0 else experiment.coverage_factor,
        tuple(filter(None, (unsure, _untested(chosen.at.design)))),
        bool(mistakes),
    )


def _untested(design: Design) -> str:
    text = too_many_entries(design)
    return f"{text}: the residuals were not searched for structure" if text else ""


def _change_of_lengths(one: Linearisation, other: Linearisation) -> tuple[float, float]:
    """Return the largest and the root mean square difference of two fits in the lengths between
    all evaluation points, 0 where it is rounding.
    """
    lengths = _lengths(other.design, other.state)
    change = _lengths(one.design, one.state) - lengths
    change[np.abs(change) <= ROUNDING * lengths] = 0.0
    return float(np.abs(change).max()), float(np.sqrt((change**2).mean()))


def _lengths(design: Design, state: State) -> Array:
    from scipy.spatial.distance import pdist

    points = design.evaluation.points
    probes = np.full(len(points), design.evaluation.probe)
    return pdist(corrected_points(design, state, points, probes))


def _lack_of_fit(fit: RungFit, repeats: PureError) -> float:
    """Return the p-value of a model's residuals beyond the noise of repeats; NaN without repeats,
    or without a remainder.
    """
    dimensions = fit.degrees_of_freedom - repeats.degrees_of_freedom
    if not repeats.degrees_of_freedom or dimensions <= 0:
        return float("nan")
    sum_left = max(fit.sum_of_squares - repeats.sum_of_squares, 0.0)
    least = ROUNDING * fit.degrees_of_freedom
    if sum_left <= least:
        return 1.0
    return chance_of(
        sum_left, dimensions, max(repeats.sum_of_squares, least), repeats.degrees_of_freedom, False
    )


def _mistakes(fit: RungFit, x: Array, is_given: bool) -> tuple[str, ...]:
    """Return descriptions of errors in the file that explain an excessive S^2 of its own model."""
    square, freedom = fit.sum_of_squares, fit.degrees_of_freedom
    if too_many_entries(fit.at.design) or chance_of(square, freedom, 0.0, 0, True) > MISFIT:
        return ()
    diagnosis, _ = diagnosed(fit.at, x, not is_given)
    named = (each for each in diagnosis.findings if not each.is_gross and not each.may_be_model)
    return tuple(each.words for each in named if each.kind != "scatter")


def _faults(fit: RungFit, x: Array, repeats: PureError, is_given: bool) -> tuple[str, ...]:
    """Return descriptions of the residuals that a model leaves."""
    faults, design = [], fit.at.design
    chance = _lack_of_fit(fit, repeats)
    if chance < MISFIT:
        faults.append(
            "lack of fit: the residuals are larger than the noise of repeated readings explains"
            f" (p-value {chance_words(chance)})"
        )
    square, freedom = fit.sum_of_squares, fit.degrees_of_freedom
    if is_given and chance_of(square, freedom, 0.0, 0, True) < MISFIT:
        faults.append(f"S^2 is {square / freedom:.3g} times its value for the stated uncertainties")
    if not too_many_entries(design):
        diagnosis, _ = diagnosed(fit.at, x, not is_given)
        for each in diagnosis.findings:
            if each.may_be_model:
                faults.append(f"the residuals have a structure: {each.verdict}")
    return tuple(faults)
