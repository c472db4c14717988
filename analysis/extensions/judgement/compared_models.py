"""Comparison of error models on an experiment's readings: the smallest sufficient one.

Kinematic models with polynomials of increasing degree, and empirical ones, are compared by tests
of the sum of squares that a larger model explains, as NPL Report CISE 15/98, section 5.3, compares
two.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.extensions.questions.asking import answers_at
from ballplate.extensions.reliability.exact_values import diagnosis_of_all
from ballplate.extensions.reliability.refits import diagnosis_with_refits
from ballplate.extensions.reliability.remainders import too_many_entries
from ballplate.extensions.reliability.wording import refit_words
from ballplate.presentation import chance_words
from ballplate.simulator.computing import ProgressStep, Report, single_threaded, unreported
from ballplate.simulator.design import Design, State
from ballplate.simulator.estimation import Linearisation, corrected_points, estimate, linearised_fit
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import refused
from ballplate.simulator.machines import Array, ErrorModel, KinematicSettings
from ballplate.simulator.readings import ObservedReadings
from ballplate.uncertainty import uncertainties

from .compared_models_result import ComparedModels, LengthChange, Rung
from .lack_of_fit import PureError, chance_of, pure_error
from .nested import nested_sums
from .rung_choice import (
    ROUNDING,
    Beaten,
    Comparison,
    FittedSum,
    PolynomialGrid,
    first_adequate,
    limits_reached,
    richer,
)
from .rungs import (
    EMPIRICAL,
    MOST_COEFFICIENTS,
    POOREST,
    LadderModel,
    deficiency,
    empirical_rung,
    kinematic_rung,
    own_rung,
    refuse_priors,
    with_model,
)

NO_RICHER = (
    "this design determines no model larger than the recommended one: its sufficiency is untested"
)

# Chance below which residuals do not come from the scatter of the readings.
MISFIT = 1e-3


@dataclass(frozen=True, eq=False)
class RungFit:
    """An estimate with one model of the ladder: its sum of squares and its state."""

    fitted: FittedSum
    at: Linearisation

    @property
    def model(self) -> LadderModel:
        return self.fitted.model

    def sigma(self, is_given: bool) -> float:
        """Factor of the stated uncertainties."""
        variance = self.fitted.sum_of_squares / self.fitted.degrees_of_freedom
        return 1.0 if is_given else float(np.sqrt(variance))


@dataclass(frozen=True, eq=False)
class Climb:
    """The models that a design determines, with their S^2, and the chosen one.

    `beyond` describes models that the design leaves undetermined, `most` is the largest number of
    coefficients tried.
    """

    grid: PolynomialGrid
    every: list[FittedSum]
    chosen: FittedSum
    beaten: Beaten
    beyond: tuple[str, ...]
    most: int

    @property
    def richest(self) -> FittedSum:
        """That with the most parameters."""
        return max(self.every, key=lambda fitted: fitted.model.count)

    def unconfirmed(self, model: LadderModel) -> tuple[str, bool]:
        """Reason why a model's number of coefficients is unconfirmed, possibly empty, and whether
        it is a lack of readings.
        """
        reached = limits_reached(model, self.grid, self.every)
        if not reached:
            return "", False
        reason = "the readings need as many coefficients as "
        ended = any("empirical" in words for words in self.beyond)
        if ended if reached == (0,) else self.most not in reached:
            return f"{reason}this design determines: their sufficiency is untested", True
        return (
            f"{reason}were tried, and may need more, for example for an error that repeats over"
            " short distances",
            False,
        )


@single_threaded
def climb(
    experiment: Experiment,
    observed: ObservedReadings,
    is_given: bool,
    most: int = MOST_COEFFICIENTS,
) -> Climb:
    """Choose the smallest model that no larger one improves significantly; `most` coefficients at
    most.

    :raises ExperimentError: priors of the file's own parameters, an estimate that does not
        converge, or readings that leave no degrees of freedom even with straight axes.
    """
    refuse_priors(experiment, observed.design)

    def make(position: int, rotation: int, own_degrees: dict[str, int]) -> LadderModel:
        return kinematic_rung(experiment, position, rotation, own_degrees)

    judge = _Judge(observed.design, deficiency(observed.design, make(*POOREST, {})))
    richest, beyond = _richest_polynomials(make, judge, most)
    if not judge.leaves_freedom(richest):
        text = "the readings leave no degrees of freedom to compare error models by; read more"
        raise refused(experiment.source, text, "positions")
    fit = fit_rung(experiment, observed, richest)
    grid = PolynomialGrid(fit.fitted, nested_sums(fit.at), make)
    every = grid.every()
    for count in EMPIRICAL if experiment.dimension == 3 else ():
        if count > most:
            break
        model = empirical_rung(experiment, count)
        if not judge.determines(model):
            beyond = (*beyond, f"empirical, {count} coefficients or more")
            break
        every.append(fit_rung(experiment, observed, model).fitted)
    test = Comparison(is_given, observed.design.observation_count)
    return Climb(grid, every, *first_adequate(grid, every, test), beyond, most)


@dataclass(frozen=True)
class _Judge:
    """True if a design determines a model; `open` directions it leaves undetermined with any."""

    design: Design
    open: int

    def determines(self, model: LadderModel) -> bool:
        return self.leaves_freedom(model) and deficiency(self.design, model) == self.open

    def leaves_freedom(self, model: LadderModel) -> bool:
        design = with_model(self.design, model.model)
        return design.observation_count - design.parameter_count + self.open > 0


def _richest_polynomials(
    make: Callable[[int, int, dict[str, int]], LadderModel], judge: _Judge, most: int
) -> tuple[LadderModel, tuple[str, ...]]:
    """Return the largest polynomials that a design determines, and a description of the others."""
    n = m = most
    while (n, m) != POOREST and not judge.determines(make(n, m, {})):
        n, m = max(n - 1, POOREST[0]), max(m - 1, POOREST[1])
    while n < most and judge.determines(make(n + 1, m, {})):
        n += 1
    while m < most and judge.determines(make(n, m + 1, {})):
        m += 1
    if n == m == most:
        return make(n, m, {}), ()
    reason = f"kinematic, more than {n} and {m} coefficients"
    return make(n, m, {}), (reason,)


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
    linearisation = linearised_fit(design, solution)
    freedom = linearisation.degrees_of_freedom
    return RungFit(FittedSum(model, solution.factor.sum_of_squares, freedom), linearisation)


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

    :raises ExperimentError: as `climb`.
    """
    is_given = (sigma or experiment.sigma) == "given"
    climbed = climb(experiment, observed, is_given, most)
    file = _of_file(experiment, observed.design.model, climbed)
    test = Comparison(is_given, observed.design.observation_count)
    models = _shown(climbed, fit_rung(experiment, observed, file), test)
    fits = []
    for model in models:
        fits.append(fit_rung(experiment, observed, model))
        report(ProgressStep(f"error models of {experiment.label}", len(fits), len(models)))
    chosen, richest = (
        next(fit for fit in fits if fit.model.words == wanted.model.words)
        for wanted in (climbed.chosen, climbed.richest)
    )
    repeats = pure_error(chosen.at.design, chosen.at.state, observed.x)
    faults, beaten = _faults(chosen, observed.x, repeats, is_given), climbed.beaten
    if faults and richest is not chosen and not _faults(richest, observed.x, repeats, is_given):
        chosen, faults, beaten = richest, (), Beaten(1.0, 0, "")
    unconfirmed, for_want = climbed.unconfirmed(chosen.model)
    unsure = unconfirmed if for_want else ""
    if unconfirmed and not for_want:
        faults = (*faults, unconfirmed)
    elif not (unconfirmed or faults or beaten.count):
        unsure = NO_RICHER
    mistakes = _mistakes(fits, file, observed.x, is_given)
    scale = chosen.sigma(is_given)
    rungs = (
        Rung(
            fit.model.words,
            fit.model.count,
            fit.fitted.sum_of_squares,
            fit.fitted.degrees_of_freedom,
            test.criteria(fit.fitted),
            test.beaten(fit.fitted, richer(fit.fitted, climbed.every)),
            _change(fit.at, chosen.at),
            fit is chosen,
            fit.model.words == file.words,
            max(fit.at.deficiency - richest.at.deficiency, 0),
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
        _lack_of_fit(chosen.fitted, repeats),
        beaten,
        climbed.beyond,
        uncertainties(chosen.at, scale, None, ("U6",))["U6"],
        2.0 if experiment.coverage_factor == 1.0 else experiment.coverage_factor,
        tuple(filter(None, (unsure, _untested(chosen.at.design)))),
        bool(mistakes),
    )


def _untested(design: Design) -> str:
    text = too_many_entries(design)
    return f"{text}: the residuals were not searched for structure" if text else ""


def _of_file(experiment: Experiment, model: ErrorModel, climbed: Climb) -> LadderModel:
    """Return the file's own model, as a rung if it is one."""
    model_settings = experiment.error_model
    made = next((fit.model for fit in climbed.every if fit.model.model == model), None)
    if (
        made is None
        and isinstance(model_settings, KinematicSettings)
        and model_settings.functions is None
    ):
        made = climbed.grid.make(
            model_settings.position_coefficients, model_settings.rotation_coefficients, {}
        )
    return made if made is not None and made.model == model else own_rung(experiment, model)


def _shown(climbed: Climb, file: RungFit, test: Comparison) -> list[LadderModel]:
    """Return the models to show, with the fewest parameters first: polynomials with as many
    coefficients for all errors, or as many as the design determines, empirical ones, the file's,
    and those that the verdict names.
    """
    largest = climbed.grid.richest.model.numbers
    named = {
        climbed.beaten.by,
        test.beaten(file.fitted, richer(file.fitted, climbed.every)).by,
        climbed.richest.model.words,
    }

    def is_shown(model: LadderModel) -> bool:
        if model.numbers is None or largest is None or model.words in named:
            return True
        n, m = model.numbers
        is_even = m == min(n, largest[1]) or n == min(m, largest[0])
        return is_even or model.numbers == POOREST

    models = [rung.model for rung in climbed.every if is_shown(rung.model)]
    unique = {model.words: model for model in [*models, climbed.chosen.model, file.model]}
    return sorted(unique.values(), key=lambda rung: rung.count)


def _change(linearisation: Linearisation, other_linearisation: Linearisation) -> LengthChange:
    """Return the difference of two fits in the lengths between all evaluation points."""
    first, second = (
        _lengths(rung_linearisation.design, rung_linearisation.state)
        for rung_linearisation in (linearisation, other_linearisation)
    )
    change = first - second
    return LengthChange(float(np.abs(change).max()), float(np.sqrt((change**2).mean())))


def _lengths(design: Design, state: State) -> Array:
    from scipy.spatial.distance import pdist

    points = design.evaluation.points
    probes = np.full(len(points), design.evaluation.probe)
    return pdist(corrected_points(design, state, points, probes))


def _lack_of_fit(fitted: FittedSum, repeats: PureError) -> float:
    """Return the p-value of a model's residuals beyond the noise of repeats; NaN without repeats,
    or without a remainder.
    """
    dimensions = fitted.degrees_of_freedom - repeats.degrees_of_freedom
    if not repeats.degrees_of_freedom or dimensions <= 0:
        return float("nan")
    sum_left = max(fitted.sum_of_squares - repeats.sum_of_squares, 0.0)
    least = ROUNDING * fitted.degrees_of_freedom
    if sum_left <= least:
        return 1.0
    return chance_of(
        sum_left, dimensions, max(repeats.sum_of_squares, least), repeats.degrees_of_freedom, False
    )


def _mistakes(fits: list[RungFit], file: LadderModel, x: Array, is_given: bool) -> tuple[str, ...]:
    """Return descriptions of errors in the file that explain an excessive S^2 of its own model."""
    fit = next(fit for fit in fits if fit.model.words == file.words)
    square, freedom = fit.fitted.sum_of_squares, fit.fitted.degrees_of_freedom
    if too_many_entries(fit.at.design) or chance_of(square, freedom, 0.0, 0, True) > MISFIT:
        return ()
    diagnosis = diagnosis_with_refits(fit.at, x, freedom, not is_given)
    if diagnosis.refit:
        return (refit_words(diagnosis.refit),)
    answers = answers_at(fit.at, x, not is_given, diagnosis)
    found = () if answers is None else answers.contradicted
    return tuple(each.words for each in found if not each.may_be_model)


def _faults(fit: RungFit, x: Array, repeats: PureError, is_given: bool) -> tuple[str, ...]:
    """Return descriptions of the residuals that a model leaves."""
    faults, fitted, design = [], fit.fitted, fit.at.design
    chance = _lack_of_fit(fitted, repeats)
    if chance < MISFIT:
        faults.append(
            "lack of fit: the residuals are larger than the noise of repeated readings explains"
            f" (p-value {chance_words(chance)})"
        )
    square, freedom = fitted.sum_of_squares, fitted.degrees_of_freedom
    if is_given and chance_of(square, freedom, 0.0, 0, True) < MISFIT:
        faults.append(f"S^2 is {square / freedom:.3g} times its value for the stated uncertainties")
    if not too_many_entries(design):
        unexplained = diagnosis_of_all(fit.at, x, freedom, not is_given).unexplained
        if unexplained is not None and (unexplained.words or unexplained.too_large):
            words = unexplained.words or "no single error of the kinds that are looked for"
            faults.append(f"the residuals have a structure; what explains most of it is {words}")
    return tuple(faults)
