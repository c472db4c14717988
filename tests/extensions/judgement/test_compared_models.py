"""The ladder of error models: its sums against a dense least squares, its tests against closed
forms, its choice against simulated machines whose coefficients are known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import ballplate as bp
import numpy as np
import pytest
import scipy.stats
from ballplate.extensions.judgement.compared_models import (
    _richest_polynomials,
    climb,
    compared_models,
    fit_rung,
)
from ballplate.extensions.judgement.lack_of_fit import pure_error
from ballplate.extensions.judgement.nested import NestedSums, nested_sums
from ballplate.extensions.judgement.rung_choice import (
    Comparison,
    FittedSum,
    PolynomialGrid,
    first_adequate,
)
from ballplate.extensions.judgement.rungs import (
    POOREST,
    LadderModel,
    chain_of,
    kinematic_rung,
    with_model,
)
from ballplate.simulator.design.arrays import nominal_state
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.protocol import Reported
from ballplate.simulator.readings.observed_readings import ObservedReadings, observe
from ballplate.simulator.readings.simulated import simulated_readings
from numpy.typing import NDArray

from tests.extensions.judgement import wording
from tests.extensions.judgement.model_campaigns import (
    KINDS,
    campaign,
    last_ones,
    quickstart,
    readings_of,
    true_model,
    uncertainties,
)
from tests.reference import dense

Real = NDArray[np.float64]


def small(**changed: object) -> Experiment:
    """Nine balls in six positions."""
    plate = {"plate": {"kind": "grid", "balls": [3, 3], "size": ["750 mm", "750 mm"]}}
    model = {"kind": "kinematic", "position_coefficients": 3, "rotation_coefficients": 2}
    points = {"points": {"random": 20, "seed": 3}, "probe": "down"}
    changes = {"artefacts": plate, "error_model": model, "evaluation": points, **changed}
    return bp.quickstart().with_(changes)


def simulated(experiment: Experiment, seed: int = 1) -> ObservedReadings:
    made = simulated_readings(experiment, seed)
    return observe(lay_out(experiment), made.readings, made.x)


def dense_sum(observed: ObservedReadings, position: int, rotation: int) -> tuple[float, int]:
    """S^2 and the number of parameters of a dense fit."""
    design, functions = observed.design, dense.error_functions(position, rotation)
    problem = dense.Problem(
        design,
        functions,
        observed.x,
        design.positions.rotations,
        design.positions.origins,
        design.balls.places,
        np.zeros(sum(one.free for one in functions)),
    )
    for _ in range(3):
        step, _ = dense.least_squares_step(problem)
        balls, rotations, origins, a = dense.unpack(problem, step)
        problem = replace(problem, balls=balls, rotations=rotations, origins=origins, a=a)
    return float((dense.residuals(problem, np.zeros(problem.parameters)) ** 2).sum()), (
        problem.parameters
    )


def test_sums_tests_and_criteria_are_those_of_dense_fits() -> None:
    experiment = small()
    observed = simulated(experiment)

    def make(position: int, rotation: int, own: dict[str, int]):  # type: ignore[no-untyped-def]
        return kinematic_rung(experiment, position, rotation, own)

    fit = fit_rung(experiment, observed, make(4, 3, {}))
    grid = PolynomialGrid(fit.fitted, nested_sums(fit.at), make)
    n, found = observed.design.observation_count, {}
    for numbers in ((2, 1), (3, 2), (4, 3)):
        square, parameters = dense_sum(observed, *numbers)
        found[numbers] = grid.fitted(make(*numbers, {}))
        np.testing.assert_allclose(found[numbers].sum_of_squares, square, rtol=1e-5)
        assert found[numbers].degrees_of_freedom == n - parameters
        for given in (False, True):
            criteria = Comparison(given, n).criteria(found[numbers])
            minus_twice = square if given else n * np.log(square / n)
            count = parameters + (not given)
            np.testing.assert_allclose(criteria.aic, minus_twice + 2 * count, rtol=1e-5)
            np.testing.assert_allclose(criteria.bic, minus_twice + np.log(n) * count, rtol=1e-5)
    poor, rich = found[3, 2], found[4, 3]
    more = poor.degrees_of_freedom - rich.degrees_of_freedom
    gained = poor.sum_of_squares - rich.sum_of_squares
    ratio = gained / more / (rich.sum_of_squares / rich.degrees_of_freedom)
    expected = scipy.stats.f.sf(ratio, more, rich.degrees_of_freedom)
    np.testing.assert_allclose(Comparison(False, n).chance(poor, rich), expected, rtol=1e-9)
    expected = scipy.stats.chi2.sf(gained, more)
    np.testing.assert_allclose(Comparison(True, n).chance(poor, rich), expected, rtol=1e-9)


def test_sums_of_single_functions_are_those_of_fits_with_them() -> None:
    """Also where the design leaves something undetermined, which is held."""
    for calibration in (None, []):
        experiment = small() if calibration is None else small(calibration=calibration)
        observed = simulated(experiment)

        def make(n: int, m: int, own: dict[str, int], of: Experiment = experiment):  # type: ignore[no-untyped-def]
            return kinematic_rung(of, n, m, own)

        fit = fit_rung(experiment, observed, make(4, 3, {}))
        grid = PolynomialGrid(fit.fitted, nested_sums(fit.at), make)
        for own in ({"EXX": 4}, {"EYX": 4, "EBZ": 3}):
            model = make(3, 2, own)
            again = fit_rung(experiment, observed, model).fitted
            found = grid.fitted(model)
            np.testing.assert_allclose(found.sum_of_squares, again.sum_of_squares, rtol=1e-5)
            assert found.degrees_of_freedom == again.degrees_of_freedom


@pytest.mark.parametrize("kind", [6, pytest.param(9, marks=pytest.mark.long)])
def test_the_true_model_is_recommended(kind: int) -> None:
    found = climb(quickstart(), campaign(kind, 0), False, 7)
    assert found.chosen.model.words == true_model(kind).words


@pytest.mark.long
@pytest.mark.parametrize("kind", range(len(KINDS)))
def test_the_true_model_is_recommended_in_nine_of_ten_campaigns(kind: int) -> None:
    words = true_model(kind).words
    chosen = [climb(quickstart(), campaign(kind, k), False).chosen.model.words for k in range(100)]
    assert chosen.count(words) >= 90


def too_many(kind: int, count: int, smallest: float) -> int:
    """In how many campaigns of a kind of machine a function gets more coefficients than it has.

    The readings are linear in the machine's parameters: of the richest model's columns X = Q R only
    R, the truth and normal numbers count, beside a chi-squared rest. Last coefficients are at least
    `smallest` times their standard uncertainty.
    """
    experiment, generator = quickstart(), np.random.default_rng([20261123, kind])

    @lru_cache(None)
    def made(n: int, m: int, own: tuple[tuple[str, int], ...]) -> LadderModel:
        return kinematic_rung(experiment, n, m, dict(own))

    def make(n: int, m: int, own: dict[str, int]) -> LadderModel:
        return made(n, m, tuple(own.items()))

    rich, true, u = make(8, 8, {}), true_model(kind), uncertainties(kind)
    fit = fit_rung(experiment, campaign(kind, 0), rich)
    root = np.linalg.qr(nested_sums(fit.at).columns)[1]
    scale = fit.at.spectrum.scale[fit.at.layout.model]
    of_rich, of_true = chain_of(rich.model), chain_of(true.model)
    place = np.concatenate(
        [
            of_rich.slices[one.name].start
            + np.arange(of_true.slices[one.name].stop - of_true.slices[one.name].start)
            for one in of_true.functions
        ]
    )
    freedom, found = fit.fitted.degrees_of_freedom, 0
    test = Comparison(False, fit.at.design.observation_count)
    for _ in range(count):
        a = 10.0 * u * generator.standard_normal(len(u))
        least = u * generator.uniform(smallest, smallest + 3.0, len(u))
        is_small = last_ones(true) & (np.abs(a) < least) & (smallest > 0.0)
        a = np.where(is_small, np.where(a < 0.0, -least, least), a)
        truth = np.zeros(len(scale))
        truth[place] = a
        target = generator.standard_normal(len(root)) - root @ (truth / scale)
        rest = generator.chisquare(freedom)
        whole = FittedSum(rich, rest, freedom)
        grid = PolynomialGrid(whole, NestedSums(root, target, rest), make)
        chosen = first_adequate(grid, grid.every(), test)[0].model
        found += any(
            chosen.coefficients(one.name, one.rotation) > true.coefficients(one.name, one.rotation)
            for one in of_rich.functions
        )
    return found


@pytest.mark.long
@pytest.mark.parametrize(("smallest", "limit"), [(5.0, 0.06), (0.0, 0.1)])
def test_too_many_coefficients_are_recommended_as_rarely_as_stated(
    smallest: float, limit: float
) -> None:
    """The levels of the tests, 1 % and 5 %, hold where every coefficient shows."""
    kinds, count = (0, 1, 2, 3, 6, 8), 100
    found = [too_many(kind, count, smallest) for kind in kinds]
    total, campaigns = sum(found), count * len(kinds)
    low = scipy.stats.beta.ppf(0.025, total, campaigns - total + 1)
    high = scipy.stats.beta.ppf(0.975, total + 1, campaigns - total)
    print(
        f"last coefficients from {smallest:g} u on: too many coefficients in {total} of"
        f" {campaigns} campaigns, {100 * total / campaigns:.1f} % ({100 * low:.1f} to"
        f" {100 * high:.1f}); by kind {dict(zip(kinds, found, strict=True))}"
    )
    assert 0.01 < high < limit


class Wave:
    """A machine with an error that repeats every 47 mm."""

    dimension = 3

    def __init__(self, amplitude: float) -> None:
        self.base, self.amplitude = true_model(3).model, amplitude
        self.parameters = self.base.parameters

    def error(self, x: Real, a: Real, p: Real) -> Real:
        found = self.base.error(x, a, p).copy()
        found[:, 0] += self.amplitude * np.sin(2.0 * np.pi * x[:, 0] / 0.047)
        return found

    def jacobian(self, x: Real, a: Real, p: Real) -> Real:
        return self.base.jacobian(x, a, p)

    def reported(self) -> Reported:
        return self.base.reported()


@pytest.mark.parametrize("sigma", ["estimated", pytest.param("given", marks=pytest.mark.long)])
def test_none_follows_a_wave(sigma: str) -> None:
    generator = np.random.default_rng(5)
    a = 10.0 * uncertainties(3) * generator.standard_normal(len(uncertainties(3)))
    observed = readings_of(Wave(1e-6), a, generator)
    found = compared_models(quickstart(), observed, sigma, 5)  # type: ignore[arg-type]
    assert found.is_none and found.complaint and found.to_dict()["recommended"] is None
    assert found.lines()[-2].startswith("none of these: ")


def test_pure_error_is_the_scatter_of_repeats_about_their_means() -> None:
    experiment = small()
    drawn = lay_out(experiment)
    repeated = replace(drawn, readings=replace(drawn.readings, repeats=drawn.readings.repeats * 3))
    a = 1e-6 * np.random.default_rng(3).standard_normal(len(drawn.model.parameters))
    observed = readings_of(drawn.model, a, np.random.default_rng(1), repeated)
    readings, x = observed.design.readings, observed.x
    groups: dict[tuple[int, int, int], list[Real]] = {}
    for k in range(len(readings)):
        key = int(readings.ball[k]), int(readings.position[k]), int(readings.probe[k])
        groups.setdefault(key, []).append(x[k])
    of_groups = [np.array(one) for one in groups.values()]
    square = sum(float(((one - one.mean(axis=0)) ** 2).sum()) for one in of_groups) / 2e-7**2
    found = pure_error(observed.design, nominal_state(observed.design), x)
    np.testing.assert_allclose(found.sum_of_squares, square, rtol=1e-4)
    assert found.degrees_of_freedom == 3 * (len(x) - len(of_groups))
    result = compared_models(experiment, observed, "estimated", 4)
    chosen = next(one for one in result.rungs if one.is_recommended)
    beyond = chosen.degrees_of_freedom - found.degrees_of_freedom
    ratio = (chosen.sum_of_squares - square) / beyond / (square / found.degrees_of_freedom)
    expected = scipy.stats.f.sf(ratio, beyond, found.degrees_of_freedom)
    np.testing.assert_allclose(result.lack_of_fit, expected, rtol=1e-3)


def test_what_the_design_cannot_determine_is_no_candidate() -> None:
    """Three balls along each side in six positions tell no more than a few coefficients, of which
    the first that are too many leave something undetermined.
    """
    experiment = small()
    found = climb(experiment, simulated(experiment), False)
    assert found.beyond
    numbers = found.grid.richest.model.numbers
    assert numbers is not None and max(numbers) < 8
    for more in ((1, 0), (0, 1)):
        model = kinematic_rung(experiment, numbers[0] + more[0], numbers[1] + more[1])
        at = linearise(with_model(lay_out(experiment), model.model))
        left = at.design.observation_count - at.design.parameter_count
        assert at.deficiency > 0 or left <= 0
    assert (
        linearise(with_model(lay_out(experiment), found.grid.richest.model.model)).deficiency == 0
    )


@dataclass(frozen=True)
class Plain:
    """Stands for a model with numbers of coefficients, and for a design that determines some."""

    determined: frozenset[tuple[int, int]]

    def determines(self, model: tuple[int, int]) -> bool:
        return model in self.determined


@pytest.mark.parametrize(
    "allowed",
    [
        lambda n, m: n + m <= 9,
        lambda n, m: n + 2 * m <= 12,
        lambda n, m: n <= 5 and m <= 3,
        lambda n, m: n * m <= 20,
        lambda n, m: (n, m) == POOREST,
        lambda n, m: False,
        lambda n, m: True,
    ],
)
def test_the_richest_polynomials_leave_none_of_both_kinds_behind(
    allowed: Callable[[int, int], bool],
) -> None:
    """By going through all numbers of coefficients: no determined model has more of one kind and as
    many of the other, and where position and rotation may have as many, they have that.
    """
    most, tried = 10, 0
    every = [(n, m) for n in range(POOREST[0], most + 1) for m in range(POOREST[1], most + 1)]
    determined = frozenset(one for one in every if allowed(*one))

    def make(n: int, m: int, own: dict[str, int]) -> tuple[int, int]:
        nonlocal tried
        tried += 1
        assert tried < 1000
        return n, m

    (n, m), beyond = _richest_polynomials(make, Plain(determined), most)  # type: ignore[arg-type]
    assert (n, m) in determined or (n, m) == POOREST and not determined
    assert not determined & {(n + 1, m), (n, m + 1)}
    even = max((k for k in range(most + 1) if (k, k) in determined), default=0)
    assert min(n, m) >= even
    assert bool(beyond) == ((n, m) != (most, most))


def test_changes_of_lengths_are_those_between_fits() -> None:
    experiment = small()
    readings = bp.simulate(experiment)
    found = bp.compare_models(experiment, readings, coefficients=3)
    chosen = experiment.with_({"error_model": found.error_model})
    points = bp.fit(experiment, readings).design.evaluation.points
    first, second = (bp.fit(one, readings).correct(points).points for one in (experiment, chosen))
    i, j = np.triu_indices(len(points), 1)
    change = np.linalg.norm(first[i] - first[j], axis=1) - np.linalg.norm(
        second[i] - second[j], axis=1
    )
    file = next(one for one in found.rungs if one.is_of_file)
    np.testing.assert_allclose(file.change.largest, np.abs(change).max(), atol=1e-12)
    np.testing.assert_allclose(file.change.rms, np.sqrt((change**2).mean()), atol=1e-12)


def test_readings_without_scatter_call_for_their_own_model() -> None:
    """What is left is rounding, of which no richer model explains more."""
    experiment = small()
    made = simulated_readings(experiment, None, True)
    observed = observe(lay_out(experiment), made.readings, made.x)
    found = climb(experiment, observed, False, 4)
    assert found.chosen.model.numbers == (3, 2) and not found.chosen.model.own


def test_knowledge_of_one_models_parameters_is_refused() -> None:
    prior = [{"parameter": "EXX t^1", "value": "0 um", "standard_uncertainty": "1 um"}]
    experiment = small(priors=prior)
    with pytest.raises(ExperimentError, match="remove the priors"):
        compared_models(experiment, simulated(experiment))


def test_two_dimensions() -> None:
    experiment = bp.load("designs/hocken_borchardt/real.yaml", "with scale")
    found = bp.compare_models(experiment, "designs/hocken_borchardt/real-readings.csv")
    assert any(one.is_of_file for one in found.rungs)
    assert all(np.isfinite(one.criteria.bic) for one in found.rungs)


def test_the_richer_of_two_models_is_told() -> None:
    poor, rich = (with_model(lay_out(quickstart()), true_model(k).model) for k in (2, 3))
    assert rich.parameter_count - poor.parameter_count == 9
    one = FittedSum(true_model(2), 100.0, rich.observation_count - poor.parameter_count)
    assert Comparison(True, 1).beaten(one, []).chance == 1.0


def flat(**changed: object) -> Experiment:
    """A plate in one position, in which most errors cannot be told from its pose."""
    position = {
        "name": "z",
        "plane": "z",
        "level": "500 mm",
        "corner": {"x": "100 mm", "y": "90 mm"},
    }
    return bp.experiment(
        {
            "title": "one position",
            "machine": {"volume": ["1 m", "1 m", "1 m"], "repeatability": "0.5 um"},
            "error_model": {"kind": "kinematic", "position_coefficients": 3, "rotation_coefficients": 2},
            "probes": {"down": ["0 mm", "0 mm", "-100 mm"]},
            "artefacts": {"plate": {"kind": "grid", "balls": [5, 5], "size": ["750 mm", "750 mm"]}},
            "positions": [position],
            "calibration": [
                {"kind": "coordinates", "artefact": "plate", "balls": "all",
                 "standard_uncertainty": {"x": "0.3 um", "y": "0.3 um", "z": "0.3 um"}}
            ],
            "evaluation": {"points": {"random": 10, "seed": 1}},
        }
        | changed
    )  # fmt: skip


def test_the_richest_model_of_one_position_is_recommended_with_a_warning() -> None:
    """Nothing richer could be tried, and the file's model is no candidate."""
    experiment = flat()
    found = compared_models(experiment, simulated(experiment))
    chosen = next(one for one in found.rungs if one.is_recommended)
    assert not found.is_none and chosen.beaten.count == 0 and found.lengths.undetermined
    assert any(wording.NOTHING_SHOWS_THAT_IT_IS_RICH in text for text in found.cautions)
    assert found.verdict()[-1].endswith(wording.IS_NOT_DETERMINED_BY_THIS_DESIGN)
    assert "undetermined µm" not in "\n".join(found.lines())
    # A model that asks for less than the others leaves less open, and not a negative number.
    fewer = flat(error_model={"kind": "metric", "scale": "none"})
    rungs = compared_models(fewer, simulated(fewer)).rungs
    own = next(one for one in rungs if one.is_of_file)
    opens = [
        linearise(with_model(lay_out(fewer), model)).deficiency
        for model in (lay_out(fewer).model, kinematic_rung(fewer, 2, 1).model)
    ]
    assert opens[0] < opens[1] and own.undetermined == 0
    assert all(one.undetermined >= 0 for one in rungs)


def test_models_that_the_verdict_names_are_shown() -> None:
    """In this campaign the best of the richer ones is off the way up."""
    experiment = small()
    found = compared_models(experiment, simulated(experiment, 8))
    assert found.beaten.by in found.verdict()[0]
    assert found.beaten.by in {one.model for one in found.rungs}
    # What a table says of the best richer model of each is the F-test of both.
    rows = {row["model"]: row for row in found.rows()}
    compared = 0
    for row in rows.values():
        by = row["best_richer_model"]
        assert (by is None) == (row["richer_models"] == 0)
        if by in rows:
            rich = rows[by]
            more = row["degrees_of_freedom"] - rich["degrees_of_freedom"]
            left = rich["sum_of_squares"] / rich["degrees_of_freedom"]
            ratio = (row["sum_of_squares"] - rich["sum_of_squares"]) / more / left
            least = scipy.stats.f.sf(ratio, more, rich["degrees_of_freedom"])
            expected = min(1.0, row["richer_models"] * least)
            assert row["chance"] == pytest.approx(expected, rel=1e-3, abs=1e-12)
            compared += 1
    assert compared > 0
    counts = [one.parameters for one in found.rungs]
    assert counts == sorted(counts) and len(counts) == len(set(one.model for one in found.rungs))
