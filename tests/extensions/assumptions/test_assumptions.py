"""Assumptions of a prediction: each row is what `run` gives of the file with its entries."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.cli import main
from ballplate.extensions.assumptions.effects import Assumptions
from ballplate.simulator.readings.simulated import simulated_readings

from tests.reference.random_experiments import ARRANGEMENTS, random_text
from tests.reference.small_quickstart import small_quickstart, small_sections

TOP = Path(__file__).parents[3]


def with_entries(path: Path, entries: str) -> Path:
    """The file with some of its entries replaced."""
    changed = yaml.safe_load(path.read_text(encoding="utf-8")) | yaml.safe_load(entries)
    other = path.with_name("changed.yaml")
    other.write_text(yaml.safe_dump(changed, sort_keys=False), encoding="utf-8")
    return other


def agree(path: Path) -> int:
    """Compare all rows of a file with runs of the file with their entries; return their number."""
    experiment = bp.load(path)
    quantities = bp.run(experiment).quantities
    if "U6" not in quantities or np.isnan(quantities["U6"].average):
        return 0
    table = bp.assumptions(experiment)
    for effect in table.effects:
        if effect.assumption.is_systematic:
            continue
        lengths = bp.run(with_entries(path, effect.entries))["U6"]
        for word in ("average", "maximum"):
            own = getattr(effect, word)
            assert own == pytest.approx(getattr(lengths, word), rel=1e-9, nan_ok=True), effect
        assert effect.undetermined == lengths.undetermined
    order = [(effect.undetermined, effect.ratio) for effect in table.effects]
    assert order == sorted(order, reverse=True)
    return len(table.effects)


def random_sections(seed: int) -> dict[str, Any]:
    """A design of full rank with random coefficients, chain, certificate and influences."""
    draw = np.random.default_rng(seed)
    grown = {"pairs": "corner sides", "standard_uncertainty": "0.1 um + 1 um/m"}
    calibration = [
        {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.3 um"},
        {"kind": "distances", **grown},
        {"kind": "coordinates", "standard_uncertainty": {"x": "0.2 um", "y": "0.4 um"}},
        {"kind": "distances", **grown, "common": "0.2 um + 1 ppm"},
    ][seed % 4]
    counts = draw.integers(2, 5, 2).tolist()
    model = {"kind": "kinematic", "arrangement": str(draw.choice(ARRANGEMENTS))}
    model |= dict(zip(("position_coefficients", "rotation_coefficients"), counts, strict=True))
    sections = small_sections(6, seed, calibration=[calibration], error_model=model)
    sections["machine"]["repeatability"] = [f"{u} um" for u in draw.uniform(0.1, 1.0, 3).round(3)]
    if seed % 3 == 0:
        sections["influences"] = [{"kind": "drift", "axes": {"standard_uncertainty": "1 um/h"}}]
    if seed % 5 == 0:
        sections["probes"]["down"] = {"offset": ["0 mm", "0 mm", "-90 mm"], "reference": True}
    if seed % 7 == 1:
        # Heavier than readings by more than plain transformations keep apart.
        sections["calibration"].append({**calibration, "standard_uncertainty": "0.01 nm"})
    if seed % 2 == 0:
        sections["head"] = {"tip": ["0 mm", "0 mm", "-50 mm"]}
    return sections


@pytest.mark.parametrize("first", [0, *(pytest.param(k, marks=pytest.mark.long) for k in (10, 20))])
def test_rows_are_runs_of_the_file_with_their_entries(first: int, tmp_path: Path) -> None:
    path = tmp_path / "e.yaml"
    for seed in range(first, first + 10):
        text = yaml.safe_dump(random_sections(seed), sort_keys=False)
        path.write_text(text, encoding="utf-8")
        assert agree(path) >= 5


def test_rows_of_designs_that_determine_some_lengths(tmp_path: Path) -> None:
    path, rows = tmp_path / "e.yaml", 0
    for seed in range(15):
        path.write_text(random_text(seed), encoding="utf-8")
        rows += agree(path)
    assert rows > 8


def test_a_plan_has_the_table_of_its_choice(tmp_path: Path) -> None:
    corners = {"x": ["50 mm"], "y": ["50 mm"]}
    places = {"planes": ["z"], "levels": ["100 mm", "400 mm"], "corners": corners}
    better = {"kind": "distances", "pairs": "corner diagonals", "standard_uncertainty": "0.1 um"}
    pool = {
        "candidates": [places | {"probes": ["down"]}],
        "calibration": [better | {"name": "diagonals", "price": "1 min"}],
    }
    plan = bp.plan(bp.experiment(small_sections(pool=pool)), hours=20)
    assert len(plan.chosen) > 7
    chosen = tmp_path / "chosen.yaml"
    chosen.write_text(plan.to_yaml(tmp_path), encoding="utf-8")
    planned, own = (by_name(each) for each in (plan.prediction.assumptions, bp.assumptions(chosen)))
    assert planned.keys() == own.keys()
    # What is bought stays as it is offered; the file has it among its own.
    for name in set(own) - {"certificates"}:
        assert planned[name].average == pytest.approx(own[name].average, rel=1e-9), name


def test_a_name_that_looks_like_a_number_stays_a_name(tmp_path: Path) -> None:
    text = yaml.safe_dump(small_sections(), sort_keys=False)
    path = tmp_path / "e.yaml"
    path.write_text(text.replace("front", "'1e-3'"), encoding="utf-8")
    tips = by_name(bp.assumptions(path))["tips"]
    changed = tmp_path / "changed.yaml"
    changed.write_text(
        yaml.safe_dump({**small_sections(), "probes": None}, sort_keys=False)
        .replace("front", "'1e-3'")
        .replace("probes: null\n", tips.entries),
        encoding="utf-8",
    )
    assert bp.run(changed)["U6"].average == pytest.approx(tips.average, rel=1e-9)


def by_name(table: Assumptions) -> dict[str, Any]:
    return {effect.assumption.name: effect for effect in table.effects}


def test_another_chain_is_what_a_fit_of_its_readings_gives() -> None:
    experiment = small_quickstart()
    effect = by_name(bp.assumptions(experiment))["chain"]
    other = experiment.with_(effect.assumption.changes)
    assert other.error_model.arrangement == "MB1"
    fitted = bp.fit(experiment, bp.simulate(other, exact=True)).to_map()
    points = experiment.evaluation.points[:: len(experiment.evaluation.points) // 50]
    probe = np.array(experiment.probes["down"].offset)
    offsets = np.broadcast_to(probe, points.shape)
    simulated = simulated_readings(other, exact=True)
    ends = [
        points + model.error(points, values, offsets)
        for model, values in ((fitted.model, fitted.values), (simulated.model, simulated.truth.a))
    ]
    first, second = np.triu_indices(len(points), 1)
    estimated, true = (np.linalg.norm(end[first] - end[second], axis=1) for end in ends)
    expected = np.sqrt(((estimated - true) ** 2).mean())
    assert effect.bias[0] == pytest.approx(expected, rel=0.1)
    assert effect.average == pytest.approx(
        np.hypot(bp.run(experiment)["U6"].average, effect.bias[0])
    )


def test_a_true_machine_of_another_model_takes_the_other_chain_too() -> None:
    own = {"kind": "kinematic", "position_coefficients": 6, "rotation_coefficients": 6}
    machine = {"kind": "random", "position": "2 um", "rotation": "4 urad", "seed": 7}
    both = [
        by_name(bp.assumptions(small_quickstart(true_machine=stated)))["chain"].bias
        for stated in (machine, machine | {"error_model": own})
    ]
    assert both[0] == both[1]


def test_errors_that_the_file_does_not_state_are_told() -> None:
    experiments = small_quickstart(), small_quickstart(true_machine={"kind": "zero"})
    told, assumed = (by_name(bp.assumptions(each))["chain"].assumption for each in experiments)
    assert told.instead == "MB1" and assumed.instead == "MB1, with errors of 2 µm and 4 µrad"
    assert assumed.changes["true_machine"]["position"] == "2 um"


def test_the_right_chain_has_no_bias() -> None:
    from ballplate.extensions.assumptions.effects import _bias

    experiment = small_quickstart()
    assert max(_bias(experiment, experiment)) < 1e-12


def test_the_file_states_what_to_take_instead() -> None:
    stated = {
        "tips": "2 um",
        "temperature": "0.5 K",
        "sag": "1 um",
        "drift": "2 um/h",
        "scatter": 3,
        "common": "1 um/m",
    }
    usual = by_name(bp.assumptions(bp.experiment(small_sections())))
    own = by_name(bp.assumptions(bp.experiment(small_sections(assumptions=stated))))
    for name in ("tips", "temperature", "sag", "drift", "scatter", "certificates"):
        assert own[name].average > usual[name].average, name
    assert own["certificates"].assumption.changes["calibration"][0]["common"] == "1 um/m"
    assert own["scatter"].ratio == pytest.approx(
        bp.run(small_quickstart(machine={"volume": ["1 m"] * 3, "repeatability": "0.6 um"}))[
            "U6"
        ].average
        / bp.run(small_quickstart())["U6"].average,
        rel=0.5,
    )


@pytest.mark.parametrize(
    ("key", "value"),
    [("tips", "0 um"), ("temperature", "-1 K"), ("scatter", 1), ("tip", "1 um"), ("drift", "1 um")],
)
def test_wrong_values_are_refused(key: str, value: Any) -> None:
    with pytest.raises(bp.ExperimentError, match=rf"assumptions\.{key}"):
        bp.experiment(small_sections(assumptions={key: value}))


def test_what_grows_with_length_is_the_common_part() -> None:
    item = {
        "kind": "distances",
        "pairs": "corner sides",
        "standard_uncertainty": "0.2 um + 0.5 ppm",
    }
    table = bp.assumptions(bp.experiment(small_sections(calibration=[item])))
    changed = by_name(table)["certificates"].assumption.changes["calibration"][0]
    assert changed == {**item, "standard_uncertainty": "0.2 um", "common": "0.5 um/m"}


def test_what_the_file_states_is_not_assumed() -> None:
    influences = [{"kind": "drift", "axes": {"standard_uncertainty": "1 um/h"}}]
    item = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "1 um"}
    probes = {
        name: {"offset": value, "standard_uncertainty": "1 um"}
        for name, value in small_sections()["probes"].items()
    }
    stated = small_sections(
        influences=influences, calibration=[item | {"common": "0.5 um/m"}], probes=probes
    )
    names = set(by_name(bp.assumptions(bp.experiment(stated))))
    assert names == {"temperature", "sag", "scatter", "model", "chain"}


def test_influences_of_length_standards_are_named_as_left_out() -> None:
    sections = small_sections()
    sections["artefacts"]["bar"] = {
        "kind": "two_spheres",
        "length": "400 mm",
        "role": "length_standard",
    }
    sections["positions"] = [position | {"artefact": "plate"} for position in sections["positions"]]
    pose = {"origin": ["300 mm", "300 mm", "300 mm"]}
    sections["positions"].append(
        {"name": "bar", "artefact": "bar", "pose": pose, "probes": ["down"]}
    )
    sections["calibration"][0]["artefact"] = "plate"
    bar = {"kind": "distances", "artefact": "bar", "pairs": "all", "standard_uncertainty": "1 um"}
    sections["calibration"].append(bar)
    table = bp.assumptions(bp.experiment(sections))
    assert {name for name, _ in table.left_out} == {"temperature", "sag", "drift"}
    assert "not computed" in "\n".join(table.lines())
    changed = by_name(table)["certificates"].assumption.changes["calibration"]
    assert "correlation" in changed[0] and changed[1] == bar


def test_run_prints_three_rows_and_all_on_request(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "e.yaml"
    path.write_text(yaml.safe_dump(small_sections()), encoding="utf-8")
    table = bp.assumptions(path)
    assert main(["run", str(path)]) == 0
    few = capsys.readouterr().out
    assert [effect.assumption.assumed in few for effect in table.effects] == [True] * 3 + [
        False
    ] * (len(table.effects) - 3)
    assert main(["run", str(path), "--assumptions"]) == 0
    every = capsys.readouterr().out
    assert all(effect.assumption.assumed in every for effect in table.effects)
    assert main(["run", str(path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)["assumptions"]
    assert data == table.to_dict()
    assert data["assumptions"][0]["changes"] == dict(table.effects[0].assumption.changes)


def test_the_headline_names_what_more_than_doubles_the_uncertainty() -> None:
    headline = bp.run(small_quickstart()).headline()
    assert "temperatures" in headline and "times as large" in headline
    narrow = {
        "assumptions": {"temperature": "0.001 K"},
        "true_machine": {"kind": "random", "position": "1 nm", "rotation": "1 nrad"},
    }
    assert "times" not in bp.run(small_quickstart(**narrow)).headline()


def test_priors_have_the_parameters_of_the_larger_model(tmp_path: Path) -> None:
    """The row of a larger error model is that of the file with its entries, priors included."""
    prior = {"parameter": "EXX t^1", "value": "0 m", "standard_uncertainty": "1 um"}
    path = tmp_path / "e.yaml"
    path.write_text(yaml.safe_dump(small_sections(12, 1, priors=[prior])), encoding="utf-8")
    assert "model" in {effect.assumption.name for effect in bp.assumptions(path).effects}
    assert agree(path) > 5


def test_zero_lengths_have_no_table() -> None:
    """In one position of a plate the scale of x is the standard: of distances, only those along it
    are determined, exactly.
    """
    experiment = bp.load(TOP / "designs" / "certified" / "two-dimensions.yaml")
    prediction = bp.run(experiment.with_({"positions[1]": None, "calibration": []}))
    assert np.isnan(prediction["U6"].average) and prediction["U6"].undetermined == 27
    assert prediction.assumptions is None


def test_undetermined_lengths_have_no_table(capsys: pytest.CaptureFixture[str]) -> None:
    path = TOP / "designs" / "planning" / "campaign.yaml"
    prediction = bp.run(path)
    assert np.isnan(prediction["U6"].average)
    assert prediction.assumptions is None
    with pytest.raises(ValueError, match="undetermined"):
        bp.assumptions(path)
    assert main(["run", str(path)]) == 0
    without = capsys.readouterr().out
    assert main(["run", str(path), "--assumptions"]) == 0
    line = "assumptions: not evaluated; U6 is undetermined, zero or not computed"
    assert capsys.readouterr().out == f"{without}\n{line}\n"


def test_the_page_has_all_rows() -> None:
    prediction = bp.run(small_quickstart())
    page = bp.page(prediction)
    for k, effect in enumerate(prediction.assumptions.effects):
        assert f">{effect.assumption.assumed}<" in page
        path = f'value="{effect.average!r}" data-path="/run/assumptions/assumptions/{k}/average"'
        assert path in page


@pytest.mark.parametrize(("side", "sag"), [("250 mm", "0.075 um"), ("1 m", "1.2 um")])
def test_the_usual_sag_grows_with_the_square_of_the_plate(side: str, sag: str) -> None:
    plate = {"kind": "grid", "balls": [3, 3], "size": [side, "200 mm"]}
    experiment = bp.experiment(
        small_sections(artefacts={"plate": plate}, machine={"volume": ["2 m"] * 3})
        | {"machine": {"volume": ["2 m"] * 3, "repeatability": "0.2 um"}}
    )
    (added,) = by_name(bp.assumptions(experiment))["sag"].assumption.changes["influences"]
    assert added["standard_uncertainty"] == sag
