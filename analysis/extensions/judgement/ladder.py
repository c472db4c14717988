"""A ladder of error models on an experiment's readings: which of them the readings call for.

Kinematic models with polynomials of more and more coefficients, and empirical ones, are compared by
tests of what a richer model explains, as NPL Report CISE 15/98, section 5.3, compares two.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.gross_errors import (
    diagnosis_of_all,
    diagnosis_with_refits,
    refit_words,
    suspect_words,
    too_many_entries,
)
from ballplate.simulator.computing import ProgressStep, Report, single_threaded, unreported
from ballplate.simulator.design import Design, State
from ballplate.simulator.estimation import Linearisation, corrected_points, estimate, linearised_fit
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import refused
from ballplate.simulator.machines import Array, ErrorModel, KinematicSettings
from ballplate.simulator.readings import ObservedReadings
from ballplate.uncertainty import uncertainties

from .lack_of_fit import PureError, chance_of, chance_words, pure_error
from .ladder_result import Ladder, LengthChange, Rung
from .nested import nested_sums
from .rung_choice import (
    ROUNDING,
    Beaten,
    Comparison,
    FittedSum,
    PolynomialGrid,
    first_adequate,
    limits_reached,
    path,
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
    "this design determines no richer model than the one recommended: nothing shows that it is rich"
    " enough"
)

# Chance below which residuals do not come from the scatter of the readings.
MISFIT = 1e-3


@dataclass(frozen=True, eq=False)
class RungFit:
    """An estimate with one model of the ladder: its sum of squares, and where it is."""

    fitted: FittedSum
    at: Linearisation

    @property
    def model(self) -> LadderModel:
        return self.fitted.model

    def sigma(self, given: bool) -> float:
        """What multiplies stated uncertainties."""
        left = self.fitted.sum_of_squares / self.fitted.degrees_of_freedom
        return 1.0 if given else float(np.sqrt(left))


@dataclass(frozen=True, eq=False)
class Climb:
    """The models that a design determines, with their S^2, and what was chosen of them.

    `beyond` says in words which models the design leaves undetermined, `most` is the number of
    coefficients up to which they were tried.
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
        return max(self.every, key=lambda one: one.model.count)

    def unconfirmed(self, model: LadderModel) -> tuple[str, bool]:
        """Why nothing shows that a model has coefficients enough, empty where something does, and
        whether that is for want of readings.
        """
        reached = limits_reached(model, self.grid, self.every)
        if not reached:
            return "", False
        told = "the readings call for as many coefficients as "
        ended = any("empirical" in words for words in self.beyond)
        if ended if reached == (0,) else self.most not in reached:
            return f"{told}this design determines: nothing shows that these are enough", True
        return (
            f"{told}were tried, and would for more, as where an error repeats over short distances",
            False,
        )


@single_threaded
def climb(
    experiment: Experiment, observed: ObservedReadings, given: bool, most: int = MOST_COEFFICIENTS
) -> Climb:
    """Choose the poorest model that no richer one beats; `most` coefficients at most.

    :raises ExperimentError: priors of the file's own parameters, an estimate that does not
        converge, or readings that leave no degrees of freedom even with straight axes.
    """
    refuse_priors(experiment, observed.design)

    def make(position: int, rotation: int, own: dict[str, int]) -> LadderModel:
        return kinematic_rung(experiment, position, rotation, own)

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
    test = Comparison(given, observed.design.observation_count)
    return Climb(grid, every, *first_adequate(grid, every, test), beyond, most)


@dataclass(frozen=True)
class _Judge:
    """Whether a design determines a model; `open` directions it leaves undetermined with any."""

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
    """The richest polynomials that a design determines, and in words which it does not."""
    n = m = most
    while (n, m) != POOREST and not judge.determines(make(n, m, {})):
        n, m = max(n - 1, POOREST[0]), max(m - 1, POOREST[1])
    while n < most and judge.determines(make(n + 1, m, {})):
        n += 1
    while m < most and judge.determines(make(n, m + 1, {})):
        m += 1
    if n == m == most:
        return make(n, m, {}), ()
    told = f"kinematic, more than {n} and {m} coefficients"
    return make(n, m, {}), (told,)


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
    freedom = at.degrees_of_freedom
    return RungFit(FittedSum(model, solution.factor.sum_of_squares, freedom), at)


