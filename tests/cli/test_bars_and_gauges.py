"""Ball bars and Bryan gauges as a user of the command line meets them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.simulator.experiment.loading import load

from tests.cli import wording

FOLDER = Path("designs/hurt_foss")
BARS, GAUGE = str(FOLDER / "bar-bell.yaml"), str(FOLDER / "bryan-gauge.yaml")
KNOWN = [GAUGE, str(FOLDER / "bryan-gauge-readings.csv"), "--variant", "radius known"]
UNKNOWN = [*KNOWN[:3], "radius unknown"]
BAR_READINGS = [BARS, str(FOLDER / "bar-bell-readings.csv"), "--variant", "length known"]


def json_of(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 0) -> Any:
    assert main([*arguments, "--json"]) == status
    return json.loads(capsys.readouterr().out)


def test_check_tells_why(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", BARS, GAUGE]) == 0
    out = capsys.readouterr().out
    assert wording.RADIUS_CHANGE_TOGETHER_WITHOUT_CHANGING_ANY in out


def test_the_two_fits_of_bars_are_one(capsys: pytest.CaptureFixture[str]) -> None:
    full = json_of(capsys, "fit", *BAR_READINGS)
    one, other = (
        json_of(capsys, "fit", *BAR_READINGS, "--estimator", name)
        for name in ("length-equations", "sphere-then-metric")
    )
    assert one["adjustments"] == other["adjustments"] and one["rank_deficiency"] == 0
    for name, adjustment in one["adjustments"].items():
        # The same to the second order of the errors: squares of lengths, and lengths.
        assert adjustment["value"] == pytest.approx(full["adjustments"][name]["value"], abs=2e-8)
        assert adjustment["words"] == full["adjustments"][name]["words"]
    excess = {"angle xy": ("C0Y", 1), "angle xz": ("B0Z", -1), "angle yz": ("A0Z", 1)}
    for name in ("scale x", "scale y", "scale z", *excess):
        error, sign = excess.get(name, (name, 1))
        estimate = full["estimates"][error]
        assert full["adjustments"][name]["value"] == sign * estimate["value"]
        assert full["adjustments"][name]["standard_uncertainty"] == pytest.approx(
            estimate["standard_uncertainty"]
        )


def test_what_to_do_is_told_with_its_direction(capsys: pytest.CaptureFixture[str]) -> None:
    """True errors: X reads 20 ppm too little, Y leans to -X by 60 urad, Z to -X by 40 and to -Y by
    80.
    """
    assert main(["fit", *KNOWN, "--estimator", "length-equations"]) == 0
    out = capsys.readouterr().out
    for words in (
        "let X read 2",
        "let Y read 2",
        "µm per m less",
        "towards +X",
        "towards +Y",
        "pivots: pivot (500.0",
    ):
        assert words in out
    assert "towards -" not in out and max(map(len, out.splitlines())) <= 140
    assert main(["fit", *KNOWN]) == 0
    out = capsys.readouterr().out
    assert (
        "let X read 2" in out and "pivot" in out and "radius" in out.split("largest residuals")[1]
    )


def test_what_is_open_has_no_value_in_length_equations(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("fit", *UNKNOWN, "--estimator", "length-equations")
    found = json_of(capsys, *arguments)
    assert [name for name, value in found["factors"].items() if value is None] == ["e1", "e4", "e6"]
    assert found["lengths"] == {"gauge: radius": None} and None not in found["pivots"]["pivot"]
    assert main([*arguments]) == 0
    assert "gauge: radius: - mm" in capsys.readouterr().out
    known = json_of(capsys, "fit", *KNOWN, "--estimator", "length-equations")
    assert None not in known["factors"].values()


OPEN = [(BARS, name) for name in ("length unknown", "flat", "one axis", "axes only")]
OPEN += [(GAUGE, name) for name in ("radius unknown", "one height", "one plane", "two heights")]
TRUE = {
    "scale x": 20,
    "scale y": -30,
    "scale z": 15,
    "angle xy": 60,
    "angle xz": 40,
    "angle yz": 80,
}
TRUE |= {"scale y - scale x": -50, "scale z - scale x": -5}
TWO_HEIGHTS = """
  two heights:
    artefacts.gauge.directions: {azimuths: 36, elevations: [30 deg, 60 deg]}
    expected_rank_deficiency: 1
