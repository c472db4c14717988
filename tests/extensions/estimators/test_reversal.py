"""`fit --estimator reversal`, and the metric from positions at any angles, as a user meets them."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.estimators.reversal_fits import _mean_readings

from tests.cli import wording

FOLDER = Path("designs/hocken_borchardt")
ANGLES = str(FOLDER / "angles.yaml")
DUMMY = [str(FOLDER / "dummy.yaml"), str(FOLDER / "dummy-readings.csv"), "--variant", "with scale"]
REVERSAL = ["--estimator", "reversal"]
AS_REVERSAL: Any = {"estimator": "reversal"}


def told(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 0) -> tuple[str, str]:
    capsys.readouterr()
    assert main(list(arguments)) == status
    return capsys.readouterr()


def data(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    return json.loads(told(capsys, *arguments, "--json")[0])  # type: ignore[no-any-return]


def test_tables(capsys: pytest.CaptureFixture[str]) -> None:
    out, err = told(capsys, "fit", *DUMMY, *REVERSAL)
    lines = [line.split() for line in out.splitlines()]
    assert err == ""
    assert ["alpha", "4.8079", "0.0255", "4.8062", "0.0252", "µrad"] in lines
    assert ["2", "318.1723719", "0", "318.1723704", "0", "0.0103", "0"] in lines
    assert wording.IS_TURNED_BY_DEGREES in out
    assert wording.ORIGIN_BALL_AXIS_THROUGH_BALL in out
    # Without offsets the residuals have their pattern, 53 times as large as stated.
    options = ["--no-offsets", "--scale", "none"]
    out, err = told(capsys, "fit", *DUMMY, *REVERSAL, *options, status=1)
    assert wording.THREE_PARAMETERS_NO_OFFSETS in out
    assert "offset x" not in out and "fit without --no-offsets" in err


def test_data_are_those_of_the_full_fit_beside_the_reversal(
    capsys: pytest.CaptureFixture[str],
) -> None:
    found = data(capsys, "fit", *DUMMY, *REVERSAL)
    full = data(capsys, "fit", *DUMMY)
    relation = found["multiple_redundancy"].pop("relation")
    assert found["multiple_redundancy"] == full
    for name in ("alpha", "gamma"):
        assert relation[name] == full["estimates"][name]
    assert relation["beta"]["value"] == pytest.approx(
        full["estimates"]["first: rotation z"]["value"], abs=1e-12
    )
    uncertainty = full["estimates"]["first: rotation z"]["standard_uncertainty"]
    assert relation["beta"]["standard_uncertainty"] == pytest.approx(uncertainty)
    # The other position is held where it is, and the scales near enough one.
    assert relation["offset x"]["value"] == pytest.approx(
        full["estimates"]["first: origin x"]["value"], abs=1e-9
    )
    uncertainty = full["estimates"]["first: origin x"]["standard_uncertainty"]
    assert relation["offset x"]["standard_uncertainty"] == pytest.approx(uncertainty, rel=1e-4)
    assert found["axes"] == full["plates"]["plate"]["axes"] == {"origin": "1", "x": "2"}
    for ball, place in full["plates"]["plate"]["balls"].items():
        for axis in "xy":
            assert found["balls"][ball][axis]["value"] == pytest.approx(
                place[axis]["value"], abs=3e-9
            )
    assert found["positions"] == {"first": "first", "second": "turned"}
    assert len(found["residuals"]) == 9 and found["sigma"] == pytest.approx(
        0.534e-6 * 0.0254, rel=1e-3
    )


def test_either_sense_and_either_order(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Counter-clockwise, the position listed second comes first; parameters are told for the same
    relation.
    """
    text = (
        Path(ANGLES).read_text().partition("expected_rank_deficiency")[0].partition("positions:")[0]
    )
    poses = {
        "a": "{origin: [250 mm, 250 mm], rotation: 0 deg}",
        "b": "{origin: [650 mm, 250 mm], rotation: 90 deg}",
    }
    readings, found = tmp_path / "r.csv", {}
    for order in ("ab", "ba"):
        path = tmp_path / f"{order}.yaml"
        listed = "".join(f"  - {{name: {name}, pose: {poses[name]}}}\n" for name in order)
        path.write_text(f"{text}positions:\n{listed}")
        if order == "ab":
            told(capsys, "simulate", str(path), "-o", str(readings))
        found[order] = data(capsys, "fit", str(path), str(readings), *REVERSAL)
    one, other = found["ab"], found["ba"]
    assert one["positions"] == other["positions"] == {"first": "b", "second": "a"}
    for name, estimate in one["multiple_redundancy"]["relation"].items():
        beside = other["multiple_redundancy"]["relation"][name]
        assert estimate["value"] == pytest.approx(beside["value"], abs=1e-12)
        assert estimate["standard_uncertainty"] == pytest.approx(
            beside["standard_uncertainty"], rel=1e-4
        )
        assert one["estimates"][name]["value"] == other["estimates"][name]["value"]
        # Beyond what noise explains the reversal and the full estimate are the same, too.
        assert one["estimates"][name]["value"] == pytest.approx(estimate["value"], abs=2e-9)
    true = {"alpha": 12e-6, "beta": 0.0, "gamma": 8e-6}
    for name, value in true.items():
        estimate = one["multiple_redundancy"]["relation"][name]
        assert abs(estimate["value"] - value) < 3 * estimate["standard_uncertainty"]


