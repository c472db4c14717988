"""`ballplate spline` as a user meets it."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import mpmath
import numpy as np
import pytest
from ballplate.cli import main

from tests.extensions.splines import wording

PART = "designs/gilsinn/table-1.csv"
DOME = (PART, "--y", "semi_finish_error", "--points", "12-32")
TANGENT = "37.084 mm, -37.084 mm"


def run(*arguments: str | Path) -> int:
    return main(["spline", *map(str, arguments)])


@pytest.fixture
def ring(tmp_path: Path) -> Path:
    """Roundness at 24 angles."""
    angles = np.arange(0, 360, 15)
    errors = 3 * np.cos(np.radians(angles - 20)) + np.cos(np.radians(3 * angles))
    path = tmp_path / "ring.csv"
    rows = "".join(f"{angle},{error}\n" for angle, error in zip(angles, errors, strict=True))
    path.write_text(f"angle_deg,error_um\n{rows}", encoding="utf-8")
    return path


def test_text(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(*DOME, "--start-slope", "0", "--evaluate", "0 mm, 20 mm") == 0
    out, err = capsys.readouterr()
    assert err == "" and max(map(len, out.splitlines())) <= 120
    assert wording.SEMI_FINISH_ERROR_AGAINST_ARC_LENGTH in out
    assert "prescribed: slope 0 at 0 mm" in out
    assert "cubic spline, 4 knots" in out and wording.FREE_COEFFICIENTS_DEGREES_OF_FREEDOM in out
    assert out.splitlines()[-2].split()[:2] == ["0", "12.17"]
    assert out.splitlines()[-2].endswith("0 µm/mm")


def test_json_is_in_metres_and_its_pieces_give_its_points(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert (
        run(*DOME, "--start-slope", "0", "--end-value", "-30 um", "--end", "0 mm, 0 mm", "--json")
        == 0
    )
    found = json.loads(capsys.readouterr().out)
    assert (found["free_coefficients"], found["degrees_of_freedom"], found["order"]) == (6, 15, 4)
    for held in found["prescribed"]:
        assert abs(held["missed_by"]) < 1e-18
    for point in found["points"]:
        piece = [one for one in found["pieces"] if one["start"] <= point["x"]][-1]
        u = point["x"] - piece["start"]
        assert sum(c * u**k for k, c in enumerate(piece["coefficients"])) == pytest.approx(
            point["curve"], abs=1e-17
        )
        assert point["residual"] == pytest.approx(point["y"] - point["curve"], abs=1e-18)
    assert [found["points"][0]["point"], found["points"][-1]["point"]] == ["12", "32"]
    squares = sum(point["residual"] ** 2 for point in found["points"])
    assert found["sigma"] == pytest.approx(math.sqrt(squares / 15)) and found["sigma_is_estimated"]


def test_features_share_value_and_slope(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = (*DOME, "--boundary", TANGENT, "--straight", "1", "--json", "--evaluate", "1.27 mm")
    assert run(*arguments) == 0
    free = json.loads(capsys.readouterr().out)
    assert free["boundaries"] == pytest.approx([0.00127], rel=1e-12)
    first, second = free["pieces"][:2]
    length = first["end"] - first["start"]
    assert first["coefficients"][0] + first["coefficients"][1] * length == pytest.approx(
        second["coefficients"][0]
    )
    assert first["coefficients"][1] == pytest.approx(second["coefficients"][1], rel=1e-9)
    assert max(abs(c) * length**k for k, c in enumerate(first["coefficients"]) if k > 1) < 1e-18
    assert run(*arguments, "--at", TANGENT, "slope", "0") == 0
    held = json.loads(capsys.readouterr().out)
    assert abs(held["values"][0]["slope"]) < 1e-15
    assert held["free_coefficients"] == free["free_coefficients"] - 1
    assert held["sum_of_squares"] > free["sum_of_squares"]


def test_knots_keep_away_from_boundaries(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """With a knot one point before a boundary the curve would be least known next to it, where
    points are as dense.
    """
    x = np.arange(0.0, 300.0, 10.0)
    errors = 5 * np.sin(x / 80) + np.random.default_rng(2).normal(0.0, 0.3, len(x))
    rows = "".join(f"{a},{b}\n" for a, b in zip(x, errors, strict=True))
    (tmp_path / "data.csv").write_text(f"position_mm,error_um\n{rows}", encoding="utf-8")
    spread = {}
    places = "120 mm, 145 mm, 160 mm"
    for knots in ([], ["--knots", "40 mm, 90 mm, 140 mm, 190 mm, 240 mm"]):
        arguments = (tmp_path / "data.csv", "--boundary", "150 mm", *knots)
        assert run(*arguments, "--evaluate", places, "--json") == 0
        found = json.loads(capsys.readouterr().out)
        spread[bool(knots)] = [
            value["standard_uncertainty"] / found["sigma"] for value in found["values"]
        ]
    assert max(spread[True]) > 1.3 * max(spread[True][::2]) and max(spread[False]) < 1.1 * max(
        spread[False][::2]
    )
    assert run(tmp_path / "data.csv", "--boundary", "150 mm") == 0
    out = capsys.readouterr().out
    assert "4 knots at 40, 90, 190, 240 mm" in out
    assert wording.FEATURES_SHARE_VALUE_AND_SLOPE in out
    # The feature's own end, without a boundary, is as equation (5) of the document has it.
    assert run(tmp_path / "data.csv", "--end", "155 mm", "--points", "1-16") == 0
    assert "3 knots at 40, 90, 140 mm" in capsys.readouterr().out


def test_the_feature_column_makes_no_boundaries_and_says_so(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(*DOME) == 0
    told = "one curve over nose, dome: the column feature makes no boundaries; --boundary does"
    assert told in capsys.readouterr().out
    assert run(*DOME, "--boundary", TANGENT, "--straight", "1") == 0
    out = capsys.readouterr().out
    assert "the column feature" not in out and "belongs to both" not in out


def test_uncertainties_given_and_estimated(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    rows = "".join(f"{k},{k % 3},{0.5 + 0.1 * k}\n" for k in range(12))
    (tmp_path / "data.csv").write_text(f"position_mm,error_um,u_um\n{rows}", encoding="utf-8")
    found = []
    for sigma in ("given", "estimated"):
        assert run(tmp_path / "data.csv", "--sigma", sigma, "--json") == 0
        found.append(json.loads(capsys.readouterr().out))
    given, estimated = found
    assert given["sigma"] == 1.0 and given["coverage_factor"] == pytest.approx(1.959964)
    factor = math.sqrt(given["sum_of_squares"] / given["degrees_of_freedom"])
    assert estimated["sigma"] == pytest.approx(factor) and estimated["coverage_factor"] > 2.3
    ratio = (
        estimated["points"][3]["standard_uncertainty"] / given["points"][3]["standard_uncertainty"]
    )
    assert ratio == pytest.approx(factor)
    assert run(tmp_path / "data.csv") == 0
    assert "sigma 1.000, given (" in capsys.readouterr().out


def test_nothing_is_told_of_uncertainty_without_degrees_of_freedom(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "data.csv").write_text(
        "position_mm,error_um\n0,0\n1,2\n2,1\n4,0\n", encoding="utf-8"
    )
    assert run(tmp_path / "data.csv", "--plot", tmp_path / "plot.svg") == 0
    assert wording.NO_DEGREES_OF_FREEDOM_ARE_LEFT in capsys.readouterr().out
    assert run(tmp_path / "data.csv", "--json", "--evaluate", "1 mm") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["sigma"] is None and found["values"][0]["standard_uncertainty"] is None
    assert run(tmp_path / "data.csv", "--uncertainty", "0.5 um") == 0
    assert "sigma 1.000, given\n" in capsys.readouterr().out


def test_a_closed_curve(capsys: pytest.CaptureFixture[str], ring: Path) -> None:
    arguments = ("--every", "2", "--json", "--evaluate", "0 deg, 360 deg")
    # In any order; the file is not taken for the period.
    assert run("--periodic", ring, *arguments) == 0
    found = json.loads(capsys.readouterr().out)
    assert run(ring, "--period", "360 deg", *arguments) == 0
    assert json.loads(capsys.readouterr().out) == found
    start, end = found["values"]
    assert end["x"] == pytest.approx(2 * math.pi)
    assert start["curve"] == pytest.approx(end["curve"], abs=1e-18)
    assert start["slope"] == pytest.approx(end["slope"], abs=1e-18)
    assert found["sigma"] < 1e-7


@pytest.mark.parametrize("powers", ["local", "global"])
def test_coefficients_for_a_controller(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, powers: str
) -> None:
    """The file evaluates to the curve, in the units of its columns' names."""
    arguments = (*DOME, "--start-slope", "0", "--powers", powers)
    assert run(*arguments, "-o", "-") == 0
    text = capsys.readouterr().out
    assert run(*arguments, "-o", tmp_path / "c.csv", "--json") == 0
    assert (tmp_path / "c.csv").read_text(encoding="utf-8") == text
    points = json.loads(capsys.readouterr().out)["points"]
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    assert list(rows[0]) == [
        "start_mm",
        "end_mm",
        "c0_um",
        "c1_um_per_mm",
        "c2_um_per_mm2",
        "c3_um_per_mm3",
    ]
    for point in points:
        x = point["x"] * 1e3
        row = [row for row in rows if float(row["start_mm"]) <= x + 1e-9][-1]
        u = x - float(row["start_mm"]) if powers == "local" else x
        value = sum(float(row[name]) * u**k for k, name in enumerate(list(row)[2:]))
        assert value == pytest.approx(point["curve"] * 1e6, abs=1e-9)


