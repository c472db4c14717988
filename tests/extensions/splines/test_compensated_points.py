"""Points of a profile are moved against the errors along their normals, and corners to where the
compensated features cross.
"""

from __future__ import annotations

import csv
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.splines.compensated_points import compensated_points
from ballplate.extensions.splines.curve_result import FittedCurve
from numpy.testing import assert_allclose

TABLE = Path("designs/gilsinn/table-1.csv")
RADIUS = 0.037084
CENTRE = np.array([0.0, -0.037084])


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def part(path: Path, error: float = 0.0) -> Path:
    """A cone and a cylinder that meet at (20 mm, 0 mm), with errors that are straight lines: of the
    cone 10 µm + 0.5 µm/mm, of the cylinder 4 µm less 0.2 µm/mm, from the corner.
    """
    lines = ["feature,nominal_x_mm,nominal_z_mm,error_um"]
    for t in (-20.0, -15.0, -10.0, -5.0):
        place = 20.0 - 0.6 * t, 0.8 * t
        lines.append(f"cone,{place[0]!r},{place[1]!r},{10.0 + 0.5 * t + error!r}")
    for z in (4.0, 8.0, 12.0, 16.0):
        lines.append(f"cylinder,20,{z!r},{4.0 - 0.2 * z + error!r}")
    path.write_text("\n".join([*lines, ""]))
    return path


def moved(curve: FittedCurve) -> tuple[list[str], np.ndarray, np.ndarray]:
    assert curve.curve.profile is not None
    return compensated_points(curve.curve, curve.curve.profile)


def test_points_of_the_dome_are_moved_along_its_radii() -> None:
    curve = bp.spline(TABLE, y="semi_finish_error", points="13-32")
    _, nominal, found = moved(curve)
    errors = curve.values(curve.curve.fit.x)
    # Nominal co-ordinates are within 0.02 µm of the circle, 2.8 mm apart.
    radial = (nominal - CENTRE) / RADIUS
    assert_allclose(found, nominal - errors[:, None] * radial, atol=1e-9)


def test_a_corner_is_where_the_compensated_features_cross(tmp_path: Path) -> None:
    curve = bp.spline(
        part(tmp_path / "part.csv"), corner=["20 mm, 0 mm"], straight=[1, 2], knots="none"
    )
    assert "meet at a corner at 20 mm, with errors 10 µm and 4 µm" in str(curve)
    assert curve.curve.fit.free == 4
    names, nominal, found = moved(curve)
    assert names[-2:] == ["8", "corner 1"] and nominal[-1].tolist() == [0.02, 0.0]
    # 4 µm and 10 µm inside; slopes of 5e-4 change the place by as much of ways of 20 µm.
    inside = (-10e-6 + 0.8 * 4e-6) / 0.6
    assert_allclose(found[-1], [0.02 - 4e-6, inside], atol=1.2e-8)
    assert_allclose(found[0], nominal[0], atol=1e-15)
    assert_allclose(nominal[3] - found[3], 7.5e-6 * np.array([0.8, 0.6]), atol=1e-12)
    # Neighbouring compensated points and the corner are in one line.
    for run in (found[:4], found[4:8]):
        (a, b), (c, d) = run[-1] - run[0], found[-1] - run[0]
        assert abs(a * d - b * c) < 1e-14


def test_a_boundary_is_no_corner(tmp_path: Path) -> None:
    file = part(tmp_path / "part.csv")
    with pytest.raises(bp.ExperimentError, match="20 mm is a corner and a boundary"):
        bp.spline(file, corner=["20 mm, 0 mm"], boundary=["20 mm, 0 mm"])


def test_features_that_are_tangent_make_no_corner(tmp_path: Path) -> None:
    lines = ["feature,nominal_x_mm,nominal_z_mm,error_um"]
    lines += [f"cone,{20 - 0.01 * z!r},{z!r},1" for z in (-8.0, -4.0)]
    lines += [f"cylinder,20,{z!r},1" for z in (4.0, 8.0)]
    (tmp_path / "part.csv").write_text("\n".join([*lines, ""]))
    wanted = {"corner": ["20 mm, 0 mm"], "straight": [1, 2], "knots": "none"}
    with pytest.raises(bp.ExperimentError, match="nearly tangent; make it a boundary"):
        bp.spline(tmp_path / "part.csv", **wanted).compensated()


def test_the_command_writes_the_points(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, out = part(tmp_path / "part.csv"), tmp_path / "moved.csv"
    command = ["spline", str(file), "--corner", "20 mm, 0 mm", "--straight", "1", "--straight", "2"]
    assert main([*command, "--knots", "none", "--compensated", str(out)]) == 0
    found = rows(out)
    assert [row["point"] for row in found][-2:] == ["8", "corner 1"]
    assert float(found[4]["nominal_z_mm"]) == 4.0
    assert float(found[-1]["compensated_x_mm"]) == pytest.approx(19.996, abs=1.2e-5)
    for option in ("--compensated", "--whiskers"):
        path = str(tmp_path / f"{option}.svg")
        assert main([*command[:2], "--x", "nominal_z", option, path]) == 3
        assert "errors are normal to a profile" in capsys.readouterr().err