@pytest.mark.parametrize(
    ("angle", "words", "status"),
    [("90.03", "108 arcsec", 0), ("90.2", "720 arcsec", 1), ("80", "10 degrees", 1)],
)
def test_too_far_from_a_quarter_turn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], angle: str, words: str, status: int
) -> None:
    """What is neglected is told as it is: the difference from multiple redundancy, which neglects
    nothing.
    """
    path, readings = tmp_path / "far.yaml", str(tmp_path / "r.csv")
    path.write_text(Path(ANGLES).read_text().replace("rotation: 90 deg", f"rotation: {angle} deg"))
    chosen = ["--variant", "quarter turn"]
    told(capsys, "simulate", str(path), "-o", readings, *chosen)
    out, err = told(capsys, "fit", str(path), readings, *chosen, *REVERSAL, "--json", status=status)
    assert f"the turn is {words} from 90 degrees, too far for equations of the first order" in err
    assert err.startswith("warning: ") == (status == 0) and err.count("\n") == 1
    found = json.loads(out)
    full = found["multiple_redundancy"]
    balls = full["plates"]["plate"]["balls"]
    off = [
        found["balls"][ball][axis]["value"] - balls[ball][axis]["value"]
        for ball in balls
        for axis in "xy"
    ]
    assert found["neglected_coordinates"] == pytest.approx(np.abs(off).max(), rel=0.01)
    size = 1e6 * found["neglected_coordinates"]
    unit = f"{size / 1e3:.2g} mm" if size > 1e3 else f"{size:.2g} µm"
    assert f"neglected terms change co-ordinates of balls by up to {unit}" in err.replace(
        "0.020 µm", "0.02 µm"
    )
    shift = max(
        abs(found["estimates"][name]["value"] - full["relation"][name]["value"])
        for name in ("offset x", "offset y")
    )
    assert found["neglected_offset"] == pytest.approx(shift, rel=0.01)
    (shown,) = re.findall(r"and offsets by up to ([\d.]+) (mm|µm)", err)
    assert float(shown[0]) * {"mm": 1e-3, "µm": 1e-6}[shown[1]] == pytest.approx(shift, rel=0.1)
    # No result is off by more standard uncertainties than told.
    for name, estimate in found["estimates"].items():
        beside = full["relation"][name]
        away = abs(estimate["value"] - beside["value"]) / beside["standard_uncertainty"]
        assert away < 1.05 * found["neglected_standard_uncertainties"]
    for name, true in (("alpha", 12e-6), ("gamma", 8e-6)):
        estimate = full["estimates"][name]
        assert abs(estimate["value"] - true) < 3 * estimate["standard_uncertainty"]
    out, _ = told(capsys, "fit", str(path), readings, *chosen, *REVERSAL, status=status)
    turned = float(out.partition("is turned by ")[2].partition(" ")[0])
    assert turned == pytest.approx(float(angle), abs=1e-4)