@single_threaded
def ladder(
    experiment: Experiment,
    observed: ObservedReadings,
    sigma: Literal["estimated", "given"] | None = None,
    most: int = MOST_COEFFICIENTS,
    report: Report = unreported,
) -> Ladder:
    """Which error model an experiment's readings call for, and what the others change in lengths.

    `sigma` overrides what the file says; polynomials have `most` coefficients at most.

    :raises ExperimentError: as `climb`.
    """
    given = (sigma or experiment.sigma) == "given"
    found = climb(experiment, observed, given, most)
    file = _of_file(experiment, observed.design.model, found)
    test = Comparison(given, observed.design.observation_count)
    models = _shown(found, file, test)
    fits = []
    for model in models:
        fits.append(fit_rung(experiment, observed, model))
        report(ProgressStep(f"error models of {experiment.label}", len(fits), len(models)))
    fits = _with_best_richer(experiment, observed, fits, found, file, test)
    chosen, richest = (
        next(one for one in fits if one.model.words == wanted.model.words)
        for wanted in (found.chosen, found.richest)
    )
    repeats = pure_error(chosen.at.design, chosen.at.state, observed.x)
    faults, beaten = _faults(chosen, observed.x, repeats, given), found.beaten
    if faults and richest is not chosen and not _faults(richest, observed.x, repeats, given):
        chosen, faults, beaten = richest, (), Beaten(1.0, 0, "")
    unconfirmed, for_want = found.unconfirmed(chosen.model)
    unsure = unconfirmed if for_want else ""
    if unconfirmed and not for_want:
        faults = (*faults, unconfirmed)
    elif not (unconfirmed or faults or beaten.count):
        unsure = NO_RICHER
    mistakes = _mistakes(fits, file, observed.x, given)
    scale = chosen.sigma(given)
    rungs = (
        Rung(
            one.model.words,
            one.model.count,
            one.fitted.sum_of_squares,
            one.fitted.degrees_of_freedom,
            test.criteria(one.fitted),
            test.beaten(one.fitted, richer(one.fitted, found.every)),
            _change(one.at, chosen.at),
            one is chosen,
            one.model.words == file.words,
            max(one.at.deficiency - richest.at.deficiency, 0),
        )
        for one in fits
    )
    return Ladder(
        experiment.label,
        experiment.title,
        observed,
        tuple(rungs),
        chosen.model.words,
        chosen.model.settings.model_dump(mode="json", exclude_unset=True, exclude_none=True),
        mistakes or faults,
        given,
        scale,
        repeats,
        _lack_of_fit(chosen.fitted, repeats),
        beaten,
        found.beyond,
        uncertainties(chosen.at, scale, None, ("U6",))["U6"],
        2.0 if experiment.coverage_factor == 1.0 else experiment.coverage_factor,
        tuple(filter(None, (unsure, _untested(chosen.at.design)))),
        bool(mistakes),
    )


def _with_best_richer(
    experiment: Experiment,
    observed: ObservedReadings,
    fits: list[RungFit],
    found: Climb,
    file: LadderModel,
    test: Comparison,
) -> list[RungFit]:
    """The fits with those of the richer models that explain most beside the chosen one and the
    file's, which are told by name.
    """
    own = next(one.fitted for one in fits if one.model.words == file.words)
    named = {found.beaten.by, test.beaten(own, richer(own, found.every)).by}
    missing = named - {one.model.words for one in fits}
    more = [one.model for one in found.every if one.model.words in missing]
    fits = [*fits, *(fit_rung(experiment, observed, one) for one in more)]
    return sorted(fits, key=lambda one: one.model.count)


def _untested(design: Design) -> str:
    text = too_many_entries(design)
    return f"{text}: the residuals were not searched for structure" if text else ""


