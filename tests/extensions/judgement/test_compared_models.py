"""Compared error models: their sums against a dense least squares, their tests against closed
forms, their choice against simulated machines whose coefficients are known.
"""

from __future__ import annotations

import re
from dataclasses import replace
from inspect import signature
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import scipy.stats
from ballplate.extensions.judgement import compared_models as module
from ballplate.extensions.judgement.compared_models import compared_models, first_adequate, fit_rung
from ballplate.extensions.judgement.lack_of_fit import pure_error
from ballplate.extensions.judgement.rungs import (
    MOST_COEFFICIENTS,
    determined_rungs,
    empirical_rung,
    kinematic_rung,
    rung_of_file,
    with_model,
)
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.protocol import Reported
from ballplate.simulator.readings.observed_readings import ObservedReadings, observe
from ballplate.simulator.readings.simulated import simulated_readings
from numpy.typing import NDArray
from scipy.spatial.distance import pdist

from tests.extensions.judgement import wording
from tests.extensions.judgement.model_campaigns import (
    KINDS,
    campaign,
    laid_out,
    quickstart,
    readings_of,
    true_model,
    uncertainties,
)
from tests.reference import dense
from tests.reference.small_quickstart import small_quickstart

Real = NDArray[np.float64]


def small(**changed: object) -> Experiment:
    """Nine balls in six positions."""
    points = {"points": {"random": 20, "seed": 3}, "probe": "down"}
    return small_quickstart(**{"evaluation": points, **changed})


def simulated(experiment: Experiment, seed: int = 1) -> ObservedReadings:
    made = simulated_readings(experiment, seed)
    return observe(lay_out(experiment), made.readings, made.x)


def dense_sum(observed: ObservedReadings, position: int, rotation: int) -> tuple[float, int]:
    """S^2 and the number of parameters of a dense fit."""
    problem = replace(dense.planned(observed.design, position, rotation), scales=observed.x)
    for _ in range(3):
        step, _ = dense.least_squares_step(problem)
        balls, rotations, origins, a = dense.unpack(problem, step)
        problem = replace(problem, balls=balls, rotations=rotations, origins=origins, a=a)
    return float((dense.residuals(problem, np.zeros(problem.parameters)) ** 2).sum()), (
        problem.parameters
    )


def test_tests_and_criteria_are_those_of_dense_fits() -> None:
    experiment = small()
    observed = simulated(experiment)
    n, found = observed.design.observation_count, {}
    for numbers in ((2, 1), (3, 2), (4, 3)):
        square, parameters = dense_sum(observed, *numbers)
        fit = found[numbers] = fit_rung(experiment, observed, kinematic_rung(experiment, *numbers))
        np.testing.assert_allclose(fit.sum_of_squares, square, rtol=1e-5)
        assert fit.degrees_of_freedom == n - parameters
        for given in (False, True):
            minus_twice = square if given else n * np.log(square / n)
            expected = minus_twice + np.log(n) * (parameters + (not given))
            np.testing.assert_allclose(fit.bic(given), expected, rtol=1e-5)
    small_, large = found[3, 2], found[4, 3]
    more = small_.degrees_of_freedom - large.degrees_of_freedom
    gained = small_.sum_of_squares - large.sum_of_squares
    ratio = gained / more / (large.sum_of_squares / large.degrees_of_freedom)
    expected = scipy.stats.f.sf(ratio, more, large.degrees_of_freedom)
    np.testing.assert_allclose(small_.chance(large, False), expected, rtol=1e-9)
    expected = scipy.stats.chi2.sf(gained, more)
    np.testing.assert_allclose(small_.chance(large, True), expected, rtol=1e-9)


def recommended(kind: int, number: int) -> str:
    """The recommended model of a campaign, without the search for structure in its residuals."""
    observed = campaign(kind, number)
    models, _ = determined_rungs(quickstart(), observed.design, 7)
    fits = [fit_rung(quickstart(), observed, model) for model in models]
    return first_adequate(fits, False).model.words


@pytest.mark.parametrize("kind", [1, pytest.param(5, marks=pytest.mark.long)])
def test_the_true_model_is_recommended(kind: int) -> None:
    assert recommended(kind, 0) == true_model(kind).words


@pytest.mark.long
@pytest.mark.parametrize("kind", range(len(KINDS)))
def test_the_true_model_is_recommended_in_nine_of_ten_campaigns(kind: int) -> None:
    chosen = [recommended(kind, number) for number in range(50)]
    assert chosen.count(true_model(kind).words) >= 45


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
    (line,) = (line for line in result.lines() if line.startswith("standard deviation of rep"))
    assert f": {np.sqrt(square / found.degrees_of_freedom):.3g} times the stated one" in line
    assert line.endswith(f"{chosen.model}: p-value {expected:.2g}")