def test_positions_at_any_angles(capsys: pytest.CaptureFixture[str]) -> None:
    """The readings shipped give their true machine and plate back, within their uncertainties."""
    found = data(
        capsys, "fit", ANGLES, str(FOLDER / "angles-readings.csv"), "--variant", "any angles"
    )
    assert (
        found["status"] == "converged" and found["rank_deficiency"] == 0 and not found["too_large"]
    )
    for name, true in (("alpha", 12e-6), ("gamma", 8e-6)):
        estimate = found["estimates"][name]
        assert estimate["standard_uncertainty"] < 3e-7
        assert abs(estimate["value"] - true) < 3 * estimate["standard_uncertainty"]
    plate = found["plates"]["plate"]
    assert plate["axes"] == {"origin": "r1c1", "x": "r1c4"}
    off = [
        (plate["balls"][f"r{row + 1}c{column + 1}"][axis]["value"] - 0.12 * place)
        / plate["balls"][f"r{row + 1}c{column + 1}"][axis]["standard_uncertainty"]
        for row in range(4)
        for column in range(4)
        for axis, place in (("x", column), ("y", row))
        if plate["balls"][f"r{row + 1}c{column + 1}"][axis]["standard_uncertainty"] > 0
    ]
    assert len(off) == 29 and np.abs(off).max() < 3.5


def test_rank_at_any_angles(capsys: pytest.CaptureFixture[str]) -> None:
    """Squareness and scale difference show by the sine of the angle, and half a turn shows
    neither.
    """
    judged = json.loads(told(capsys, "run", ANGLES, "--json")[0])
    found = {one["experiment"]: one for one in judged}
    deficiency = {
        name.partition("[")[2][:-1]: one["rank_deficiency"] for name, one in found.items()
    }
    assert deficiency == {
        "any angles": 0,
        "three positions": 0,
        "quarter turn": 0,
        "small turn": 0,
        "half a turn": 2,
        "shifted only": 2,
        "half a turn, equal scales": 1,
    }
    for name in ("half a turn", "shifted only"):
        words = " ".join(found[f"angles[{name}]"]["undetermined"])
        assert wording.ALPHA_DEPARTURE_OF_THE_AXES in words
        assert wording.GAMMA_DIFFERENCE_OF_THE_SCALES in words
        assert found[f"angles[{name}]"]["quantities"]["U3"]["undetermined"] == 2
    quarter, small = (
        found[f"angles[{name}]"]["quantities"]["U3 angles"]["maximum"]
        for name in ("quarter turn", "small turn")
    )
    assert small * np.sin(np.radians(5)) == pytest.approx(quarter, rel=1e-6)


