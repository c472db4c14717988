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
from numpy.testing import assert_allclose

from tests.extensions.splines import wording

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


def test_points_of_the_dome_are_moved_along_its_radii() -> None:
    curve = bp.spline(TABLE, y="semi_finish_error", points="13-32")
    found = curve.compensated()
    radial = (found.nominal - CENTRE) / RADIUS
    # Nominal co-ordinates are within 0.02 µm of the circle, 2.8 mm apart.
    assert_allclose(found.normals, radial, atol=1e-5)
    assert_allclose(found.errors, curve.values(curve.curve.fit.x))
    assert_allclose(
        np.linalg.norm(found.compensated - CENTRE, axis=1), RADIUS - found.errors, atol=2.1e-8
    )


def test_nominal_points_between_the_measured_ones(tmp_path: Path) -> None:
    """On a circle the arc length from the first point is the angle times the radius."""
    angles = np.deg2rad([85.1, 60.0, 33.3, 5.0])
    places = CENTRE + RADIUS * np.stack([np.sin(angles), np.cos(angles)], 1)
    file = tmp_path / "nominal.csv"
    told = [f"{1e3 * x!r},{1e3 * z!r}" for x, z in places.tolist()]
    file.write_text("\n".join(["nominal_x_mm,nominal_z_mm", *told, ""]))
    curve = bp.spline(TABLE, y="semi_finish_error", points="13-32")
    found = curve.compensated(file)
    first = np.array([36.99706e-3, -34.54598e-3]) - CENTRE
    lengths = RADIUS * (np.arctan2(*first) - angles)
    assert_allclose(found.errors, curve.values(lengths), atol=2e-9)
    assert_allclose(found.normals, (places - CENTRE) / RADIUS, atol=1e-5)
    file.write_text("nominal_x_mm,nominal_z_mm\n36,-30\n")
    with pytest.raises(bp.ExperimentError, match=wording.IS_NOT_ON_THE_PROFILE):
        curve.compensated(file)
    file.write_text("nominal_x_mm,nominal_z_mm\n37.084,-37.084\n")
    with pytest.raises(bp.ExperimentError, match=wording.IS_NOT_ON_THE_PROFILE):
        curve.compensated(file)


def test_a_corner_is_where_the_compensated_features_cross(tmp_path: Path) -> None:
    curve = bp.spline(
        part(tmp_path / "part.csv"), corner=["20 mm, 0 mm"], straight=[1, 2], knots="none"
    )
    assert wording.FEATURES_MEET_AT_A_CORNER in str(curve)
    assert curve.curve.fit.free == 4
    found = curve.compensated()
    assert found.names[-1] == "corner 1"
    cone, cylinder = np.array([0.8, 0.6]), np.array([1.0, 0.0])
    # 4 µm and 10 µm inside; slopes of 5e-4 change the place by as much of ways of 20 µm.
    inside = (-10e-6 + 0.8 * 4e-6) / 0.6
    assert_allclose(found.compensated[-1], [0.02 - 4e-6, inside], atol=1.2e-8)
    assert_allclose(found.normals[0], cone, atol=1e-12)
    assert_allclose(found.normals[5], cylinder, atol=1e-12)
    # Neighbouring compensated points and the corner are in one line.
    for run in (found.compensated[:4], found.compensated[4:8]):
        a, b, c = run[0], run[-1], found.compensated[-1]
        ways = b - a, c - a
        assert abs(ways[0][0] * ways[1][1] - ways[0][1] * ways[1][0]) < 1e-14


def test_the_uncertainty_of_a_corner_is_that_of_repeated_parts(tmp_path: Path) -> None:
    """Errors of the points drawn again and again, with a standard deviation of 1 µm."""
    places, generator = [], np.random.default_rng(4)
    lines = part(tmp_path / "part.csv").read_text().split("\n")
    for _ in range(80):
        drawn = []
        for line in lines[1:-1]:
            *nominal, error = line.split(",")
            drawn.append(",".join([*nominal, repr(float(error) + generator.standard_normal())]))
        file = tmp_path / "drawn.csv"
        file.write_text("\n".join([lines[0], *drawn, ""]))
        found = bp.spline(
            file,
            corner=["20 mm, 0 mm"],
            straight=[1, 2],
            knots="none",
            uncertainty="1 um",
        ).compensated()
        places.append(found.compensated[-1])
    exact = bp.spline(
        tmp_path / "part.csv",
        corner=["20 mm, 0 mm"],
        straight=[1, 2],
        knots="none",
        uncertainty="1 um",
    ).compensated()
    along = (np.array(places) - np.mean(places, axis=0)) @ exact.normals[-1]
    # A standard deviation of 80 is known to 8 %; four of these.
    assert abs(along.std(ddof=1) / exact.uncertainties[-1] - 1.0) < 0.32


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"boundary": ["20 mm, 0 mm"]}, "a corner and a boundary"),
        (
            {"at": [("20 mm, 0 mm", "value", "0 um")]},
            "no value or slope can be prescribed at the corner",
        ),
    ],
)
def test_what_does_not_go_with_a_corner(more: dict[str, object], told: str, tmp_path: Path) -> None:
    file = part(tmp_path / "part.csv")
    with pytest.raises(bp.ExperimentError, match=told):
        bp.spline(file, corner=["20 mm, 0 mm"], straight=[1, 2], knots="none", **more)


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
    assert found[0]["error_um"] == "0.0000" and found[3]["offset_um"] == "-7.5000"
    assert float(found[-1]["compensated_x_mm"]) == pytest.approx(19.996, abs=5e-6)
    capsys.readouterr()
    assert main([*command, "--nominal", str(file)]) == 2
    assert wording.NOMINAL_IS_FOR_COMPENSATED in capsys.readouterr().err
