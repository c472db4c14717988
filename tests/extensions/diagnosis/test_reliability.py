"""`ballplate run --reliability`, and what `fit` suspects, as their users see them."""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ballplate.cli import main

from tests.extensions.diagnosis import wording

QUICKSTART = "designs/quickstart.yaml"
Rows = list[dict[str, str]]


def test_table_of_the_quickstart(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "all.csv"
    assert main(["run", "--reliability", QUICKSTART, "-o", str(table)]) == 0
    out = capsys.readouterr().out
    assert "754 observations; redundancy 580.0 in total" in out
    assert wording.ESTIMATED_FROM_THE_OTHER_RESIDUALS in out
    assert wording.CANNOT_BE_DETECTED in out
    assert "DANGEROUS" not in out and wording.SCALE_OF_THE_CERTIFICATE_OF_PLATE in out
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    singles = [row for row in rows if row["redundancy"]]
    assert len(rows) > len(singles) == 754
    assert {row["unit"] for row in singles} == {"m"} and "MDB, µm" in out
    assert sum(float(row["redundancy"]) for row in singles) == pytest.approx(580.0)
    worst = max(
        (row for row in rows if row["kind"] == "reading"),
        key=lambda row: float(row["minimal detectable"]),
    )
    assert all(word in worst["name"] for word in ("z high", "r1c1", "x"))


def test_a_length_that_nothing_checks_is_dangerous(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(
            [
                "run",
                "--reliability",
                "designs/hurt_foss/bar-bell.yaml",
                "--variant",
                "length known",
                "--json",
            ]
        )
        == 0
    )
    found = json.loads(capsys.readouterr().out)
    by_name = {event["name"]: event for event in found["events"]}
    certificate = by_name["certified length 1-2 of bar"]
    assert certificate["minimal_detectable"] is None and certificate["harmless"] is False
    # The longest distance between two evaluation points is about two and a half bars long.
    assert 2.0 < certificate["effects"]["U6"]["per_unit"] < 3.0
    assert by_name["offset x of probe cone"]["harmless"] is True
    assert found["redundancy"] == pytest.approx(found["degrees_of_freedom"])


def test_sigma_given_is_the_normal_test(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--sigma", "given", "--false-alarm", "5%", "--power", "90%", "--json"]
    assert (
        main(
            [
                "run",
                "--reliability",
                "designs/hurt_foss/bar-bell.yaml",
                "--variant",
                "flat",
                *options,
            ]
        )
        == 0
    )
    assert json.loads(capsys.readouterr().out)["noncentrality"] == pytest.approx(
        1.959964 + 1.281552, abs=1e-4
    )


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--power", "0.8"], 'expected a percentage between 0% and 100%, such as 0.1%, not "0.8"'),
        (["--false-alarm", "90%"], "--power must be above --false-alarm"),
    ],
)
def test_wrong_shares(options: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    try:
        status = main(["run", "--reliability", QUICKSTART, *options])
    except SystemExit as left:
        status = int(str(left.code))
    assert status == 2 and told in capsys.readouterr().err


def test_one_table_is_of_one_experiment(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(
            [
                "run",
                "--reliability",
                "designs/hurt_foss/bar-bell.yaml",
                "-o",
                str(tmp_path / "t.csv"),
            ]
        )
        == 2
    )
    assert wording.CHOOSE_ONE_WITH_VARIANT in capsys.readouterr().err
    own = tmp_path / "own.yaml"
    own.write_text(Path(QUICKSTART).read_text(encoding="utf-8"), encoding="utf-8")
    assert main(["run", "--reliability", str(own), "-o", str(own)]) == 2
    assert "would overwrite" in capsys.readouterr().err
    assert main(["run", "--reliability", QUICKSTART, "-o", str(tmp_path / "no" / "t.csv")]) == 3
    assert "cannot be written" in capsys.readouterr().err


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Rows:
    path = tmp_path_factory.mktemp("readings") / "readings.csv"
    assert main(["simulate", QUICKSTART, "-o", str(path)]) == 0
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def add(row: dict[str, str], column: str, micrometres: float) -> None:
    row[column] = repr(float(row[column]) + 1e-3 * micrometres)


def nothing(rows: Rows) -> None:
    pass


def one_reading(rows: Rows) -> None:
    add(rows[39], "y_mm", 3.0)


def three_readings(rows: Rows) -> None:
    for i, column, size in ((5, "z_mm", 2.0), (98, "x_mm", -2.0), (200, "y_mm", 2.5)):
        add(rows[i], column, size)


def slip(rows: Rows) -> None:
    for row in [row for row in rows if row["position"] == "z high"][12:]:
        add(row, "y_mm", 1.2)


def probe(rows: Rows) -> None:
    for row in rows:
        if row["probe"] == "left":
            add(row, "z_mm", -2.0)


def dirt(rows: Rows) -> None:
    for row in rows:
        if row["position"] == "x low" and row["ball"] == "r3c2":
            add(row, "y_mm", 1.5)


def warm(rows: Rows) -> None:
    """The plate is larger by 3 ppm in one position."""
    for row in rows:
        if row["position"] == "z low":
            add(row, "x_mm", 3e-3 * float(row["x_mm"]))
            add(row, "y_mm", 3e-3 * float(row["y_mm"]))


def warm_twice(rows: Rows) -> None:
    """The plate is larger by 2 ppm in two positions, one after the other."""
    for row in rows:
        if row["position"] in ("x high", "y low"):
            for column in ("x_mm", "y_mm", "z_mm"):
                add(row, column, 2e-3 * float(row[column]))


def loose_ball(rows: Rows) -> None:
    """A ball stands 1.5 um out of the plate from one position on."""
    for row in rows:
        if row["position"] in ("y low", "y high") and row["ball"] == "r2c4":
            add(row, "y_mm", 1.5)


def late_slip(rows: Rows) -> None:
    for row in [row for row in rows if row["position"] == "x low"][33:]:
        add(row, "z_mm", -0.8)


def restless(rows: Rows) -> None:
    """Noise is three times as large in one position."""
    generator = np.random.default_rng(4)
    for row in rows:
        if row["position"] == "x high":
            for column in ("x_mm", "y_mm", "z_mm"):
                add(row, column, 0.2 * 8.0**0.5 * generator.standard_normal())


def waves(rows: Rows) -> None:
    for row in rows:
        add(row, "x_mm", math.sin(float(row["x_mm"]) / 40.0))


@pytest.mark.parametrize(
    ("spoil", "told", "sizes"),
    [
        (nothing, [], []),
        (
            one_reading,
            [
                "ball r3c5 in position z high with down read .* too high in y .* leave out line 41"
                " of r.csv"
            ],
            [3e-6],
        ),
        (
            three_readings,
            [
                "too high in z .* line 7 of",
                "too low in x .* line 100 of",
                "too high in y .* line 202 of",
            ],
            [2e-6, 2e-6, 2.5e-6],
        ),
        (
            slip,
            [
                "plate slipped in position z high, by 1.* along y, between lines 3[678] and (39|40)"
                " of r.csv"
            ],
            [1.2e-6],
        ),
        (
            probe,
            [
                "offset z of probe (left|right) stated [12].* too .*; it cannot be distinguished"
                " from offset z of probe "
            ],
            [2e-6],
        ),
        (
            dirt,
            [
                "ball r3c2 in position x low read 1.* too high in y each time .* lines 63 and 88 of"
                " r.csv"
            ],
            [1.5e-6],
        ),
        (
            warm_twice,
            [
                r"plate [12]\.\d.* ppm larger in position x high and [12]\.\d.* ppm larger in"
                r" position y low .*"
            ],
            [2e-6],
        ),
        (
            loose_ball,
            ["ball r2c4 displaced on its plate from position y low on, by -?1.* along z"],
            [1.5e-6],
        ),
        (
            late_slip,
            ["plate slipped in position x low, by -0.* along z, between lines 8[0-5] and 8[5-9]"],
            [0.8e-6],
        ),
        (
            warm,
            [
                r"plate [23]\.\d+\(0.\d+\) ppm larger in position z low .* check the temperature"
                r" there"
            ],
            [3e-6],
        ),
    ],
)
def test_what_a_fit_suspects(
    spoil: Callable[[Rows], None],
    told: list[str],
    sizes: list[float],
    clean: Rows,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    # With hundreds of degrees of freedom both tests find the same.
    sigma = "given" if spoil in (nothing, dirt, three_readings, late_slip) else "estimated"
    found = suspected(spoil, sigma, clean, tmp_path, capsys)
    words = [one["words"] for one in found]
    assert len(words) == len(told), words
    for pattern, size in zip(told, sizes, strict=True):
        (one,) = (one for one in found if re.search(pattern, one["words"]))
        assert abs(abs(one["value"]) - size) < 3.5 * one["standard_uncertainty"]
        assert one["statistic"] > one["limit"] > 4.0


def test_a_restless_position_is_no_set_of_single_readings(
    clean: Rows, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for sigma in ("given", "estimated"):
        (one,) = suspected(restless, sigma, clean, tmp_path, capsys)
        assert (
            one["kind"] == "scatter" and one["name"] == wording.SCATTER_OF_THE_READINGS_IN_POSITION
        )
        # With 150 readings the ratio is known to about a twelfth.
        assert one["value"] == pytest.approx(3.0, abs=0.8)


def test_a_wave_in_a_scale_is_laid_to_the_model(
    clean: Rows, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for sigma in ("given", "estimated"):
        (one,) = suspected(waves, sigma, clean, tmp_path, capsys)
        assert one["kind"] == "model" and wording.THE_BEST_EXPLANATION_IS_AN_ERROR in one["words"]
        assert one["value"] > 1.5 and one["lines"] == []


def suspected(
    spoil: Callable[[Rows], None],
    sigma: str,
    clean: Rows,
    folder: Path,
    capsys: pytest.CaptureFixture[str],
) -> list[dict[str, Any]]:
    rows = [dict(row) for row in clean]
    spoil(rows)
    with (folder / "r.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    assert main(["fit", QUICKSTART, str(folder / "r.csv"), "--sigma", sigma, "--json"]) == 0
    found: list[dict[str, Any]] = json.loads(capsys.readouterr().out).get("suspected", [])
    return found
