"""`ballplate run --reliability`, and what `fit` suspects, as their users see them."""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
import scipy.stats
from ballplate.cli import main
from ballplate.presentation import number

from tests.reference.small_quickstart import small_sections

QUICKSTART = "designs/quickstart.yaml"
BAR_BELL = "designs/hurt_foss/bar-bell.yaml"
Rows = list[dict[str, str]]


def test_table_of_the_quickstart(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "all.csv"
    assert main(["run", "--reliability", QUICKSTART, "-o", str(table)]) == 0
    out = capsys.readouterr().out
    assert "754 observations; redundancy 580.0 in total" in out
    assert "cannot be detected, harmless: offset x of probe down, offset y of probe down" in out
    assert "DANGEROUS" not in out and "scale of the certificate of plate" in out
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    singles = [row for row in rows if row["redundancy"]]
    assert len(rows) > len(singles) == 754
    assert sum(float(row["redundancy"]) for row in singles) == pytest.approx(580.0)


def test_a_length_that_nothing_checks_is_dangerous(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--variant", "length known", "--json"]
    assert main(["run", "--reliability", BAR_BELL, *options]) == 0
    found = json.loads(capsys.readouterr().out)
    by_name = {event["name"]: event for event in found["events"]}
    certificate = by_name["certified length 1-2 of bar"]
    assert certificate["minimal_detectable"] is None and certificate["harmless"] is False
    # The longest distance between two evaluation points is about two and a half bars long.
    assert 2.0 < certificate["effects"]["U6"]["per_unit"] < 3.0
    assert by_name["offset x of probe cone"]["harmless"] is True
    assert found["redundancy"] == pytest.approx(found["degrees_of_freedom"])


def test_sigma_given_is_the_normal_test(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--sigma", "given", "--false-alarm", "5%", "--power", "90%"]
    file = [BAR_BELL, "--variant", "flat"]
    assert main(["run", "--reliability", *file, *options, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["noncentrality"] == pytest.approx(
        1.959964 + 1.281552, abs=1e-4
    )
    assert main(["run", "--reliability", *file, *options]) == 0
    words = "power of 90 % by a test with a false alarm of 5 %, sigma as given: 3.242 standard"
    assert words in capsys.readouterr().out


def one_distance() -> bp.Experiment:
    """Nothing but one distance tells the scale, and nothing checks it."""
    prior = {"parameter": "EXX[2]", "value": "0 um", "standard_uncertainty": "1 um"}
    distance = {"kind": "distances", "pairs": [["r1c1", "r1c3"]], "standard_uncertainty": "1 um"}
    told = small_sections(calibration=[distance], priors=[prior], probes={"down": ["0 mm"] * 3})
    positions = [one | {"probes": ["down"]} for one in told["positions"]]
    return bp.experiment(told | {"positions": positions})


@pytest.mark.parametrize("make", [bp.quickstart, one_distance])
def test_text_says_what_the_data_say(make: Callable[[], bp.Experiment]) -> None:
    found = bp.reliability(make())
    told, lines = found.to_dict(), found.lines()
    singles, freedom = told["observations_by_name"], told["degrees_of_freedom"] - 1
    limit = scipy.stats.f.isf(0.001, 1, freedom)
    power = scipy.stats.ncf.sf(limit, 1, freedom, told["noncentrality"] ** 2)
    assert power == pytest.approx(0.8, rel=1e-6)
    biases = {one["name"]: one for one in (*singles, *told["events"])}

    def cell(value: float | None) -> str:
        return "never" if value is None else number(1e6 * value, 3)

    def order(bias: dict[str, Any]) -> tuple[bool, float, float]:
        """What no test finds although it changes lengths comes first."""
        sizes = (bias["effects"][symbol].get("change", 0.0) for symbol in ("U6", "U5"))
        return (bias.get("harmless", True), *(-size for size in sizes))

    for heading in ("worst readings", "worst items", "events"):
        start = next(k for k, line in enumerate(lines) if line.startswith(heading)) + 1
        rows = [re.split("  +", line) for line in lines[start : lines.index("", start)]]
        for name, *row in rows:
            bias = biases[name]
            assert (bias.get("redundancy", 1.0) < 1e-9) == (row[0] == "0")
            expected = [number(bias["redundancy"], 3)] if heading != "events" else []
            detectable = cell(bias["minimal_detectable"])
            by_fit = "-" if name.startswith("drift") else cell(bias["found_by_fit"])
            expected += [detectable, by_fit, {"m": "µm", "rad": "µrad", "1": "ppm"}[bias["unit"]]]
            for one in bias["effects"].values():
                size, u = (one.get(key, 0.0) for key in ("change", "standard_uncertainty"))
                expected.append(f"{cell(size)} ({cell(u)})" if "change" in one else "-")
            at = bias["effects"]["U6"]["at"]
            assert row == expected + [at] * (detectable != "never"), name
        chosen = [
            one for one in singles if (one["kind"] == "reading") == (heading[6:] == "readings")
        ]
        if heading != "events":
            assert [row[0] for row in rows] == [
                one["name"] for one in sorted(chosen, key=order)[:5]
            ]
    positions = lines[lines.index("") + 2 :]
    for row in (re.split("  +", line) for line in positions[: positions.index("")]):
        there = [
            one for one in singles if re.search(f" in position {row[0]}( with|,)", one["name"])
        ]
        left = [one["redundancy"] for one in there]
        by_bias = max(there, key=lambda one: one["minimal_detectable"])
        by_effect = max(there, key=lambda one: one["effects"]["U6"]["change"])
        u6 = (by_effect["effects"]["U6"][key] for key in ("change", "standard_uncertainty"))
        assert row[1:] == [
            *(str(len(there) // 3), number(min(left), 3), number(sum(left) / len(left), 3)),
            *(cell(by_bias["minimal_detectable"]), cell(by_bias["found_by_fit"])),
            by_bias["name"].replace(f" in position {row[0]}", ""),
            "{} ({})".format(*map(cell, u6)),
            by_effect["name"].replace(f" in position {row[0]}", ""),
        ]


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
    assert main(["run", "--reliability", BAR_BELL, "-o", str(tmp_path / "t.csv")]) == 2
    assert "choose one with --variant: length known, " in capsys.readouterr().err
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


def three_readings(rows: Rows) -> None:
    for i, column, size in ((5, "z_mm", 2.0), (98, "x_mm", -2.0), (200, "y_mm", 2.5)):
        add(rows[i], column, size)


def warm_twice(rows: Rows) -> None:
    """The plate is larger by 2 ppm in two positions, one after the other."""
    for row in rows:
        if row["position"] in ("x high", "y low"):
            for column in ("x_mm", "y_mm", "z_mm"):
                add(row, column, 2e-3 * float(row[column]))


def late_slip(rows: Rows) -> None:
    for row in [row for row in rows if row["position"] == "x low"][33:]:
        add(row, "z_mm", -0.8)


def waves(rows: Rows) -> None:
    for row in rows:
        add(row, "x_mm", math.sin(float(row["x_mm"]) / 40.0))


@pytest.mark.parametrize(
    ("spoil", "told", "sizes"),
    [
        (nothing, [], []),
        (three_readings, [" line 7 of", " line 100 of", " line 202 of"], [2e-6, -2e-6, 2.5e-6]),
        (
            warm_twice,
            ["size of plate in position x high and size of plate in position y low "],
            [2e-6],
        ),
        (late_slip, ["slipped in position x low between lines 8[0-5] and 8[5-9] of"], [-0.8e-6]),
        (waves, ["the error model lacks an error in x that depends on x"], [None]),
    ],
)
def test_what_a_fit_contradicts(
    spoil: Callable[[Rows], None],
    told: list[str],
    sizes: list[float | None],
    clean: Rows,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    # With hundreds of degrees of freedom both tests find the same.
    sigma = "given" if spoil in (nothing, three_readings, late_slip) else "estimated"
    rows = [dict(row) for row in clean]
    spoil(rows)
    with (tmp_path / "r.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    assert main(["fit", QUICKSTART, str(tmp_path / "r.csv"), "--sigma", sigma, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["diagnosis"]["contradicted"]
    words = [one["words"] for one in found]
    assert len(words) == len(told), words
    for pattern, size in zip(told, sizes, strict=True):
        (one,) = (one for one in found if re.search(pattern, one["words"]))
        assert one["p_value"] < 0.01
        if size is not None:
            best = max(
                one["sizes"], key=lambda each: abs(each["value"]) / each["standard_uncertainty"]
            )
            value = best["value"] if spoil in (three_readings, late_slip) else abs(best["value"])
            assert abs(value - size) < 3.5 * best["standard_uncertainty"]
