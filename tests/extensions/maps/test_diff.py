"""`ballplate diff` as its users see it."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.presentation import number
from ballplate.results.fits import Fit
from ballplate.simulator.estimation import Distances, MeasuredPoints, linear_functions

from tests.extensions.maps import wording
from tests.reference.small_quickstart import small_quickstart

PARK = Path("designs/park")


@pytest.fixture(scope="module")
def fits() -> list[Fit]:
    return [bp.fit(small_quickstart(), bp.simulate(small_quickstart(), seed)) for seed in (1, 2)]


@pytest.fixture
def maps(tmp_path: Path, fits: list[Fit]) -> list[str]:
    found = []
    for name, date, one in zip("ab", ("2025-01-01", "2026-07-02"), fits, strict=True):
        path = tmp_path / f"{name}.yaml"
        bp.write_map(one.to_map(date), path)
        found.append(str(path))
    return found


def test_maps_of_files_are_compared(
    tmp_path: Path, maps: list[str], fits: list[Fit], capsys: pytest.CaptureFixture[str]
) -> None:
    table = tmp_path / "all.csv"
    assert main(["diff", *maps, "-o", str(table)]) == 0
    out = capsys.readouterr().out
    assert out.startswith("b less a: ") and wording.NO_CHANGE_IS_SHOWN in out
    assert wording.THE_CAMPAIGNS_ARE_TAKEN in out
    rows = list(csv.DictReader(table.read_text("utf-8").splitlines()))
    data = printed(capsys, "diff", *maps)
    assert [row["figure"] for row in rows] == [one["figure"] for one in data["figures"]]
    for row, one in zip(rows, data["figures"], strict=True):
        u, difference = one["standard uncertainty"], one["difference"]
        assert one["E_n"] == pytest.approx(difference / (2.0 * u))
        years = (365 + 182) / 365.25
        assert float(row["per year"]) == pytest.approx(float(row["difference"]) / years)
    frame = bp.diff(*fits).to_frame()
    assert {"balls of plate", "EXX", "edges"} <= set(frame["kind"])


def test_differences_are_those_of_what_the_fits_correct(fits: list[Fit]) -> None:
    """Lengths, the motion of the frame by least squares, and what it leaves at the points."""
    told = bp.diff(*fits, grid=3).to_dict()
    points = np.stack(np.meshgrid(*[[0.0, 0.5, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corrected = [fit.correct(points).points for fit in fits]
    names = [f"({', '.join(f'{1000 * x:.0f}' for x in point)}) mm" for point in points]
    pairs, at = list(combinations(range(27), 2)), fits[0].functions.at
    distances = Distances(MeasuredPoints(points, np.zeros(27, int)), np.array(pairs), ("",) * 351)
    u = np.hypot(
        *(
            fit.sigma * fit.functions.at.uncertainty(linear_functions(fit.functions.at, distances))
            for fit in fits
        )
    )
    assert at.design.probes.names[0] == told["probe"] == "down"
    ends: dict[str, tuple[float, float]] = {}
    for k, (i, j) in enumerate(pairs):
        first, second = (float(np.linalg.norm(one[i] - one[j])) for one in corrected)
        ends[f"{names[i]} to {names[j]}"] = ends[f"{names[j]} to {names[i]}"] = second - first, u[k]
    counts = dict.fromkeys(
        ("body diagonals", "face diagonals", "edges", "lengths through the volume"), 0
    )
    of_points = {}
    for one in told["figures"]:
        if one["kind"] in counts:
            counts[one["kind"]] += 1
            # Differences are linear: of errors of a few micrometres in half a metre.
            assert one["difference"] == pytest.approx(ends[one["figure"]][0], abs=2e-11)
            assert one["standard uncertainty"] == pytest.approx(ends[one["figure"]][1], rel=1e-3)
        elif one["kind"] == "errors at points of the volume":
            of_points[one["figure"]] = one["difference"]
    assert list(counts.values()) == [4, 12, 12, 351]
    moved = (corrected[1] - corrected[0]).ravel()
    turns = np.stack([np.cross(axis, points - 0.5) for axis in np.eye(3)], axis=2).reshape(-1, 3)
    moving = np.hstack([np.tile(np.eye(3), (27, 1)), turns])
    motion = np.linalg.lstsq(moving, moved)[0]
    assert [one["value"] for one in told["motion"]] == pytest.approx(motion, abs=1e-11)
    left = (moved - moving @ motion).reshape(-1, 3)
    assert of_points == {
        f"{axis} at {name}": pytest.approx(value, abs=1e-11)
        for name, row in zip(names, left, strict=True)
        for axis, value in zip("xyz", row, strict=True)
    }
    for group in told["groups"]:
        mine = [one for one in told["figures"] if one["kind"] == group["kind"]]
        known = [one for one in mine if one["E_n"] is not None]
        assert (group["count"], group["undetermined"]) == (len(known), 0)
        assert group["exceeding"] == sum(abs(one["E_n"]) > 1.0 for one in known)


def test_text_says_what_the_data_say(maps: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    told = printed(capsys, "diff", *maps)
    assert main(["diff", *maps]) == 0
    lines = capsys.readouterr().out.splitlines()

    def table(heading: str) -> list[list[str]]:
        start = next(k for k, line in enumerate(lines) if line.startswith(heading)) + 1
        end = lines.index("", start) if "" in lines[start:] else len(lines) - 1
        return [re.split("  +", line) for line in lines[start:end]]

    motion = [
        [one["name"], number(1e6 * one["value"]), number(2e6 * one["standard_uncertainty"])]
        for one in told["motion"]
    ]
    assert [row[:3] for row in table("free motion")] == motion
    figures = {f"{one['kind']}: {one['figure']}": one for one in told["figures"]}
    years, shown = told["years"], table("length  ")
    for name, *row in shown:
        size, u = (1e6 * figures[name][key] for key in ("difference", "standard uncertainty"))
        expected = [number(size), number(2.0 * u), number(figures[name]["E_n"], 3)]
        assert row == [*expected, number(size / years), number(2.0 * u / years)]
    kinds = [row[0].partition(":")[0] for row in shown]
    assert [kinds.count(kind) for kind in dict.fromkeys(kinds)] == [4, 3, 3, 3]
    tests = {one["what"]: one for one in told["tests"]}
    groups = {one["kind"]: one for one in told["groups"]}

    def largest(of: list[str], size: str, at: str) -> bool:
        """Whether a place has the largest |E_n|; some are equal but for rounding."""
        every = {name: one["E_n"] for name, one in figures.items() if name.partition(":")[0] in of}
        most = max(abs(one) for one in every.values() if one is not None)
        (here,) = (one for name, one in every.items() if name.endswith(f": {at}"))
        return size == number(most, 3) and abs(here) == pytest.approx(most)

    for words, size, at, *row in table("error function  "):
        name = words.split()[0]
        assert largest([name], size, f"{name} at {at}")
        statistic, p = number(tests[name]["chi_squared"]), number(tests[name]["p"], 2)
        assert row == [statistic, str(tests[name]["dimensions"]), p]
    for kind, count, exceeding, share, size, at in table("figures  "):
        mine = [kind] if kind in groups else [name for name in groups if len(name) == 3]
        whole, above = (sum(groups[one][key] for one in mine) for key in ("count", "exceeding"))
        assert (count, exceeding) == (str(whole), f"{above} ({100 * above / whole:.1f} %)")
        assert share == f"{100 * groups[mine[0]]['share_by_chance']:.1f} %"
        assert largest(mine, size, at)


def test_the_same_readings_twice_are_no_agreement(
    tmp_path: Path, maps: list[str], fits: list[Fit], capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever the table is called, in whatever order it stands, and for another error model."""
    table = bp.simulate(small_quickstart(), 1)
    table.sample(frac=1.0, random_state=2).to_csv(tmp_path / "again.csv", index=False)
    again = bp.fit(small_quickstart(), tmp_path / "again.csv")
    bp.write_map(again.to_map(), tmp_path / "again.yaml")  # type: ignore[attr-defined]
    assert main(["diff", maps[0], str(tmp_path / "again.yaml"), "--grid", "2", "--fail"]) == 1
    said = capsys.readouterr()
    assert wording.REST_ON_THE_SAME_READINGS in said.err and "change is shown" not in said.out
    poorer = small_quickstart().with_({"error_model.position_coefficients": 2})
    for second in (again, bp.fit(poorer, table)):
        found = bp.diff(fits[0], second, grid=2)  # type: ignore[arg-type]
        assert found.is_changed is None and "same readings" in found.headline()
        assert found.to_dict()["same_readings"] is True
    mixed = bp.simulate(small_quickstart(), 2)
    assert bp.diff(fits[0], bp.fit(small_quickstart(), mixed), grid=2).is_changed is False  # type: ignore[arg-type]
    mixed.loc[mixed["position"] == "x low"] = table.loc[table["position"] == "x low"]
    found = bp.diff(fits[0], bp.fit(small_quickstart(), mixed), grid=2)  # type: ignore[arg-type]
    assert found.is_changed is None and wording.THE_SAME_IN_BOTH_CAMPAIGNS in found.notes[-1]
    # One reading fewer in each position, and the others rounded to a tenth of a micrometre.
    edited = table.groupby("position", sort=False).tail(-1).round(4)
    evaluated: Any = bp.fit(small_quickstart(), edited)
    # These are other readings, but too much alike.
    for second in (evaluated, evaluated.to_map()):
        assert wording.AS_ALIKE_AS_THESE in bp.diff(maps[0], second, grid=2).notes[-1]
    assert not any("alike" in note for note in bp.diff(*maps, grid=2).notes)
    # So are those that say nothing of readings.
    given = bp.load_map(maps[0])
    silent = bp.diff(given, replace(given, data=None), grid=2)
    assert silent.comparison.test is not None and silent.comparison.test.statistic == 0.0
    assert wording.AS_ALIKE_AS_THESE in silent.notes[-1]
    # Earlier ones only tell all readings together.
    assert given.data is not None
    earlier = replace(given, data=replace(given.data, positions=()))
    assert bp.diff(given, earlier, grid=2).in_common == "same"


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    assert main([*arguments, "--json"]) in (0, 1)
    return json.loads(capsys.readouterr().out)


