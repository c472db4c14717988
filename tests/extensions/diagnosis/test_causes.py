"""What the readings contradict is named, and what a fit prints of it is right."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.diagnosis.assumptions_tested import assumptions_tested
from ballplate.extensions.diagnosis.cause_search import FAMILY, Search
from ballplate.extensions.diagnosis.findings import Finding
from ballplate.extensions.diagnosis.power import noncentrality
from ballplate.extensions.judgement.compared_models import compared_models
from ballplate.results.fitting import fit
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.readings.observed_readings import observe
from ballplate.simulator.readings.simulated import simulated_readings

from tests.extensions.diagnosis.campaigns import (
    ASSUMED,
    DESIGNS,
    ERRORS,
    GROSS,
    OF_MODEL,
    QUICKSTART,
    Campaign,
    World,
    campaign,
    loaded,
    random_designs,
    rates,
)
from tests.extensions.diagnosis.designs import PLANE, PLATE, experiment


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> World:
    """Nine balls, with a bar as second certificate."""
    return World(loaded(tmp_path_factory.mktemp("designs"), DESIGNS["few balls"]))


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> World:
    """The same without the bar."""
    return World(experiment(tmp_path_factory.mktemp("plain"), PLATE))


def large(world: World, error: str, first: int = 0) -> Campaign:
    """A campaign with an error of three times the size that is found."""
    drawn = (campaign(world, error, seed, 3.0) for seed in range(first, first + 20))
    return next(one for one in drawn if one is not None)


def contradicted(world: World, case: Campaign) -> list[Finding]:
    found = fit(world.given, case.observed)
    assert found.diagnosis is not None
    return list(found.diagnosis.findings)


@pytest.mark.parametrize("error", [*GROSS, *ASSUMED])
def test_a_large_error_is_named(world: World, error: str) -> None:
    case = large(world, error)
    (truth, *_) = case.truth
    design = world.design
    found = contradicted(world, case)[0]
    names = {
        "probe": design.probes.names,
        "expansion": design.positions.names,
        "scatter": design.positions.names,
        "slip": design.positions.names,
        "scale": design.artefacts.names,
        "chain": {truth[-1]: truth[-1]},
        "drift": {truth[-1]: "drift"},
    }
    subject = truth[1] if len(truth) == 3 else truth[-1]
    if error in names:
        assert names[error][subject] in found.verdict
    else:
        readings = case.observed.design.readings
        assert design.ball_label(int(readings.ball[subject])) in found.verdict
        assert design.positions.names[readings.position[subject]] in found.verdict
    assert found.p_value < FAMILY and found.is_gross == (error in GROSS and error != "scatter")


def test_readings_that_agree_contradict_nothing(world: World) -> None:
    found = fit(world.given, large(world, "none").observed)
    assert not found.diagnosis and found.lack_of_fit.contradicted == ()
    assert "the readings contradict nothing" in found.lines()


def test_the_table_has_sizes_sigma_and_what_to_do(plain: World) -> None:
    """Printed figures are those of a fit of the file that states the cause."""
    case = large(plain, "expansion")
    ((_, position),) = case.truth
    name = plain.design.positions.names[position]
    found = fit(plain.given, case.observed)
    (said,) = found.diagnosis.findings
    (size,) = said.sizes
    influence = {"kind": "position scale", "positions": [name]}
    stated = plain.given.with_({"influences": [influence]})
    design = lay_out(stated)
    right = fit(stated, observe(design, case.observed.design.readings, case.observed.x))
    estimated = right[f"scale in {name}"]
    assert size.value == pytest.approx(estimated.value, rel=1e-3)
    assert size.standard_uncertainty == pytest.approx(estimated.standard_uncertainty, rel=1e-3)
    assert said.sigma == pytest.approx(right.sigma, rel=1e-3)
    lines = found.lines()
    head = next(k for k, line in enumerate(lines) if line.startswith("contradicted"))
    value, u = 1e6 * size.value, 1e6 * size.standard_uncertainty
    row = lines[head + 1]
    assert row.startswith(f"size of plate in position {name}") and row.endswith(said.cure)
    assert f"{value:.3g} ± {u:.2g} ppm" in row and f"{said.sigma:.3g}" in row
    data = json.loads(json.dumps(found.to_dict()))["diagnosis"]["contradicted"][0]
    assert data["sizes"][0]["value"] == size.value and data["words"] == said.words
    assert data["p_value"] == said.p_value < 1e-6 and "<1e-06" in row


def test_lines_of_the_file_are_named(tmp_path: Path) -> None:
    """A slip in the middle of a position, and one wrong reading."""
    given = bp.quickstart()
    readings = bp.simulate(given)
    low = np.flatnonzero(readings["position"] == "z low")
    readings.loc[low[12:], "y_mm"] += 0.001
    readings.loc[129, "x_mm"] -= 0.0015
    readings.to_csv(tmp_path / "readings.csv", index=False)
    found = bp.fit(given, tmp_path / "readings.csv").diagnosis
    wrong, slipped = sorted(found.findings, key=lambda one: one.kind)
    assert wrong.cure == "check or leave out line 131 of readings.csv" and wrong.lines == (131,)
    assert wrong.sizes[0].value == pytest.approx(-1.5e-6, abs=4e-7)
    assert "slipped in position z low between lines 1" in slipped.cause
    assert "y" in [size.name for size in slipped.sizes] and found.gross_errors == 2


def test_two_errors_are_both_named(world: World) -> None:
    case = large(world, "scale")
    x = case.observed.x.copy()
    x[37, 1] += 20e-6
    found = contradicted(world, replace(case, observed=replace(case.observed, x=x)))
    assert [one.kind for one in found] == ["reading", "scale"]
    values = [size.value for size in found[0].sizes if size.name == "y"]
    assert values == [pytest.approx(20e-6, abs=2e-6)]


def test_causes_that_readings_cannot_tell_apart_are_named_together(world: World) -> None:
    """Two probes that are always read together in positions of their own."""
    seeds = (seed for seed in range(30) if large(world, "probe", seed).truth == {("probe", 1)})
    (found, *_) = contradicted(world, large(world, "probe", next(seeds)))
    assert {"offset of probe right", "offset of probe left"} <= {found.cause, *found.others}


def test_what_is_noticed_is_in_units_of_the_uncertainty_of_a_fit(plain: World) -> None:
    case = large(plain, "none")
    at = linearised_fit(case.observed.design, estimate(case.observed.design, case.observed.x))
    search = Search(at, case.observed.x, False)
    given = plain.given.with_({"influences": [{"kind": "sag", "artefact": "plate"}]})
    design = lay_out(given)
    stated = observe(design, case.observed.design.readings, case.observed.x).design
    of_fit = linearised_fit(stated, estimate(stated, case.observed.x))
    u = float(of_fit.of_shared(np.eye(len(of_fit.layout))[of_fit.layout.influences])[0])
    (answer,) = (one for one in assumptions_tested(search) if one.assumed == "sag")
    least = noncentrality(np.exp(search.other_limit), 0.8)
    assert answer.noticed_from == pytest.approx(least * u, rel=1e-3)


def test_what_readings_cannot_show_is_listed(tmp_path: Path) -> None:
    """One certificate cannot show that its own scale is wrong, nor a single probe its offset."""
    text = QUICKSTART.replace("[right, left]", "[right]").replace("[back, front]", "[back]")
    single, plain = experiment(tmp_path, text), bp.quickstart()
    for given, assumed, words in (
        (single, "certificates", "scale of the certificate of plate"),
        (plain, "tips", "offset of probe down"),
    ):
        found = bp.fit(given, bp.simulate(given))
        (answer,) = (one for one in found.diagnosis.tested if one.assumed == assumed)
        assert any(words in hidden for hidden in answer.not_seen)
        text = "\n".join(found.diagnosis.lines())
        assert words in text and "nan" not in text


def test_stated_influences_are_not_tested_again() -> None:
    drift = {"kind": "drift", "axes": {"standard_uncertainty": "0.3 um/h"}}
    plain = bp.quickstart()
    for given, is_tested in ((plain, True), (plain.with_({"influences": [drift]}), False)):
        found = bp.fit(given, bp.simulate(given)).diagnosis
        (answer,) = (one for one in found.tested if one.assumed == "drift")
        assert np.isfinite(answer.noticed_from) == is_tested


def test_a_plane_and_a_design_without_redundancy(tmp_path: Path) -> None:
    plane = experiment(tmp_path, PLANE)
    found = bp.fit(plane, bp.simulate(plane)).diagnosis
    assert not found and "sag" not in [answer.assumed for answer in found.tested]
    few = load(Path("designs/certified/one-position.yaml"))[0]
    fit_of_few = bp.fit(few, bp.simulate(few))
    assert fit_of_few.degrees_of_freedom >= 3 or not fit_of_few.diagnosis.tested


def test_another_arrangement_is_in_the_map_and_before_larger_models(
    world: World, tmp_path: Path
) -> None:
    case = large(world, "chain")
    ((_, name),) = case.truth
    found = fit(world.given, case.observed)
    (said, *_) = found.diagnosis.findings
    right = world.given.with_({"error_model.arrangement": name})
    observed = observe(lay_out(right), case.observed.design.readings, case.observed.x)
    assert said.sigma == pytest.approx(fit(right, observed).sigma, rel=1e-6)
    bp.write_map(found.to_map(), tmp_path / "map.yaml")
    again = bp.load_map(tmp_path / "map.yaml").lack_of_fit
    assert again is not None and name in again.contradicted[0]
    assert f"contradict the experiment: {again.contradicted[0]}" in again.caution
    models = compared_models(world.given, case.observed, most=4)
    assert models.is_none and name in models.verdict()[0]


@pytest.mark.parametrize("offset", [["-50 mm", "0 mm", "0 mm"], ["50 mm", "0.3 mm", "0 mm"]])
def test_an_offset_that_is_far_off_is_named(offset: list[str], tmp_path: Path) -> None:
    given = experiment(tmp_path, DESIGNS["few balls"])
    made = simulated_readings(given.with_({"probes.right": offset}), 4)
    found = fit(given, observe(lay_out(given), made.readings, made.x)).diagnosis
    assert "offset of probe right" in found.findings[0].verdict
    assert found.findings[0].sigma == pytest.approx(1.0, abs=0.3)


@pytest.mark.long
def test_rates_of_naming_causes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Eight campaigns of each error, on each of eleven designs; thirty of none."""
    designs = [loaded(tmp_path, text) for text in DESIGNS.values()]
    designs += [one for _, one in random_designs(tmp_path, 3)]
    worlds = [World(given) for given in designs]
    every: Counter[str] = Counter()
    for error in ERRORS:
        count = 30 if error == "none" else 8
        found = sum((rates(world, error, count) for world in worlds), Counter[str]())
        with capsys.disabled():
            print(f"\n{error}: {dict(found)}")
        if error == "none":
            assert found.total() - found["silent"] <= 0.02 * found.total()
            continue
        every += found
        if error not in (*OF_MODEL, "drift", "chain", "scatter"):
            assert found["large right"] >= 0.9 * found["large"]
    named = sum(every[word] for word in ("right", "model", "silent", "wrong"))
    assert every["wrong"] <= 0.04 * named
