"""`ballplate map` as a user meets it."""

from __future__ import annotations

import csv
import io
import json
import re
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.machine_files.description import reference_functions, stated_function
from ballplate.extensions.machine_files.machine_file import load_machine
from ballplate.extensions.maps.error_sources import CONVENTION
from ballplate.extensions.maps.map_places import PlacesAsked, map_places
from ballplate.extensions.maps.volumetric_errors import Volumetric
from ballplate.presentation import number

from tests.extensions.maps import wording

MACHINES = Path("designs/park/machines")
ARM, BRIDGE, MEASURED = (
    MACHINES / f"{name}.yaml" for name in ("gec-like", "npl-like", "measured-errors")
)

SCALES = """\
title: scales of 10, 20 and 30 um/m
arrangement: FB1
volume: {x: [0 mm, 400 mm], y: [0 mm, 300 mm], z: [0 mm, 1200 mm]}
errors:
  EXX: {polynomial: [1 um, 4 um]}
  EYY: {polynomial: [0 um, 6 um], bandwidth: 2 um}
  EZZ: {polynomial: [0 um, 36 um]}
"""


def run(*arguments: str | Path) -> int:
    return main([str(argument) for argument in arguments])


@pytest.fixture
def scales(tmp_path: Path) -> Path:
    path = tmp_path / "scales.yaml"
    path.write_text(SCALES, encoding="utf-8")
    return path


