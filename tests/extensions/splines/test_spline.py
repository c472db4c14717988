"""`ballplate spline` as a user meets it."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main

PART = "designs/gilsinn/table-1.csv"
DOME = (PART, "--y", "semi_finish_error", "--points", "12-32")


def run(*arguments: str | Path) -> int:
    return main(["spline", *map(str, arguments)])


def table(path: Path, x: np.ndarray, errors: np.ndarray) -> Path:
    rows = "".join(f"{a},{b}\n" for a, b in zip(x.tolist(), errors.tolist(), strict=True))
    path.write_text(f"position_mm,error_um\n{rows}", encoding="utf-8")
    return path


def test_json_is_in_metres_and_its_pieces_give_its_points(
    capsys: pytest.CaptureFixture[str],
) -> None:
    wanted = {"start_slope": "2 um/mm", "end_value": "-30 um", "end": "60 mm"}
    options = [f"--{name.replace('_', '-')}={value}" for name, value in wanted.items()]
    assert run(*DOME, *options, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    curve = bp.spline(PART, y="semi_finish_error", points="12-32", **wanted)
    assert found == curve.to_dict()
    assert (found["free_coefficients"], found["degrees_of_freedom"]) == (6, 15)
    assert curve.values([0.0], 1)[0] == pytest.approx(2e-3, abs=1e-15)
    assert curve.values([found["end"]])[0] == pytest.approx(-30e-6, abs=1e-18)
    for point in found["points"]:
        piece = [one for one in found["pieces"] if one["start"] <= point["x"]][-1]
        u = point["x"] - piece["start"]
        assert sum(c * u**k for k, c in enumerate(piece["coefficients"])) == pytest.approx(
            point["curve"], abs=1e-17
        )
        assert point["residual"] == pytest.approx(point["y"] - point["curve"], abs=1e-18)
    assert [found["points"][0]["point"], found["points"][-1]["point"]] == ["12", "32"]
    squares = sum(point["residual"] ** 2 for point in found["points"])
    assert found["sigma"] == pytest.approx(math.sqrt(squares / 15))
    assert found["coverage_factor"] == pytest.approx(2.13145, abs=1e-5)


def test_nothing_is_told_of_uncertainty_without_degrees_of_freedom(tmp_path: Path) -> None:
    path = table(tmp_path / "data.csv", np.array([0, 1, 2, 4]), np.array([0, 2, 1, 0]))
    curve = bp.spline(path)
    assert "no degrees of freedom are left to estimate sigma from" in str(curve)
    assert "standard uncertainty" not in str(curve)
    assert curve.to_dict()["sigma"] is None


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
    coefficients = ["c0_um", "c1_um_per_mm", "c2_um_per_mm2", "c3_um_per_mm3"]
    assert list(rows[0]) == ["start_mm", "end_mm", *coefficients]
    assert text.startswith("# semi_finish_error = c0 + c1 u + c2 u^2 + c3 u^3, where u is the arc")
    assert ("less the start of the piece" in text) == (powers == "local")
    for point in points:
        x = point["x"] * 1e3
        row = [row for row in rows if float(row["start_mm"]) <= x + 1e-9][-1]
        u = x - float(row["start_mm"]) if powers == "local" else x
        value = sum(float(row[name]) * u**k for k, name in enumerate(coefficients))
        assert value == pytest.approx(point["curve"] * 1e6, abs=1e-9)


def test_the_text_tells_what_the_json_has() -> None:
    """Polynomials in millimetres and micrometres, rounding as nothing; of many knots the first."""
    curve = bp.spline(PART, y="semi_finish_error", every=2, powers="global")
    found, text = curve.to_dict(), str(curve)
    knots = [f"{1e3 * knot:.6g}" for knot in found["knots"]]
    assert f"{len(knots)} knots at {', '.join(knots[:12])} mm and {len(knots) - 12} more;" in text
    lines, pieces = text.splitlines(), found["pieces"]
    for line, piece in zip(lines[-len(pieces) :], pieces, strict=True):
        ends, (c0, c1, c2, _) = [piece["start"], piece["end"]], piece["coefficients"]
        wanted = [*np.multiply(ends, 1e3), 1e6 * c0, 1e3 * c1, c2]
        assert [float(told) for told in line.split()[:5]] == pytest.approx(wanted, rel=1e-5)
    assert f"{found['coverage_factor']:.3g} times that for 95 %" in text


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--knots", "10, 20 mm"), 'argument --knots: "10" has no unit; write for example'),
        (("--start-slope", "3 um"), '--start-slope: "3 um" is not a slope; write for example'),
        (("--start-value", "1 urad"), "argument --start-value:"),
        (("--start", "1 mm, 2 mm"), "argument --start:"),
    ],
)
def test_wrong_usage(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], text: str
) -> None:
    with pytest.raises(SystemExit) as leave:
        run(*DOME, *arguments)
    out, err = capsys.readouterr()
    assert leave.value.code == 2 and out == "" and text in err


@pytest.mark.parametrize(
    ("arguments", "texts"),
    [
        (("--knots", "70 mm"), ["the knot at 70 mm is not between the ends, 0 mm and 56.9"]),
        (
            ("--knots", "5.1 mm, 5.2 mm, 5.3 mm, 5.4 mm, 5.5 mm, 5.6 mm, 6 mm"),
            ["the curve lacks", "leave out knots"],
        ),
        (("--points", "12,44"), ['no point "44"']),
        (("--points", "12"), ["all points are at 0 mm, which defines no curve; give points at"]),
        (("--end", "-1 mm"), ["the curve ends at -1 mm, not above its start at 0 mm"]),
    ],
)
def test_what_cannot_be_fitted(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], texts: list[str]
) -> None:
    assert run(*DOME, *arguments) == 3
    out, err = capsys.readouterr()
    assert out == "" and all(text in err for text in texts)
    assert all(line.startswith(f"{PART}: ") for line in err.splitlines())


def test_many_points_are_fitted_and_too_many_coefficients_refused(tmp_path: Path) -> None:
    x = np.arange(8000)
    path = table(tmp_path / "data.csv", x / 10, np.sin(x / 500))
    assert bp.spline(path, every=100).curve.fit.sigma < 1e-10
    with pytest.raises(bp.ExperimentError, match="1603 coefficients are too many; at most 500 are"):
        bp.spline(path)


def test_points_at_the_same_place_are_named(tmp_path: Path) -> None:
    rows = "".join(f"{10 - k // 2},{k // 2},{k}\n" for k in (0, 2, 3, 6, 8))
    path = tmp_path / "data.csv"
    path.write_text(f"nominal_x_mm,nominal_z_mm,error_um\n{rows}", encoding="utf-8")
    with pytest.raises(bp.ExperimentError, match=r"two neighbouring points are at \(9 mm, 1 mm\)"):
        bp.spline(path)