"""


@pytest.mark.parametrize(("path", "variant"), OPEN)
def test_readings_tell_nothing_of_what_the_design_leaves_open(
    path: str, variant: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Noise and errors make bars and places of a gauge differ a little from the directions of the
    design.
    """
    text = Path(path).read_text(encoding="utf-8") + (TWO_HEIGHTS if path == GAUGE else "")
    (tmp_path / "e.yaml").write_text(text, encoding="utf-8")
    arguments = [str(tmp_path / "e.yaml"), "--variant", variant]
    readings = str(tmp_path / "r.csv")
    assert main(["simulate", *arguments, "-o", readings]) == 0
    (design,) = [one for one in load(tmp_path / "e.yaml") if one.name == variant]
    capsys.readouterr()
    full = json_of(capsys, "fit", arguments[0], readings, *arguments[1:], "--sigma", "given")
    equations = json_of(
        capsys, "fit", arguments[0], readings, *arguments[1:], "--estimator", "length-equations"
    )
    assert (
        full["rank_deficiency"] == equations["rank_deficiency"] == design.expected_rank_deficiency
    )
    for name, one in full["adjustments"].items():
        other = equations["adjustments"][name]["value"]
        assert (one["value"] is None) == (other is None)
        if other is not None:
            assert other == pytest.approx(one["value"], abs=5e-8)
            assert abs(one["value"] - 1e-6 * TRUE[name]) < 4.0 * one["standard_uncertainty"]


def test_a_rank_that_is_not_expected_is_a_complaint(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (
        Path(GAUGE)
        .read_text(encoding="utf-8")
        .split("variants:")[0]
        .replace("  - {kind: radius", "  # - {kind: radius")
    )
    text = text.replace("calibration:", "calibration: []")
    (tmp_path / "g.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "silent.yaml").write_text(
        text.replace("expected_rank_deficiency: 0", ""), encoding="utf-8"
    )
    for name, told in (
        ("g", " where the file expects full rank"),
        ("silent", ", and the file does not say expected_"),
    ):
        for estimator in ("full", "length-equations"):
            assert (
                main(["fit", str(tmp_path / f"{name}.yaml"), KNOWN[1], "--estimator", estimator])
                == 1
            )
            assert f"rank deficiency 1{told}" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["fit", *KNOWN, "--estimator", "kruth"], ["compare", GAUGE]])