def test_text(scales: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("map", scales, "--grid", "2,2,2") == 0
    out, err = capsys.readouterr()
    assert err.count("\n") == 1 and "errors.EXX.polynomial: 1 µm is subtracted" in err
    lines = out.split("\n")
    assert lines[1:3] == [wording.CARRIES_CARRIES_THE_PROBE, CONVENTION]
    # (0.4 x 4 + 0.3 x 6 + 1.2 x 36) / 1.3 = 35.85 along every diagonal; random: 0.3 / 1.3 of 1 um
    # at both ends.
    diagonals = [line.split() for line in lines if line.startswith("diagonal ")]
    assert [row[-2:] for row in diagonals] == [["35.846", "0.326"]] * 4
    assert (
        "range in µm: X 4.000, Y 6.000, Z 36.00, resultant 36.72; largest resultant 36.72 µm at"
        " (400, " in out
    )
    assert "; largest U of a co-ordinate 1.00 µm" in out


@pytest.mark.parametrize("machine", [BRIDGE, MEASURED])
def test_text_says_what_the_data_say(machine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ("--grid", "3,2,2", "--draw", "2")
    assert run("map", machine, *options, "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert run("map", machine, *options) == 0
    lines = capsys.readouterr().out.splitlines()
    tables = [list(rows) for is_row, rows in groupby(lines, lambda one: "  " in one) if is_row]
    lengths, points, drawn = ([re.split("  +", row.strip()) for row in one[1:]] for one in tables)

    def shown(row: list[str], *values: float) -> bool:
        # Two digits of the uncertainty, or three of what is shown.
        return [float(cell) for cell in row] == pytest.approx(list(values), rel=6e-3, abs=6e-3)

    at = {tuple(one["position"]): np.array(one["error"]) for one in told["grid"]}
    for (name, start, end, *row), one in zip(lengths, told["lengths"], strict=True):
        ends = [np.array(one[key]) for key in ("from", "to")]
        assert [start, end] == [f"({', '.join(f'{1e3 * x:.10g}' for x in end)})" for end in ends]
        moved = [end + at[tuple(end.tolist())] for end in ends]
        length = float(np.linalg.norm(ends[1] - ends[0]))
        error = float(np.linalg.norm(moved[1] - moved[0])) - length
        assert (one["length"], one["error"]) == pytest.approx((length, error), abs=1e-12)
        assert name == one["name"] and row[0] == f"{1e3 * length:.3f}"
        assert shown(row[1:], 1e6 * error, 1e6 * one["expanded_uncertainty"])
    for row, one in zip(points, told["grid"], strict=True):
        assert one["resultant"] == pytest.approx(np.linalg.norm(one["error"]))
        values = [*one["error"], *one["expanded_uncertainty"], one["resultant"]]
        assert shown(row, *(1e3 * x for x in one["position"]), *(1e6 * x for x in values))
    resultants = np.array([one["resultant"] for one in told["grid"]])
    worst = told["grid"][int(resultants.argmax())]
    place = ", ".join(f"{1e3 * x:.10g}" for x in worst["position"])
    ranges = [*np.ptp(list(at.values()), axis=0), np.ptp(resultants)]
    words = zip(("X", "Y", "Z", "resultant"), ranges, strict=True)
    u = max(max(one["expanded_uncertainty"]) for one in told["grid"])
    assert (
        f"range in µm: {', '.join(f'{name} {number(1e6 * one)}' for name, one in words)}; largest"
        f" resultant {number(1e6 * resultants.max())} µm at ({place}) mm; largest U of a"
        f" co-ordinate {number(1e6 * u, 3)} µm"
    ) in lines
    draws = told["realisations"]
    for k, (count, *row) in enumerate(drawn):
        size = np.linalg.norm(draws["errors"][k], axis=1).max()
        assert count == str(k + 1)
        assert shown(row, 1e6 * size, *(1e6 * one for one in draws["lengths"][k]))


def test_what_rounds_to_zero_has_no_sign(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "small.yaml"
    path.write_text(
        SCALES.replace("[0 um, 36 um]", "[0 um, -4 nm]").replace("6 um]", "-0.1 nm]"),
        encoding="utf-8",
    )
    assert run("map", path, "--grid", "2,2,2") == 0
    assert not re.search(r"-0\.0+\b", capsys.readouterr().out)


def test_json_has_full_precision(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("map", BRIDGE, "--grid", "3,2,2", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    built = Volumetric(load_machine(BRIDGE))
    expected = built.errors(map_places(built.volume, PlacesAsked((3, 2, 2))).points)
    assert [one["error"] for one in found["grid"]] == expected.errors.tolist()
    assert [one["expanded_uncertainty"] for one in found["grid"]] == expected.uncertainties.tolist()
    assert [one["error"] for one in found["lengths"]] == built.lengths(
        *built.volume.diagonals
    ).errors.tolist()
    assert found["arrangement"] == "MB1" and found["coverage_factor"] == 1.0
    assert run("map", ARM, "--curves", "--json") == 0
    phi1 = json.loads(capsys.readouterr().out)["numbers"][0]
    assert (phi1["value"], phi1["meaning"]) == (pytest.approx(7.2e-6), wording.TILT_OF_THE_COLUMN)


def test_a_line_between_two_points(capsys: pytest.CaptureFixture[str]) -> None:
    diagonal = "900 mm, 0 mm, 0 mm to [0 mm, 1.15 m, 400 mm]"
    assert run("map", BRIDGE, "--line", diagonal, "--points", "3", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert [one["position"] for one in found["line"]] == [
        [0.9, 0.0, 0.0],
        [0.45, 0.575, 0.2],
        [0.0, 1.15, 0.4],
    ]
    built = Volumetric(load_machine(BRIDGE))
    second = built.lengths(*built.volume.diagonals)
    (length,) = found["lengths"]
    assert length["error"] == second.errors[1]
    assert length["expanded_uncertainty"] == second.uncertainties[1]


def test_a_parametric_error_on_its_line_and_at_the_reference_point(
    capsys: pytest.CaptureFixture[str],
) -> None:
    machine = load_machine(MEASURED)
    reference = reference_functions(machine)
    at = np.arange(0.0, 0.81, 0.05)
    t = machine.scaled(0, at)
    stated_error = next(one for one in machine.errors if one.name == "EYX")
    shape = stated_function(machine, stated_error)
    assert shape is not None
    stated, values, roll = (
        one.values(t)[:, 0] for one in (shape, reference["EYX"], reference["EAX"])
    )
    # Measured at z = 400 mm, the roll EAX adds -z EAX; least squares over the 17 points leave no
    # slope.
    left = stated + 0.4 * roll - values
    np.testing.assert_allclose(left, np.polyval(np.polyfit(at, left, 1), at), atol=1e-15)
    assert len(at) == 17 and abs(np.polyfit(at, values, 1)[0]) < 1e-16
    assert run("map", MEASURED, "--curves") == 0
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("EYX"))
    assert row.startswith("EYX    straightness of X in Y  X ")
    assert row.endswith("table of 17 points at y = 100 mm, z = 400 mm, least squares")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            ("--grid", "3,2,2"),
            "magnified 1000 times; length errors of the diagonals from the corners 1: 42.9 µm, 2: ",
        ),
        (
            ("--line", "y = 600 mm, z = 600 mm"),
            "Volumetric errors along x at y = 600 mm, z = 600 mm",
        ),
    ],
)
def test_pictures(
    options: tuple[str, ...], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib")
    written = []
    for name in ("one.svg", "two.svg"):
        assert run("map", ARM, *options, "--plot", tmp_path / name) == 0
        written.append((tmp_path / name).read_bytes())
    assert written[0] == written[1]
    assert words in written[0].decode("utf-8") and b"http" not in written[0].replace(
        b"http://www.w3.org", b""
    ).replace(b"http://purl.org", b"").replace(b"http://creativecommons.org", b"")
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ("--grid", "1000,1000,1000"),
            "1000000000 points are too many; at most 200000 are possible",
        ),
        (
            ("--line", "1 m, 1 m, 1 m to 1 m, 1 m, 1 m"),
            "both ends of a line coincide; give two points",
        ),
        (("--line", "y = 1 mm, z = 1 mm", "--plane", "z = 1 mm"), "not allowed with argument"),
        (("--plot", "map.gif"), "a picture's name ends in .svg, .png, .pdf"),
    ],
)
def test_wrong_usage(
    options: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        run("map", ARM, *options)
    assert caught.value.code == 2
    assert message in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ("--line", "y = 600 mm"),
            "a line keeps two axes fixed; write for example y = 600 mm, z = 600 mm",
        ),
        (("--line", "y = 5 m, z = 600 mm"), "the line is outside the volume in y"),
    ],
)
def test_wrong_usage_that_the_file_tells(
    options: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("map", ARM, *options) == 2
    out, err = capsys.readouterr()
    assert out == "" and message in err


def test_a_bad_file_is_status_3(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(
        SCALES.replace("FB1", "FB3").replace("[1 um, 4 um]", "[1 um, 4]"), encoding="utf-8"
    )
    assert run("map", path) == 3
    out, err = capsys.readouterr()
    assert out == "" and [line.partition(": ")[0] for line in err.strip().split("\n")] == [
        f"{path}:2:14",
        f"{path}:5:28",
    ]
    assert run("map", "designs/quickstart.yaml") == 3
    assert wording.THIS_IS_AN_EXPERIMENT in capsys.readouterr().err
    assert run("check", ARM) == 3
    assert wording.THIS_DESCRIBES_A in capsys.readouterr().err


@pytest.mark.parametrize(
    "places", [("--grid", "2,2,2"), ("--line", "y = 600 mm, z = 100 mm"), ("--plane", "z = 1 mm")]
)
def test_realisations_in_csv_are_those_in_json(
    places: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ("map", BRIDGE, *places)
    plain, text, data = (
        (run(*asked, *more), capsys.readouterr().out)[1]
        for more in (
            ("--format", "csv"),
            ("--draw", "3", "--format", "csv"),
            ("--draw", "3", "--json"),
        )
    )
    rows = list(csv.DictReader(io.StringIO(text)))
    estimate = [{k: v for k, v in row.items() if k != "realisation"} for row in rows]
    undrawn = list(csv.DictReader(io.StringIO(plain)))
    assert estimate[: len(undrawn)] == undrawn and len(rows) == 4 * len(undrawn)
    drawn = np.array(json.loads(data)["realisations"]["errors"])
    found = [[1e-6 * float(row[f"error_{axis}_um"]) for axis in "xyz"] for row in rows]
    np.testing.assert_allclose(found[len(undrawn) :], drawn.reshape(-1, 3), rtol=1e-9, atol=1e-16)
    numbers = [row["realisation"] for row in rows[:: len(undrawn)]]
    assert numbers == ["0", "1", "2", "3"]
    assert all(not row["U_x_um"] for row in rows[len(undrawn) :])