def test_drawings(tmp_path: Path) -> None:
    for first in (True, False):
        folder = tmp_path / str(first)
        folder.mkdir()
        plot, bars = folder / "fit.svg", folder / "whiskers.svg"
        assert (
            run(
                *DOME,
                "--start-slope",
                "0",
                "--plot",
                plot,
                "--whiskers",
                bars,
            )
            == 0
        )
        assert (
            plot.read_bytes().startswith(b"<?xml")
            and b"<title>semi finish error against arc length" in plot.read_bytes()
        )
        drawn = bars.read_text(encoding="utf-8")
        assert wording.POINTS_MAGNIFIED_TIMES in drawn
    assert (tmp_path / "True/fit.svg").read_bytes() == (tmp_path / "False/fit.svg").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (
            ("--knots", "10, 20 mm"),
            '--knots: "10" has no unit; write for example "10 mm" or "10 um"',
        ),
        (
            ("--start-slope", "3 um"),
            '--start-slope: "3 um" is not a slope; write for example "2 um/mm", or 0',
        ),
        (("--start-slope", "3 um/s"), '"3 um/s" is not a slope; write for example "2 um/mm", or 0'),
        (
            ("--start-slope", "0,2 um/mm"),
            '"0,2 um/mm" has a decimal comma; write for example "0.2 um/mm"',
        ),
        (("--start-value", "1 urad"), "--start-value:"),
        (("--at", "3 mm", "bend", "0"), '--at: "bend" should be value or slope'),
        (("--start", "end"), "the curve starts at its start"),
        (("--order", "1"), "--order should be 2 to 16"),
        (("--periodic",), "--periodic: the abscissa is a length; state the period"),
        (("--period", "-1 mm"), '--period: "-1 mm" must be above zero'),
        (("--boundary", "1 mm, 2 mm, 3 mm"), "should be one abscissa, or two nominal co-ordinates"),
        (("--uncertainty", "0 um"), "must be above zero"),
        (("--plot", "a.svg", "--whiskers", "a.svg"), "are the same file; name another"),
        (("--json", "-o", "-"), "both go to the screen"),
        (("--evaluate", "x mm"), '--evaluate: "x mm" is not a length'),
    ],
)
def test_wrong_usage(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], text: str
) -> None:
    assert run(*DOME, *arguments) == 2
    out, err = capsys.readouterr()
    assert (
        out == "" and err.startswith("ballplate spline: ") and text in err and err.count("\n") == 1
    )