def test_estimators_of_distances_refuse_gauges(
    command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(command) == 3
    out, err = capsys.readouterr()
    assert not out and wording.ESTIMATORS_OF_DISTANCES_ALONE_CANNOT_FOLLOW in err
    assert main(["fit", *BAR_READINGS[:3], "length unknown", "--estimator", "distances"]) == 3
    assert wording.CANNOT_FOLLOW_AN_UNKNOWN_LENGTH in capsys.readouterr().err


def test_compare_tells_what_two_steps_lose(capsys: pytest.CaptureFixture[str]) -> None:
    few = ("--variant", "radius known", "--trials", "5", "--estimator")
    assert main(["fit", *KNOWN, "--estimator", "sphere-then-metric"]) == 0
    assert wording.THE_PIVOT_IS_THE_CENTRE in capsys.readouterr().err
    joint, two = (
        json_of(capsys, "compare", GAUGE, *few, name)
        for name in ("length-equations", "sphere-then-metric")
    )
    assert joint["lengths"] == two["lengths"] == 60 and not joint["not_converged"]
    assert max(joint["maximum"]["values"]) < 1e-8
    # Of B0Z = -40 and A0Z = 80 urad more than half is lost, over distances of some 0.5 m.
    assert 3e-6 < min(two["rms"]["values"]) < max(two["rms"]["values"]) < 2e-5
    assert (
        main(["compare", GAUGE, "--variant", "radius unknown", "--estimator", "length-equations"])
        == 3
    )
    assert wording.THE_DESIGN_LEAVES_ERRORS_UNDETERMINED in capsys.readouterr().err
    assert main(["compare", "designs/quickstart.yaml", "--estimator", "length-equations"]) == 3
    assert wording.HAS_NO_BALL_BAR_OR_BRYAN_GAUGE in capsys.readouterr().err
    assert main(["compare", BARS, "--variant", "length known", "--trials", "1"]) == 0
    assert wording.ESTIMATOR_DISTANCES_LENGTHS_OF_STANDARDS_AGAINST in capsys.readouterr().out


def test_length_equations_refuse_plates_alone_and_planes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    readings = str(tmp_path / "r.csv")
    assert main(["simulate", "designs/quickstart.yaml", "-o", readings]) == 0
    assert (
        main(["fit", "designs/quickstart.yaml", readings, "--estimator", "length-equations"]) == 3
    )
    assert wording.HAS_NO_BALL_BAR_OR_BRYAN in capsys.readouterr().err
    assert main(["fit", *BAR_READINGS, "--estimator", "reversal"]) == 3
    assert wording.THE_REVERSAL_NEEDS_TWO_DIMENSIONS in capsys.readouterr().err
    plane = ["designs/hocken_borchardt/dummy.yaml", "designs/hocken_borchardt/dummy-readings.csv"]
    assert main(["fit", *plane, "--variant", "with scale", "--estimator", "length-equations"]) == 3
    assert "has two dimensions" in capsys.readouterr().err


def test_length_equations_tell_what_they_pass_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = Path(GAUGE).read_text(encoding="utf-8").split("variants:")[0]
    text = text.replace("{kind: metric}", "{kind: metric, scale: none}").split("true_machine:")
    text = text[0] + "probes:" + text[1].partition("probes:")[2]
    prior = 'priors: [{parameter: "pivot: origin z", standard_uncertainty: 1 mm}]\n'
    (tmp_path / "g.yaml").write_text(text + prior, encoding="utf-8")
    arguments = ["fit", str(tmp_path / "g.yaml"), KNOWN[1], "--estimator", "length-equations"]
    assert main(arguments) == 0
    err = capsys.readouterr().err
    assert (
        "ignores priors" in err
        and wording.WHATEVER_THE_FILES_ERROR_MODEL in err
        and "plates" not in err
    )


def test_a_bar_that_is_a_plate_is_no_length_standard(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (
        Path(BARS)
        .read_text(encoding="utf-8")
        .split("variants:")[0]
        .replace(", role: length_standard", "")
    )
    (tmp_path / "b.yaml").write_text(text, encoding="utf-8")
    assert (
        main(["fit", str(tmp_path / "b.yaml"), BAR_READINGS[1], "--estimator", "length-equations"])
        == 3
    )
    err = capsys.readouterr().err
    line = text[: text.index("bar: {kind")].count("\n") + 1
    assert f"b.yaml:{line}:" in err and wording.IS_A_PLATE_BUT_LENGTH_EQUATIONS in err


def test_simulate_run_trials_and_fit_go_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    readings = str(tmp_path / "r.csv")
    assert main(["simulate", GAUGE, "--variant", "two pivots", "-o", readings]) == 0
    assert main(["fit", GAUGE, readings, "--variant", "two pivots", "--sigma", "given"]) == 0
    capsys.readouterr()
    found = json_of(
        capsys, "run", GAUGE, "--variant", "two pivots", "--trials", "256", "--workers", "1"
    )
    assert found["quantities"]["U2 lengths"]["count"] == 6
    trials = found["monte_carlo"]["quantities"]
    for symbol in ("U2", "U3", "U4", "U6"):
        spread = trials[symbol]["spread_ratio"]
        assert abs(spread["value"] - 1.0) < 4.0 * spread["standard_error"]


def test_all_mistakes_of_a_gauge_are_told_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(
        """\
title: bad
machine: {volume: [1 m, 800 mm, 600 mm], repeatability: 1 um}
error_model: {kind: metric}
probes: {magnet: [0 mm, 0 mm, 0 mm]}
artefacts:
  role: {kind: bryan_gauge, radius: 300 mm, role: plate, directions: [[0 deg, 0 deg]]}
  both: {kind: bryan_gauge, radius: 300 mm, directions: [[0 deg, 0 deg], [10 deg, 0 deg]]}
  same: {kind: bryan_gauge, radius: 300 mm, directions: [[0 deg, 0 deg], [360 deg, 0 deg]]}
  high: {kind: bryan_gauge, radius: 300 mm, directions: {azimuths: 4, elevations: [0 deg, 100 deg]}}
  many: {kind: bryan_gauge, radius: 300 mm, directions: {azimuths: 360, elevations: [1 deg, 2 deg, 3 deg, 4 deg, 5 deg,
    6 deg, 7 deg, 8 deg, 9 deg, 10 deg, 11 deg, 12 deg, 13 deg, 14 deg]}}
  zone: {kind: bryan_gauge, radius: 300 mm, directions: [[0 deg, 0 deg], [20 deg, 0 deg]]}
  over: {kind: bryan_gauge, radius: 500 mm, directions: {azimuths: 4, elevations: [0 deg, 90 deg]}}
  bar: {kind: two_spheres, length: 300 mm, role: length_standard}
positions:
  - {name: a, artefact: over, pose: {origin: [500 mm, 400 mm, 100 mm]}}
  - {name: b, artefact: bar, pose: {origin: [500 mm, 400 mm, 100 mm]}}
calibration:
  - {kind: distances, artefact: over, pairs: all, standard_uncertainty: 1 um}
  - {kind: radius, artefact: bar, standard_uncertainty: 1 um}
  - {kind: radius, artefact: over, standard_uncertainty: 1 um, value: 600 mm}
  - {kind: radius, artefact: over, standard_uncertainty: 1 um}
  - {kind: radius, artefact: over, standard_uncertainty: 1 um}
priors:
  - {parameter: "a: rotation z", standard_uncertainty: 1 urad}
""",
        encoding="utf-8",
    )
    assert main(["check", str(path)]) == 3
    told = [line.removeprefix(f"{path}:") for line in capsys.readouterr().err.splitlines()]
    told = [line for line in told if "is never placed" not in line]
    assert [line.split(" (")[0] for line in told] == [
        (wording.A_BRYAN_GAUGE_ONLY_CARRIES),
        (wording.BALLS_AND_ARE_AT_THE_SAME),
        (wording.AN_ELEVATION_IS_OUTSIDE_DEG),
        wording.DIRECTIONS_ARE_TOO_MANY,
        (wording.READING_BALL_WITH_PROBE_PUTS),
        (wording.IS_A_BRYAN_GAUGE_AND_HAS),
        (wording.ONLY_A_BRYAN_GAUGE_HAS),
        (wording.MM_IS_FAR_FROM_THE_MM),
        (wording.THE_RADIUS_OF_IS_ALREADY),
        (wording.UNKNOWN_PARAMETER_DID_YOU_MEAN),
    ]


def test_a_pivot_may_be_known_beforehand(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = Path(GAUGE).read_text(encoding="utf-8").split("variants:")[0]
    known = 'priors: [{parameter: "pivot: origin z", standard_uncertainty: 0.1 um}]\n'
    (tmp_path / "g.yaml").write_text(text + known, encoding="utf-8")
    found = json_of(capsys, "run", str(tmp_path / "g.yaml"))["quantities"]
    free = json_of(capsys, "run", GAUGE, "--variant", "radius known")["quantities"]
    # With the height of the pivot the scale of Z and its squareness are far better known.
    assert found["U3 ratios"]["maximum"] < 0.5 * free["U3 ratios"]["maximum"]
    assert np.isclose(found["U2 lengths"]["count"], 3)
