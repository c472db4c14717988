"""Files that `init` drafts: valid at once, full rank, and within the volume."""

from __future__ import annotations

import shlex
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.drafting import checked_draft
from ballplate.extensions.drafting.data_sheet import data_sheet
from ballplate.extensions.planning.constraints import with_chosen
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.settings import build_error_model
from ballplate.simulator.machines.truth import RandomSettings, true_parameters

from tests.extensions.drafting import wording
from tests.extensions.drafting.sheets import BRIDGE, FLAT, SHEETS, furthest, options, spans, whole


def drafted(sheet: dict[str, str], **changed: str) -> str:
    """The text of a file."""
    stated = sheet | changed
    return checked_draft.drafted(Path("drafted.yaml"), data_sheet(stated), stated, "next")


@pytest.mark.parametrize(
    "name", ["bridge", *(pytest.param(name, marks=pytest.mark.long) for name in ("arm", "gantry"))]
)
def test_three_machines(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The start and the whole pool determine everything, and the pool fills the volume."""
    path = tmp_path / f"{name}.yaml"
    assert main(["init", str(path), *options(SHEETS[name])]) == 0
    chosen = path.with_name(f"{name}-chosen.yaml")
    command = shlex.join(["ballplate", "plan", str(path), "--hours", "6", "-o", str(chosen)])
    text = path.read_text(encoding="utf-8")
    assert f"next: {command}" in capsys.readouterr().err and command in text
    assert wording.HALF_THE_MPE in text
    assert main(["check", str(path)]) == 0
    every = whole(text)
    assert bp.check(every).verdict.deficiency == 0
    assert furthest(every) < 1e-9
    assert (spans(every) > 0.8).all()


def test_the_printed_command_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "m.yaml", *options(FLAT | {"hours": "2"})]) == 0
    command = capsys.readouterr().err.strip().partition("next: ballplate ")[2]
    assert main([*shlex.split(command), "--workers", "1"]) == 0
    assert main(["check", "m-chosen.yaml"]) == 0


@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
def test_every_arrangement_has_full_rank(arrangement: str) -> None:
    """With a volume, a plate and tips of any size and form, in two dimensions as well."""
    k = list(ARRANGEMENTS).index(arrangement)
    draws, tips = np.random.default_rng(k), ("one", "head", "star")[k % 3]
    edges = draws.integers(200, 4000, 3)
    size = " x ".join(f"{side:.1f}" for side in edges.min() * draws.uniform(0.25, 0.5, 2))
    plate = f"{draws.integers(4, 7)} x {draws.integers(4, 7)}, {size} mm"
    stated = {"volume": " x ".join(map(str, edges)) + " mm", "plate": plate}
    text = drafted(BRIDGE | stated, machine_type=arrangement, tips=tips)
    (experiment,), every = load(Path("drafted.yaml"), text=text), whole(text)
    assert bp.check(experiment).verdict.deficiency == 0 and furthest(every) < 1e-9
    flat = bp.design(**FLAT | {"machine_type": arrangement})
    assert bp.check(flat).verdict.deficiency == 0 and flat.dimension == 2
    # What is left out is not determined by a single tip, or in a plane.
    for one in (every, flat) if tips == "one" else (flat,):
        assert bp.check(one.with_({"error_model.functions": None})).verdict.deficiency > 0


def test_what_a_file_states_is_the_data_sheet() -> None:
    experiment = bp.design(**BRIDGE)
    assert np.allclose(experiment.machine.volume.upper, [0.9, 1.2, 0.7])
    assert np.allclose(experiment.machine.repeatability, 0.3e-6)
    assert experiment.target_uncertainty is not None
    assert experiment.target_uncertainty.coverage_factor == 2.0
    assert np.isclose(experiment.target_uncertainty.at(1.0), 0.5 * (0.45e-6 + 1.25e-6))
    (distances,) = experiment.calibration
    at_side = distances.standard_uncertainties[0]
    assert np.isclose(at_side, np.hypot(0.2e-6, 0.25e-6 * 0.42))
    assert "    common: 0.25 um/m" in drafted(BRIDGE).splitlines()
    uncertain = [probe.is_estimated for probe in experiment.probes.values()]
    assert uncertain == [False, True, True, True, True]
    assert experiment.layouts["plate"].names[-1] == "r6c6"


@pytest.mark.long
def test_a_plan_of_a_drafted_design_is_a_file(tmp_path: Path) -> None:
    """A design that was never written to a file has one nevertheless after its plan."""
    planned = bp.plan(bp.design(**FLAT), hours=2)
    assert planned.is_determined
    file = tmp_path / "planned.yaml"
    file.write_text(planned.to_yaml(tmp_path), encoding="utf-8")
    average = bp.run(bp.load(file)).quantities["U6"].average
    assert average == pytest.approx(planned.prediction.quantities["U6"].average, rel=1e-9)


def test_stated_values() -> None:
    """The stated temperature is the one that the table of assumptions has for 0.1 K."""
    (usual,) = load(Path("drafted.yaml"), text=drafted(BRIDGE, plate="4 x 4, 420 mm"))
    (stated,) = load(
        Path("drafted.yaml"), text=drafted(BRIDGE, plate="4 x 4, 420 mm", temperature="0.1 K")
    )
    rows = {effect.assumption.name: effect for effect in bp.assumptions(usual).effects}
    average = bp.run(stated).quantities["U6"].average
    assert average == pytest.approx(rows["temperature"].average, rel=1e-9)
    assert "temperature" not in {one.assumption.name for one in bp.assumptions(stated).effects}
    text = drafted(BRIDGE, repeatability="0.25 um", tips="head, 200 mm, 0.3 um")
    assert "repeatability: 0.25 um" in text and "tip: [0 mm, 0 mm, -200 mm]" in text
    assert text.count("standard_uncertainty: 0.3 um}") == 4
    design = bp.design(**BRIDGE, repeatability="0.25 um", target="0.7 um, k=3", tips="star, 40 mm")
    assert np.allclose(design.machine.repeatability, 0.25e-6)
    assert np.abs(design.probes["right"].offset).max() == 0.04
    target = design.target_uncertainty
    assert target is not None and (target.at(1.0), target.coverage_factor) == (0.7e-6 / 3, 3.0)


@pytest.mark.parametrize("name", SHEETS)
def test_a_choice_has_three_positions_of_two_planes(name: str) -> None:
    """So that `init` may refuse a time that does not suffice for them."""
    (every,) = load(Path("drafted.yaml"), planning=True, text=drafted(SHEETS[name]))
    assert every.pool is not None
    candidates, generator = every.pool.candidates, np.random.default_rng(1)
    few = [[one for one in candidates if one.plane == plane] for plane in "xyz"]
    few += [[candidates[i] for i in generator.permutation(len(candidates))[:2]] for _ in range(5)]
    for chosen in few:
        assert bp.check(with_chosen(every, chosen)).verdict.deficiency > 0


@pytest.mark.parametrize("name", SHEETS)
def test_simulated_machines_have_errors_of_half_the_mpe(name: str) -> None:
    """Standard deviation of errors of lengths between random points, of forty machines."""
    sheet = data_sheet(SHEETS[name])
    (experiment,) = load(Path("drafted.yaml"), text=drafted(SHEETS[name]))
    edges, generator = np.array(sheet.volume), np.random.default_rng(1)
    first, second = generator.uniform(size=(2, 200, 3)) * edges
    length = np.linalg.norm(first - second, axis=1)
    along = (first - second) / length[:, None]
    model = build_error_model(experiment.error_model, (0.0, 0.0, 0.0), sheet.volume)
    truth, offset = experiment.true_machine, np.zeros_like(first)
    assert isinstance(truth, RandomSettings)
    shares = []
    for seed in range(40):
        a = true_parameters(truth.model_copy(update={"seed": seed}), model)
        difference = model.error(first, a, offset) - model.error(second, a, offset)
        shares.append((difference * along).sum(axis=1) / sheet.mpe.at(length))
    assert 0.35 < np.std(shares) < 0.65