def test_a_change_fails_where_that_is_asked(
    tmp_path: Path, maps: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    other = small_quickstart().with_({"true_machine.seed": 8})
    bp.write_map(bp.fit(small_quickstart(), bp.simulate(other, 3)).to_map(), tmp_path / "c.yaml")  # type: ignore[attr-defined]
    assert main(["diff", *maps, "--fail", "--grid", "2"]) == 0
    capsys.readouterr()
    assert main(["diff", maps[0], str(tmp_path / "c.yaml"), "--fail", "--grid", "2", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["changed"] is True and found["years"] is None
    assert found["tests"][0]["p"] < 1e-6 and len(found["tests"]) == 19


def test_an_expected_map_is_compared_with(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    experiment = bp.load(PARK / "plate.yaml")
    fit = bp.fit(experiment, bp.simulate(experiment, 4))
    path = tmp_path / "measured.yaml"
    bp.write_map(fit.to_map(), path)  # type: ignore[attr-defined]
    machine = PARK / "machines" / "npl-like.yaml"
    found = printed(capsys, "diff", str(machine), str(path), "--grid", "2")
    assert found["changed"] is False and found["first"]["expected"] is True
    named = {row["figure"]: row for row in found["figures"]}
    edge = named["(0, 0, 0) mm to (900, 0, 0) mm"]
    ends = np.array([[0.0, 0.0, 0.0], [0.9, 0.0, 0.0]])
    corrected = fit.correct(ends, "down")  # type: ignore[attr-defined]
    from ballplate.extensions.machine_files.machine_file import load_machine
    from ballplate.extensions.maps.volumetric_errors import Volumetric

    described = Volumetric(load_machine(machine)).truth
    p = np.broadcast_to([0.0, 0.0, -0.12], ends.shape)
    true = ends + described.model.error(ends, described.a, p)
    expected = np.subtract(*corrected.points[::-1]), np.subtract(*true[::-1])
    lengths = [float(np.linalg.norm(one)) for one in expected]
    assert edge["difference"] == pytest.approx(lengths[0] - lengths[1], abs=2e-9)
    # What is stated of its lengths is added.
    wider = printed(
        capsys, "diff", str(machine), str(path), "--stated", "4 um + L/100000", "--grid", "2"
    )
    same = next(one for one in wider["figures"] if one["figure"] == edge["figure"])
    u = np.hypot(edge["standard uncertainty"], 0.5 * (4e-6 + 0.9e-5))
    assert same["standard uncertainty"] == pytest.approx(u, rel=1e-9)
    # It states uncertainties of squareness errors.
    assert main(["diff", str(machine), str(path), "--grid", "2"]) == 0
    assert "npl-like is no measurement, and is as well known as" in capsys.readouterr().out


def test_what_is_undetermined_is_not_compared(capsys: pytest.CaptureFixture[str]) -> None:
    # Nothing tells the scale.
    experiment = bp.load("designs/hurt_foss/bar-bell.yaml", "length unknown")
    found = bp.diff(*(bp.fit(experiment, bp.simulate(experiment, seed)) for seed in (1, 2)))  # type: ignore[arg-type]
    edges = next(one for one in found.comparison.lengths if one.kind == "edges")
    assert edges.undetermined == len(edges.names) and edges.count == 0
    text = "\n".join(found.lines())
    assert "0 (12 undetermined)" in text and "undetermined" in text
    assert found.to_dict()["figures"][0]["E_n"] is None
    assert found.comparison.test is not None and found.is_changed is False


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["--probe", "up"], 2, 'no probe "up" in both maps'),
        (["--shared", "certificate"], 2, "does not hold what certificates do to it"),
        (["--stated", "1 um"], 2, "a stated uncertainty needs a machine file"),
        (["--stated", "1"], 2, "1"),
        (["--grid", "9"], 2, "2 to 5 points"),
    ],
)
def test_what_does_not_go_together_is_refused(
    maps: list[str],
    arguments: list[str],
    status: int,
    words: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    try:
        assert main(["diff", *maps, *arguments]) == status
    except SystemExit as error:
        assert error.code == status
    assert words in capsys.readouterr().err


def test_files_that_are_no_maps_are_refused(
    maps: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    machine = str(PARK / "machines" / "npl-like.yaml")
    assert main(["diff", machine, machine]) == 2
    assert "both files describe machines" in capsys.readouterr().err
    assert main(["diff", maps[0], "designs/quickstart.yaml"]) == 3
    assert "names no readings" in capsys.readouterr().err
    assert main(["diff", maps[0], "designs/reports/z-low.dmo"]) == 3
    assert main(["diff", maps[0], "nowhere.yaml"]) == 3
    with pytest.raises(TypeError, match="second=3"):
        bp.diff(maps[0], 3)  # type: ignore[arg-type]