@pytest.mark.parametrize(
    ("arguments", "texts"),
    [
        (
            ("--evaluate", "60 mm, -1 mm"),
            ["-1 mm is outside the curve", "60 mm is outside the curve, from 0 mm to 56.9"],
        ),
        (("--knots", "70 mm"), ["the knot at 70 mm is not between the ends, 0 mm and 56.9"]),
        (
            ("--knots", "5.1 mm, 5.2 mm, 5.3 mm, 5.4 mm, 5.5 mm, 5.6 mm, 6 mm"),
            ["the curve lacks", "leave out knots"],
        ),
        (
            ("--start-slope", "0", "--at", "start", "slope", "1 um/mm"),
            ["the slope at 0 mm contradicts what else is prescribed; leave it out, or add a knot"],
        ),
        (("--boundary", "1 mm, 1 mm"), ["the point (1 mm, 1 mm) is not on the profile"]),
        (
            ("--boundary", "90 mm", "--straight", "3"),
            ["there is no feature 3; there are 2", "the boundary at 90 mm is not"],
        ),
        (("--boundary", "9 mm", "--knots", "9 mm"), ["9 mm is a boundary and a knot"]),
        (("--order", "2", "--boundary", "9 mm"), ["broken lines share no slope"]),
        (
            ("--x", "nominal_z", "--start", TANGENT),
            ["nominal co-ordinates define a point on the profile"],
        ),
        (("--points", "12-32,44"), ['no point "44"']),
        (
            ("--points", "12"),
            ["all points are at 0 mm, which defines no curve; give points at several abscissae"],
        ),
        (("--points", "12-40"), ['"12-40" goes beyond the points, 1 to 32']),
        (
            ("--sigma", "given"),
            ["no uncertainties are stated; add a column such as u_um, or give"],
        ),
        (("--start", "1 mm, 1 mm"), ["the point (1 mm, 1 mm) is not on the profile"]),
        (("--end", "20 mm, -20 mm"), ["the point (20 mm, -20 mm) is not on the profile"]),
    ],
)
def test_what_cannot_be_fitted(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], texts: list[str]
) -> None:
    assert run(*DOME, *arguments) == 3
    out, err = capsys.readouterr()
    assert out == "" and all(text in err for text in texts)
    assert all(line.startswith(f"{PART}: ") for line in err.splitlines())