def test_what_the_design_cannot_determine_is_no_candidate() -> None:
    """Three balls along each side in six positions tell no more than a few coefficients, of which
    the first that are too many leave something undetermined.
    """
    experiment = small()
    design = lay_out(experiment)
    models, beyond = determined_rungs(experiment, design, 8)
    assert len(beyond) == 2
    assert kinematic_rung(experiment, 3, 2) in models
    for model in models:
        assert linearise(with_model(design, model.model)).deficiency == 0
    most = max(model.count for model in models if model.words.startswith("kinematic"))
    (first,) = (
        model
        for model in (kinematic_rung(experiment, n, n) for n in range(2, 9))
        if f"{model.words} or more" in beyond.values()
    )
    at = linearise(with_model(design, first.model))
    left = at.design.observation_count - at.design.parameter_count
    assert first.count > most and (at.deficiency > 0 or left <= 0)


def test_every_number_of_coefficients_is_tried() -> None:
    models, beyond = determined_rungs(quickstart(), laid_out(), 5)
    kinematic = [(2, 1), *((count, count) for count in (2, 3, 4, 5))]
    assert not beyond and {(type(one.model).__name__, one.numbers) for one in models} == {
        *(("KinematicModel", numbers) for numbers in kinematic),
        *(("EmpiricalModel", (count, count)) for count in (3, 4, 5)),
    }


def test_models_contain_those_of_their_kind_with_fewer_coefficients() -> None:
    kinematic = [kinematic_rung(quickstart(), *numbers) for numbers in ((2, 1), (3, 2), (4, 1))]
    empirical = [empirical_rung(quickstart(), count) for count in (3, 4)]
    found = {
        (outer.words, inner.words)
        for outer in (*kinematic, *empirical)
        for inner in (*kinematic, *empirical)
        if outer.contains(inner)
    }
    straight, even, uneven = (model.words for model in kinematic)
    assert found == {
        (even, straight),
        (uneven, straight),
        ("empirical, 4 coefficients", "empirical, 3 coefficients"),
    }


def test_readings_without_scatter_call_for_their_own_model() -> None:
    """What is left is rounding, of which no richer model explains more."""
    experiment = small()
    made = simulated_readings(experiment, None, True)
    observed = observe(lay_out(experiment), made.readings, made.x)
    assert compared_models(experiment, observed, most=4).recommended == (
        "kinematic, 3 and 2 coefficients"
    )


def test_knowledge_of_one_models_parameters_is_refused() -> None:
    prior = [{"parameter": "EXX t^1", "value": "0 um", "standard_uncertainty": "1 um"}]
    experiment = small(priors=prior)
    with pytest.raises(ExperimentError, match="remove the priors"):
        compared_models(experiment, simulated(experiment))


def test_two_dimensions() -> None:
    experiment = bp.load("designs/hocken_borchardt/real.yaml", "with scale")
    found = bp.compare_models(experiment, "designs/hocken_borchardt/real-readings.csv")
    assert any(one.is_of_file for one in found.rungs)
    assert all(np.isfinite(one.bic) for one in found.rungs)


def flat(**changed: object) -> Experiment:
    """A plate in one position, in which most errors cannot be told from its pose."""
    known = {"x": "0.3 um", "y": "0.3 um", "z": "0.3 um"}
    corner = {"x": "100 mm", "y": "90 mm"}
    one = {"name": "z", "plane": "z", "level": "500 mm", "corner": corner, "probes": ["down"]}
    given = {"kind": "coordinates", "balls": "all", "standard_uncertainty": known}
    plate = {"kind": "grid", "balls": [5, 5], "size": ["750 mm", "750 mm"]}
    sections = {"artefacts": {"plate": plate}, "positions": [one], "calibration": [given]}
    exact = {"probes": {"down": ["0 mm", "0 mm", "-100 mm"]}, "true_machine": {"kind": "zero"}}
    return small(**{**sections, **exact, "machine.repeatability": "0.5 um", **changed})


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


def kinematic(position: int, rotation: int) -> dict[str, Any]:
    numbers = {"position_coefficients": position, "rotation_coefficients": rotation}
    return {"kind": "kinematic", **numbers}


