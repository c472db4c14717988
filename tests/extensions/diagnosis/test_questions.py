"""Assumptions that readings contradict are named, and what they say of the others is right."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.diagnosis import score_tests
from ballplate.extensions.diagnosis.cause_search import Search, explained_by
from ballplate.extensions.judgement.compared_models import compared_models
from ballplate.results.fits import Fit
from ballplate.results.fitting import fit
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.readings.observed_readings import observe
from ballplate.simulator.readings.simulated import simulated_readings

from tests.extensions.diagnosis.campaigns import (
    CAUSES,
    DESIGNS,
    QUICKSTART,
    Campaign,
    Rates,
    campaigns,
    rates,
    visible,
)
from tests.extensions.diagnosis.designs import PLANE, experiment

CHAIN = "the arrangement of the axes is"


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    """The quickstart with a bar as its second certificate."""
    return experiment(tmp_path_factory.mktemp("designs"), DESIGNS["quickstart"])


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    """The quickstart."""
    return experiment(tmp_path_factory.mktemp("plain"), QUICKSTART)


def large(given: Experiment, cause: str, seed: int = 1) -> Campaign:
    """A campaign whose cause is well above what is noticed."""
    return next(one for one in campaigns(given, cause, 20, seed) if visible(given, one) > 3.0)


def answered(given: Experiment, campaign: Campaign) -> Fit:
    found = fit(given, campaign.observed)
    assert found.assumptions is not None
    return found


@pytest.mark.parametrize("cause", [cause for cause in CAUSES if cause != "none"])
def test_the_assumption_that_fails_is_named(given: Experiment, cause: str) -> None:
    campaign = large(given, cause)
    found = answered(given, campaign)
    (words,) = found.assumptions.verdict
    assert campaign.name in words
    assert any(words in caution or "see what" in caution for caution in found.cautions)
    assert not any("try a larger error model" in text for text in (*found.lines(), *found.cautions))


def test_readings_that_agree_contradict_nothing(given: Experiment) -> None:
    (campaign,) = campaigns(given, "none", 1, 5)
    found = answered(given, campaign)
    assert found.assumptions.verdict == ()
    assert not any("contradict" in line for line in found.lines())


def test_score_tests_agree_with_fits_that_allow_for_the_cause(given: Experiment) -> None:
    """What a cause explains to first order is what S^2 loses in a fit with its parameters."""
    campaign = large(given, "temperature")
    design, x = campaign.observed.design, campaign.observed.x
    at = linearised_fit(design, estimate(design, x))
    search = Search(at, x, at.degrees_of_freedom, True)
    checked = 0
    for each in score_tests.tested(search):
        wider = each.cause.design
        if each.cause.parameters and each.dimensions and wider is not None:
            solution = estimate(wider, x)
            loss = at.factor.sum_of_squares - solution.factor.sum_of_squares
            explained, dimensions = explained_by(search.start, each.basis)
            assert dimensions == each.dimensions
            assert explained == pytest.approx(loss, rel=2e-3, abs=0.02), each.cause.words
            checked += 1
    assert checked > 15


def test_what_can_be_noticed_is_in_units_of_the_uncertainty_of_a_fit(given: Experiment) -> None:
    campaign = large(given, "certificate")
    design, x = campaign.observed.design, campaign.observed.x
    at = linearised_fit(design, estimate(design, x))
    search = Search(at, x, at.degrees_of_freedom, True)
    for each in score_tests.tested(search):
        wider = each.cause.design
        if wider and each.cause.assumed in ("certificates", "temperature of artefacts", "sag"):
            of_fit = linearised_fit(wider, estimate(wider, x))
            rows = np.eye(len(of_fit.layout))[of_fit.layout.influences]
            _, found, hidden = each.combinations(search.start)
            assert not len(hidden)
            assert found == pytest.approx(of_fit.of_shared(rows), rel=1e-3), each.cause.words


def test_size_and_u6_are_those_of_the_file_that_states_the_cause(plain: Experiment) -> None:
    given, campaign = plain, large(plain, "temperature")
    (said,) = answered(given, campaign).assumptions.contradicted
    position = campaign.name.rpartition("position ")[2]
    stated = given.with_({"influences": [{"kind": "position scale", "positions": [position]}]})
    readings = campaign.observed.design.readings
    right = fit(stated, observe(lay_out(stated), readings, campaign.observed.x))
    estimated = right[f"scale in {position}"]
    (size,) = said.sizes
    assert size.value == pytest.approx(estimated.value, rel=1e-9)
    assert size.standard_uncertainty == pytest.approx(estimated.standard_uncertainty, rel=1e-9)
    lengths = right.quantities["U6"]
    assert said.lengths == pytest.approx((lengths.average, lengths.maximum), rel=1e-9)
    assert said.times == pytest.approx(right.sigma, rel=1e-9)


def test_a_gross_error_is_no_assumption(given: Experiment) -> None:
    """Nor does it hide one."""
    for cause in ("none", "certificate"):
        campaign = next(campaigns(given, "none", 1, 3)) if cause == "none" else large(given, cause)
        x = campaign.observed.x.copy()
        x[37, 1] += 20e-6
        found = fit(given, replace(campaign.observed, x=x))
        assert found.assumptions is not None and found.diagnosis
        assert len(found.diagnosis.suspects) == (1 if cause == "none" else 2)
        assert [campaign.name in words for words in found.assumptions.verdict] == (
            [] if cause == "none" else [True]
        )


def test_causes_that_readings_cannot_tell_apart_are_named_together(given: Experiment) -> None:
    """Two probes that are always read together in positions of their own."""
    campaign = next(
        one
        for one in campaigns(given, "tip", 30, 2)
        if one.name.endswith(("left", "right")) and visible(given, one) > 3.0
    )
    (words,) = answered(given, campaign).assumptions.verdict
    assert "offset of probe left" in words and "offset of probe right" in words


def test_what_readings_cannot_show_is_listed(plain: Experiment, tmp_path: Path) -> None:
    """One certificate cannot show that its own scale is wrong, nor a single probe its offset."""
    text = QUICKSTART.replace("[right, left]", "[right]").replace("[back, front]", "[back]")
    single = experiment(tmp_path, text)
    for given, assumed, words in (
        (single, "certificates", "scale of the certificate of plate"),
        (plain, "tips", "offset of probe down"),
    ):
        found = bp.fit(given, bp.simulate(given)).assumptions
        assert found is not None
        (answer,) = (answer for answer in found.asked if answer.assumed == assumed)
        assert words in answer.not_seen[0]
        text = "\n".join(found.lines())
        assert words in text and "nan" not in text
    (answer,) = (answer for answer in found.asked if answer.assumed == "tips")
    assert answer.tests == 4
    assert json.loads(json.dumps(bp.fit(single, bp.simulate(single)).to_dict()))["assumptions"]


def test_stated_influences_are_not_asked_again(plain: Experiment) -> None:
    stated = plain.with_(
        {"influences": [{"kind": "drift", "axes": {"standard_uncertainty": "0.3 um/h"}}]}
    )
    (campaign,) = campaigns(stated, "none", 1, 1)
    words = [answer.assumed for answer in answered(stated, campaign).assumptions.asked]
    assert "sag" in words
    asked = answered(plain, next(campaigns(plain, "none", 1, 1))).assumptions.asked
    assert "drift" in [answer.assumed for answer in asked]


def test_the_verdict_is_in_the_map_and_in_what_uses_it(given: Experiment, tmp_path: Path) -> None:
    campaign = large(given, "chain")
    fitted = answered(given, campaign).to_map()
    bp.write_map(fitted, tmp_path / "map.yaml")
    again = bp.load_map(tmp_path / "map.yaml")
    assert again.lack_of_fit == fitted.lack_of_fit
    assert again.lack_of_fit is not None
    (words,) = again.lack_of_fit.contradicted
    assert campaign.name in words
    assert f"contradict the experiment: {words}" in again.lack_of_fit.caution


def test_a_plane_and_a_design_without_redundancy(tmp_path: Path) -> None:
    plane = experiment(tmp_path, PLANE)
    found = bp.fit(plane, bp.simulate(plane)).assumptions
    assert found is not None and found.verdict == ()
    assert "sag" not in [answer.assumed for answer in found.asked]
    few = load(Path("designs/certified/one-position.yaml"))[0]
    fit_of_few = bp.fit(few, bp.simulate(few))
    if fit_of_few.degrees_of_freedom < 3:
        assert fit_of_few.assumptions is None


def test_another_arrangement_before_larger_models(given: Experiment) -> None:
    campaign = large(given, "chain")
    found = compared_models(given, campaign.observed, most=4)
    assert found.is_none and found.to_dict()["recommended"] is None
    assert CHAIN in found.verdict()[0] and campaign.name in found.verdict()[0]
    assert "pitch" not in " ".join(found.lines())


def test_fit_of_another_arrangement_is_that_of_the_right_file(given: Experiment) -> None:
    campaign = large(given, "chain")
    (said,) = answered(given, campaign).assumptions.contradicted
    file = given.with_({"error_model.arrangement": campaign.name})
    readings = campaign.observed.design.readings
    right = fit(file, observe(lay_out(file), readings, campaign.observed.x))
    assert said.times == pytest.approx(right.sigma, rel=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("cause", CAUSES)
@pytest.mark.parametrize("name", DESIGNS)
def test_rates_of_naming_causes(
    name: str, cause: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A hundred campaigns of each cause, seven hundred without one, in each design."""
    given = experiment(tmp_path, DESIGNS[name])
    found = rates(given, cause, 100 if cause != "none" else 700)
    with capsys.disabled():
        print("", f"{name}, {cause}", *found.lines(), *found.failures, sep="\n  ")
    allowed = score_tests.LEVEL if cause == "none" else 0.02
    assert found.every["wrong"] <= allowed * found.every.total() + _scatter(found, allowed)
    assert found.large["right"] >= 0.9 * found.large.total()


def _scatter(found: Rates, share: float) -> float:
    """Two standard deviations of a count."""
    return 2.0 * float(np.sqrt(share * found.every.total())) if share == score_tests.LEVEL else 0.0


@pytest.mark.long
def test_rates_of_naming_the_arrangement(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Readings of each arrangement with the quickstart's design, fitted as each other one."""
    given = experiment(tmp_path, Path("designs/quickstart.yaml").read_text(encoding="utf-8"))
    every, wrong, right = 0, 0, 0
    for number, true in enumerate(ARRANGEMENTS):
        readings = simulated_readings(
            given.with_({"error_model.arrangement": true, "seed": number + 1})
        )
        for stated in ARRANGEMENTS:
            if ARRANGEMENTS[stated] == ARRANGEMENTS[true]:
                continue
            file = given.with_({"error_model.arrangement": stated})
            found = fit(file, observe(lay_out(file), readings.readings, readings.x)).assumptions
            named = " ".join(found.verdict) if found else ""
            every, right = every + 1, right + (true in named)
            wrong += bool(named) and true not in named
    with capsys.disabled():
        print(f"\nthe right arrangement: {right} of {every}; another one only: {wrong}")
    assert wrong <= 0.02 * every and right >= 0.9 * every
