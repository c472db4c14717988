"""What `fit` says of results that look definite and are not: wrong lengths, few degrees of
freedom.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path

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


@pytest.mark.parametrize("variant", ["radius known", "radius unknown"])
def test_readings_of_a_gauge_in_another_unit_are_refused(
    variant: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (FOLDER / "bryan-gauge-readings.csv").read_text(encoding="utf-8")
    (tmp_path / "r.csv").write_text(text.replace("_mm", "_um"), encoding="utf-8")
    assert (
        main(
            ["fit", str(FOLDER / "bryan-gauge.yaml"), str(tmp_path / "r.csv"), "--variant", variant]
        )
        == 3
    )
    known = (
        "stated 300 mm; no machine has such a scale error"
        if variant == "radius known"
        else "drawn 300 mm"
    )
    assert (
        f"gauge: the read radius is 0.001 of the {known}: correct the radius in"
        in capsys.readouterr().err
    )


def test_one_wrong_reading_is_no_wrong_length(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with (FOLDER / "bar-bell-readings.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    rows[1][3] = str(float(rows[1][3]) + 5.0)
    with (tmp_path / "r.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows(rows)
    main(
        ["fit", str(FOLDER / "bar-bell.yaml"), str(tmp_path / "r.csv"), "--variant", "length known"]
    )
    out, err = capsys.readouterr()
    assert (
        "along x" in out.split("largest residuals")[1].splitlines()[1]
        and wording.OF_THE_STATED_ONES not in err
    )


@pytest.mark.parametrize("estimator", ["full", "length-equations"])
def test_few_degrees_of_freedom_are_told_and_widen(
    estimator: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["fit", str(FOLDER / "bar-bell.yaml"), str(FOLDER / "bar-bell-readings.csv")]
    arguments += ["--variant", "length known", "--estimator", estimator, "--json"]
    assert main(arguments) == 0
    out, err = capsys.readouterr()
    assert wording.FROM_DEGREES_OF_FREEDOM_IS_ITSELF in err and "--sigma given" in err
    for one in json.loads(out)["adjustments"].values():
        assert one["expanded_uncertainty"] == pytest.approx(
            t.ppf(0.975, 6) * one["standard_uncertainty"]
        )


def test_stated_uncertainties_and_many_degrees_of_freedom_raise_no_doubt(
    capsys: pytest.CaptureFixture[str],
) -> None:
    arguments = [
        "fit",
        str(FOLDER / "bar-bell.yaml"),
        str(FOLDER / "bar-bell-readings.csv"),
        "--json",
    ]
    assert main([*arguments, "--variant", "length known", "--sigma", "given"]) == 0
    out, err = capsys.readouterr()
    assert "degrees of freedom" not in err
    for one in json.loads(out)["adjustments"].values():
        assert one["expanded_uncertainty"] == pytest.approx(1.959964 * one["standard_uncertainty"])
    gauge = ["fit", str(FOLDER / "bryan-gauge.yaml"), str(FOLDER / "bryan-gauge-readings.csv")]
    assert main([*gauge, "--variant", "radius known"]) == 0
    out, err = capsys.readouterr()
    assert "degrees of freedom" not in err and "expanded, 95 %" in out