def test_many_points_are_fitted_and_too_many_coefficients_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    x = np.arange(8000)
    rows = "".join(f"{a},{b}\n" for a, b in zip(x / 10, np.sin(x / 500), strict=True))
    (tmp_path / "data.csv").write_text(f"position_mm,error_um\n{rows}", encoding="utf-8")
    assert run(tmp_path / "data.csv", "--every", "100", "--json") == 0
    assert json.loads(capsys.readouterr().out)["sigma"] < 1e-10
    assert run(tmp_path / "data.csv") == 3
    assert wording.COEFFICIENTS_ARE_TOO_MANY in capsys.readouterr().err


def test_points_at_the_same_place_are_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    rows = "".join(f"{10 - k // 2},{k // 2},{k}\n" for k in (0, 2, 3, 6, 8))
    (tmp_path / "data.csv").write_text(
        f"nominal_x_mm,nominal_z_mm,error_um\n{rows}", encoding="utf-8"
    )
    assert run(tmp_path / "data.csv") == 3
    assert wording.TWO_NEIGHBOURING_POINTS_ARE_AT_MM in capsys.readouterr().err


def test_whiskers_need_a_profile(
    capsys: pytest.CaptureFixture[str], ring: Path, tmp_path: Path
) -> None:
    assert run(ring, "--whiskers", tmp_path / "a.svg") == 2
    assert "--whiskers needs a profile" in capsys.readouterr().err
    assert run(*DOME, "--plot", tmp_path / "missing" / "a.svg") == 3
    assert wording.CANNOT_BE_WRITTEN in capsys.readouterr().err


def test_a_picture_of_an_unknown_kind_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as leave:
        run(*DOME, "--plot", "a.gif")
    assert leave.value.code == 2
    assert wording.A_PICTURES_NAME_ENDS in capsys.readouterr().err


def test_help(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as leave:
        run("--help")
    assert leave.value.code == 0
    out = capsys.readouterr().out
    assert "--start-slope SLOPE" in out and "--whiskers FILE" in out


@pytest.mark.parametrize("order", [4, 13, 16])
def test_a_polynomial_through_as_many_points_as_its_order(
    order: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Lagrange's form in fifty digits, between the points and by the polynomial that is written."""
    positions = [20 + 60 * k for k in range(order)]
    errors = np.random.default_rng(order).normal(0, 3, order).round(2).tolist()
    path = tmp_path / "curve.csv"
    rows = "".join(f"{x},{y}\n" for x, y in zip(positions, errors, strict=True))
    path.write_text(f"position_mm,error_um\n{rows}", encoding="utf-8")
    places = [20, 35, 50, 333, positions[-1] - 25]
    at = ", ".join(f"{x} mm" for x in places if x <= positions[-1])
    assert run(path, "--order", order, "--knots", "none", "--evaluate", at, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    with mpmath.workdps(50):

        def exact(at: int) -> float:
            terms = []
            for k, x in enumerate(positions):
                others = [mpmath.mpf(at - other) / (x - other) for other in positions if other != x]
                terms.append(mpmath.mpf(str(errors[k])) * mpmath.fprod(others))
            return float(mpmath.fsum(terms)) * 1e-6

        expected = [exact(x) for x in places if x <= positions[-1]]
    (piece,) = found["pieces"]
    size = max(map(abs, expected))
    for told, true in zip(found["values"], expected, strict=True):
        assert abs(told["curve"] - true) < 1e-6 * size
        by_piece = np.polynomial.polynomial.polyval(
            told["x"] - piece["start"], piece["coefficients"]
        )
        assert abs(by_piece - true) < 1e-6 * size