@pytest.mark.parametrize(
    ("sigma", "model", "words"),
    [
        ("estimated", kinematic(2, 1), wording.IS_TOO_SMALL),
        ("given", kinematic(5, 5), wording.HAS_MORE_PARAMETERS),
        ("estimated", {"kind": "metric"}, wording.IS_NOT_NESTED),
    ],
)
def test_text_and_data_say_what_the_fits_say(sigma: Any, model: Any, words: str) -> None:
    """The p-value of a model is that of its best larger one."""
    experiment, readings = small(error_model=model), bp.simulate(small(), 8)
    found = bp.compare_models(experiment, readings, sigma, 5)
    rows, compared = {row["model"]: row for row in found.rows()}, 0
    (chosen,) = (row for row in rows.values() if row["recommended"])
    (file,) = (row for row in rows.values() if row["of_the_file"])
    for line, row in zip(found.lines()[4:], rows.values(), strict=False):
        freedom, square, by = (
            row[name] for name in ("degrees_of_freedom", "sum_of_squares", "best_richer_model")
        )
        assert (by is None) == (row["richer_models"] == 0) == (row["chance"] is None)
        chances = {}
        for name, rich in rows.items():
            mine, its = (
                re.findall(r"kinematic|empirical|\d+", one) for one in (row["model"], name)
            )
            is_larger = mine[:1] == its[:1] != [] and rich["parameters"] > row["parameters"]
            if not is_larger or any(
                int(m) > int(n) for m, n in zip(mine[1:], its[1:], strict=True)
            ):
                continue
            more, gain = freedom - rich["degrees_of_freedom"], square - rich["sum_of_squares"]
            left = rich["sum_of_squares"] / rich["degrees_of_freedom"]
            chances[name] = scipy.stats.chi2.sf(gain, more)
            if sigma == "estimated":
                of_f = (gain / more / left, more, rich["degrees_of_freedom"])
                chances[name] = scipy.stats.f.sf(*of_f)
        assert len(chances) == row["richer_models"]
        if chances:
            best = min(chances.values())
            expected = min(1.0, len(chances) * best)
            assert row["chance"] == pytest.approx(expected, rel=1e-3, abs=1e-12)
            assert chances[by] == pytest.approx(best, rel=1e-3, abs=1e-12)
            compared += 1
        chance = row["chance"]
        p = "-" if chance is None else "<1e-06" if chance < 1e-6 else f"{chance:.2g}"
        least_bic = min(one["bic"] for one in rows.values())
        shown = line.removeprefix(row["model"]).partition("<-")[0].split()
        assert shown[:5] == [
            *(str(row["parameters"]), str(freedom), f"{np.sqrt(square / freedom):.4g}"),
            *(p, f"{row['bic'] - least_bic:.1f}"),
        ]
        changes = [1e6 * row[name] for name in ("largest_change", "rms_change")]
        assert list(map(float, shown[5:])) == pytest.approx(changes, rel=5e-3)
        marks = ["recommended"] * row["recommended"]
        marks += ["the file's"] * (row["of_the_file"] and model["kind"] != "metric")
        assert line.partition("<- ")[2] == ", ".join(marks)
    assert compared > 3
    counts = [row["parameters"] for row in rows.values()]
    assert counts == sorted(counts) and found.beaten.by in found.verdict()[0]
    words = words.format(by=file["best_richer_model"], apart=file["bic"] - chosen["bic"])
    own = file["model"].removeprefix("the file's, ")
    changed = float(found.verdict()[1].split()[-3])
    assert found.verdict()[1].startswith(f"the file's error model, {own}, {words}")
    assert changed == pytest.approx(1e6 * file["rms_change"], rel=5e-3)
    # What it says of the recommended model's lengths is what a fit with it says.
    with_chosen = experiment.with_({"error_model": found.error_model})
    fits = [bp.fit(one, readings, sigma=sigma) for one in (experiment, with_chosen)]
    points, u6 = fits[0].design.evaluation.points, fits[1].quantities["U6"]
    change = np.subtract(*(pdist(fit.correct(points).points) for fit in fits))
    changes = [np.abs(change).max(), np.sqrt((change**2).mean())]
    assert [file["largest_change"], file["rms_change"]] == pytest.approx(changes, abs=1e-12)
    (line,) = (line for line in found.lines() if line.startswith("for comparison"))
    figures = [2e6 * u6.maximum, 2e6 * u6.average]
    assert re.findall(r"([\d.]+) µm", line) == [f"{figure:#.3g}" for figure in figures]
    assert found.to_dict()["lengths"]["maximum"] == pytest.approx(u6.maximum, rel=1e-5)


def test_the_command_tries_as_many_coefficients_as_python() -> None:
    assert signature(bp.compare_models).parameters["coefficients"].default == MOST_COEFFICIENTS


def test_a_file_that_explains_the_readings_is_not_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    experiment, observed = quickstart(), simulated(quickstart())
    fit = fit_rung(experiment, observed, rung_of_file(experiment, observed.design.model))
    monkeypatch.setattr(module, "diagnosed", None)
    assert module._mistakes(fit, observed.x, is_given=True) == ()