def test_balls_read_in_one_position_are_left_out(tmp_path: Path) -> None:
    """As if they had been read in neither, and what is left is a regression like any other."""
    experiment = bp.load(ANGLES, "quarter turn")
    readings = bp.simulate(experiment)
    away = readings.ball.isin(["r2c2", "r3c1"])
    one = bp.fit(experiment, readings[~away | (readings.position == "straight")], **AS_REVERSAL)
    whole = bp.fit(experiment, readings, **AS_REVERSAL)
    assert f"alpha {1e6 * whole.estimates[0].value:.4g} µ" in whole.headline()
    kept = np.flatnonzero(~np.isin(whole.names, ["r2c2", "r3c1"]))
    assert one.found.residuals.shape == (len(kept), 2)
    assert one.found.degrees_of_freedom == 2 * len(kept) - 5
    seen = _mean_readings(whole.observed)[:, kept]
    k, m = (0, 1) if whole.first == whole.observed.design.positions.names[0] else (1, 0)
    x1, (x2, y2) = seen[k], seen[m].T
    zero, unit = np.zeros(len(kept)), np.ones(len(kept))
    rows = np.concatenate(
        [
            np.stack([-x2, -x2, -y2, unit, zero], axis=1),
            np.stack([y2, -y2, -x2, zero, unit], axis=1),
        ]
    )
    wanted = np.concatenate([x1[:, 0] + y2, x1[:, 1] - x2])
    values = np.linalg.solve(rows.T @ rows, rows.T @ wanted)
    sigma = np.sqrt(((wanted - rows @ values) ** 2).sum() / (len(rows) - 5))
    u = sigma * np.sqrt(np.diagonal(np.linalg.inv(rows.T @ rows)))
    np.testing.assert_allclose([e.value for e in one.estimates], values, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose([e.standard_uncertainty for e in one.estimates], u, rtol=1e-6)
    assert np.isnan(one.coordinates).any(axis=1).sum() == 2
    assert wording.LEAVES_OUT_WHAT_IS_NOT_READ in one.cautions[0]


def refused(experiment: bp.Experiment, readings: Any, words: str, **options: Any) -> None:
    with pytest.raises(bp.ExperimentError, match=re.escape(words)):
        bp.fit(experiment, readings, **AS_REVERSAL, **options)


def test_readings_that_are_no_reversal() -> None:
    quarter, half = bp.load(ANGLES, "quarter turn"), bp.load(ANGLES, "half a turn")
    readings = bp.simulate(quarter)
    there = (readings.ball != "r1c4") | (readings.position == "straight")
    told = "the reversal needs the balls that define the plate's axes in both positions; in"
    refused(quarter, readings[there], f'{told} "turned by 90" the readings lack "r1c4"; ')
    refused(half, bp.simulate(half), wording.A_TURN_OF_DEGREES_LIES_BETWEEN)


def test_several_probes_and_priors() -> None:
    two = {"a": ["0 mm", "0 mm"], "b": ["20 mm", "0 mm"]}
    both = {f"positions[{k}].probes": ["a", "b"] for k in range(2)}
    experiment = bp.load(ANGLES, "quarter turn").with_({"probes": two, **both})
    readings = bp.simulate(experiment)
    told = "the reversal takes readings with one probe, not with a, b; keep those with one"
    refused(experiment, readings, told)
    one = bp.fit(experiment, readings[readings.probe == "a"], **AS_REVERSAL)
    assert one.to_dict()["estimates"]["alpha"]["value"] == pytest.approx(12e-6, abs=2e-6)
    # What takes places of balls in the one position, less its origin, to those in the other.
    exact = bp.simulate(experiment, exact=True).query("probe == 'b'")
    shifted = bp.fit(experiment, exact, **AS_REVERSAL).to_dict()
    origins = {one.name: one.pose.origin - [0.02, 0.0] for one in experiment.positions}
    to, of = (
        exact.query("position == @name")[["x_mm", "y_mm"]].to_numpy() / 1e3 - origins[name]
        for name in (shifted["positions"]["first"], shifted["positions"]["second"])
    )
    offset = np.linalg.lstsq(np.c_[of, np.ones(len(of))], to, rcond=None)[0][2]
    for axis, value in zip("xy", offset.tolist(), strict=True):
        estimate = shifted["multiple_redundancy"]["relation"][f"offset {axis}"]
        assert estimate["value"] == pytest.approx(value, abs=1e-9)
    prior = [{"parameter": "gamma", "standard_uncertainty": "1 ppm"}]
    known = bp.load(ANGLES, "quarter turn").with_({"priors": prior})
    readings = bp.simulate(known)
    assert bp.fit(known, readings, **AS_REVERSAL).to_dict()["scale"] == "x"
    refused(known, readings, wording.PRIORS_REFER_TO_THE_FILES_ERROR, scale="none")
