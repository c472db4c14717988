"""What `fit` says of results that look definite and are not: wrong lengths, few degrees of
freedom.
"""

from __future__ import annotations

import json
from pathlib import Path

import ballplate as bp
import pandas
import pytest
from ballplate.cli import main
from scipy.stats import t

from tests.cli import wording

FOLDER = Path("designs/hurt_foss")
STATED = {"bar-bell": "length: 500 mm", "bryan-gauge": "radius: 300 mm"}
TOLD = {
    "bar-bell": "bar: the read lengths are {} of the stated ones",
    "bryan-gauge": "gauge: the read radius is {} of",
}


def fit(tmp_path: Path, name: str, factor: float, *options: str) -> int:
    """Fit shipped readings with a stated length that is wrong by a factor."""
    what, _, value = STATED[name].partition(": ")
    text = (FOLDER / f"{name}.yaml").read_text(encoding="utf-8").split("variants:")[0]
    wrong = text.replace(STATED[name], f"{what}: {factor * float(value.removesuffix(' mm'))} mm")
    (tmp_path / "wrong.yaml").write_text(wrong, encoding="utf-8")
    return main(
        ["fit", str(tmp_path / "wrong.yaml"), str(FOLDER / f"{name}-readings.csv"), *options]
    )


@pytest.mark.parametrize("name", STATED)
@pytest.mark.parametrize("estimator", ["full", "length-equations"])
def test_a_length_that_no_machine_explains_is_refused(
    name: str, estimator: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert fit(tmp_path, name, 1.05, "--estimator", estimator) == 3
    out, err = capsys.readouterr()
    assert not out and TOLD[name].format("0.952") in err and "readings.csv:2:1: " in err


@pytest.mark.parametrize("name", STATED)
def test_a_length_that_hardly_any_machine_explains_is_doubted(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert fit(tmp_path, name, 1.003) == 0
    out, err = capsys.readouterr()
    assert f"warning: {TOLD[name].partition('{}')[0]}0.997" in err and "correct the " in err
    assert " µm per m more" in out and "e+0" not in out.split("what to do")[1]
    assert fit(tmp_path, name, 1.0001) == 0
    assert "of the stated" not in capsys.readouterr().err


def test_readings_of_an_unknown_radius_in_another_unit_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (FOLDER / "bryan-gauge-readings.csv").read_text(encoding="utf-8")
    (tmp_path / "r.csv").write_text(text.replace("_mm", "_um"), encoding="utf-8")
    gauge = ["fit", str(FOLDER / "bryan-gauge.yaml"), str(tmp_path / "r.csv")]
    assert main([*gauge, "--variant", "radius unknown"]) == 3
    told = "gauge: the read radius is 0.001 of the drawn 300 mm: correct the radius in"
    assert told in capsys.readouterr().err


def test_one_wrong_reading_is_no_wrong_length(capsys: pytest.CaptureFixture[str]) -> None:
    experiment = bp.load(FOLDER / "bar-bell.yaml", "length known")
    readings = pandas.read_csv(FOLDER / "bar-bell-readings.csv")
    readings.loc[0, "x_mm"] += 5.0
    found = bp.fit(experiment, readings)
    assert "along x" in str(found).split("largest residuals")[1].splitlines()[1]
    assert wording.OF_THE_STATED_ONES not in str(found)


BARS = ["fit", str(FOLDER / "bar-bell.yaml"), str(FOLDER / "bar-bell-readings.csv")]
BARS += ["--variant", "length known", "--json"]


@pytest.mark.parametrize("estimator", ["full", "length-equations"])
def test_few_degrees_of_freedom_are_told_and_widen(
    estimator: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*BARS, "--estimator", estimator]) == 0
    out, err = capsys.readouterr()
    assert wording.FROM_DEGREES_OF_FREEDOM_IS_ITSELF in err and "--sigma given" in err
    for one in json.loads(out)["adjustments"].values():
        assert one["expanded_uncertainty"] == pytest.approx(
            t.ppf(0.975, 6) * one["standard_uncertainty"]
        )


def test_stated_uncertainties_and_many_degrees_of_freedom_raise_no_doubt(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main([*BARS, "--sigma", "given"]) == 0
    out, err = capsys.readouterr()
    assert "degrees of freedom" not in err
    for one in json.loads(out)["adjustments"].values():
        assert one["expanded_uncertainty"] == pytest.approx(1.959964 * one["standard_uncertainty"])
    gauge = ["fit", str(FOLDER / "bryan-gauge.yaml"), str(FOLDER / "bryan-gauge-readings.csv")]
    assert main([*gauge, "--variant", "radius known"]) == 0
    out, err = capsys.readouterr()
    assert "degrees of freedom" not in err and "expanded, 95 %" in out