def _of_file(experiment: Experiment, model: ErrorModel, found: Climb) -> LadderModel:
    """The file's own model, as a rung where it is one."""
    given = experiment.error_model
    made = next((one.model for one in found.every if one.model.model == model), None)
    if made is None and isinstance(given, KinematicSettings) and given.functions is None:
        made = found.grid.make(given.position_coefficients, given.rotation_coefficients, {})
    return made if made is not None and made.model == model else own_rung(experiment, model)


def _shown(found: Climb, file: LadderModel, test: Comparison) -> list[LadderModel]:
    """Models of a way up, the chosen one, empirical ones and the file's own, with the fewest
    parameters first.
    """
    polynomials = [one for one in found.every if one.model.numbers is not None]
    models = [one.model for one in path(polynomials, test)]
    models += [one.model for one in found.every if one.model.numbers is None]
    unique = {one.words: one for one in [*models, found.chosen.model, file]}
    return sorted(unique.values(), key=lambda one: one.count)


def _change(at: Linearisation, other: Linearisation) -> LengthChange:
    """How two fits differ in the lengths between all evaluation points."""
    first, second = (_lengths(one.design, one.state) for one in (at, other))
    change = first - second
    return LengthChange(float(np.abs(change).max()), float(np.sqrt((change**2).mean())))


def _lengths(design: Design, state: State) -> Array:
    from scipy.spatial.distance import pdist

    points = design.evaluation.points
    probes = np.full(len(points), design.evaluation.probe)
    return np.asarray(pdist(corrected_points(design, state, points, probes)))


def _lack_of_fit(fitted: FittedSum, repeats: PureError) -> float:
    """Chance that what a model leaves beyond the scatter of repeats is due to that scatter; NaN
    without repeats, or where nothing else is left.
    """
    dimensions = fitted.degrees_of_freedom - repeats.degrees_of_freedom
    if not repeats.degrees_of_freedom or dimensions <= 0:
        return float("nan")
    left = max(fitted.sum_of_squares - repeats.sum_of_squares, 0.0)
    least = ROUNDING * fitted.degrees_of_freedom
    if left <= least:
        return 1.0
    return chance_of(
        left, dimensions, max(repeats.sum_of_squares, least), repeats.degrees_of_freedom, False
    )


def _mistakes(fits: list[RungFit], file: LadderModel, x: Array, given: bool) -> tuple[str, ...]:
    """Mistakes in the file's offsets or arrangement that explain an S^2 of its own model that is
    too large, in words.
    """
    fit = next(one for one in fits if one.model.words == file.words)
    square, freedom = fit.fitted.sum_of_squares, fit.fitted.degrees_of_freedom
    if too_many_entries(fit.at.design) or chance_of(square, freedom, 0.0, 0, True) > MISFIT:
        return ()
    found = diagnosis_with_refits(fit.at, x, freedom, not given)
    suspects = (one for one in found.suspects if one.patterns.kind[one.pattern] == "probe")
    words = [refit_words(found.refit)] if found.refit else []
    return (*words, *map(suspect_words, suspects))


def _faults(fit: RungFit, x: Array, repeats: PureError, given: bool) -> tuple[str, ...]:
    """What a model leaves unexplained, in words."""
    found, fitted, design = [], fit.fitted, fit.at.design
    chance = _lack_of_fit(fitted, repeats)
    if chance < MISFIT:
        found.append(
            f"lack of fit: the residuals are larger than the scatter of repeated readings explains"
            f" (chance {chance_words(chance)})"
        )
    square, freedom = fitted.sum_of_squares, fitted.degrees_of_freedom
    if given and chance_of(square, freedom, 0.0, 0, True) < MISFIT:
        found.append(f"S^2 is {square / freedom:.3g} times what the stated uncertainties explain")
    if not too_many_entries(design):
        left = diagnosis_of_all(fit.at, x, freedom, not given).unexplained
        if left is not None and (left.words or left.too_large):
            words = left.words or "no single error of the kinds that are looked for"
            found.append(f"the residuals have a structure; what explains most of it is {words}")
    return tuple(found)
