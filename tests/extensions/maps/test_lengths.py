"""Lengths throughout the volume: against U6, a dense computation, and groups counted one by one."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.maps.length_map import (
    LengthGroups,
    LengthMapSettings,
    _tiles,
    class_edges,
    direction_classes,
    direction_names,
    grid_points,
    length_map,
)
from ballplate.results.checked_designs import predict
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.quantities import LengthFunction

from tests.extensions.maps import wording
from tests.reference import dense

TEXT = (
    Path("designs/quickstart.yaml")
    .read_text(encoding="utf-8")
    .replace("coefficients: 5", "coefficients: 4")
    .replace("balls: [5, 5]", "balls: [4, 4]")
)
TARGET = LengthFunction(0.1e-6, 1e-7)
GRID = (3, 2, 3)


def experiment_of(folder: Path, text: str = TEXT) -> Experiment:
    file = folder / "design.yaml"
    file.write_text(text, encoding="utf-8")
    return load(file)[0]


@pytest.fixture
def experiment(tmp_path: Path) -> Experiment:
    """The points of a grid are listed in the file."""
    points = [
        [500.0 * i, 1000.0 * j, 500.0 * k] for i in range(3) for j in range(2) for k in range(3)
    ]
    listed = ", ".join(f"[{x} mm, {y} mm, {z} mm]" for x, y, z in points)
    text = TEXT.replace("{random: 200, seed: 1}", f"[{listed}]").replace(
        "0.5 um + L/1000000", "0.1 um + L/10000000"
    )
    return experiment_of(tmp_path, text)


def settings(**changes: object) -> LengthMapSettings:
    return replace(LengthMapSettings(GRID, "down", TARGET), **changes)  # type: ignore[arg-type]


def test_the_whole_is_what_run_tells_of_the_same_points(experiment: Experiment) -> None:
    expected = predict(experiment).quantities["U6"]
    found = length_map(experiment, settings()).whole
    np.testing.assert_array_equal(
        grid_points(lay_out(experiment), GRID), experiment.evaluation.points
    )
    assert found.count[0] == expected.count == 153
    assert found.maximum[0] == pytest.approx(expected.maximum, rel=1e-12)
    assert found.average[0] == pytest.approx(expected.average, rel=1e-12)
    assert 0.0 < found.share()[0] < 1.0 and found.share()[0] == expected.within_target


def all_pairs(experiment: Experiment, **changes: object) -> np.ndarray:
    """First and second point, length, uncertainty of every pair, sorted."""
    chosen, at = settings(**changes), linearise(lay_out(experiment))
    tiles = _tiles(at, grid_points(at.design, chosen.grid), chosen)
    rows = [
        np.column_stack([t.first, t.second, t.lengths, t.uncertainties, t.is_open]) for t in tiles
    ]
    found = np.concatenate(rows)
    return found[np.lexsort([found[:, 1], found[:, 0]])]


def test_every_length_against_a_dense_computation(experiment: Experiment) -> None:
    design = lay_out(experiment)
    problem = dense.planned(design, 4, 4)
    expected = dense.standard_uncertainties(problem, dense.linearised(problem), symbols=["U6"])[
        "U6"
    ]
    found = all_pairs(experiment)
    np.testing.assert_array_equal(found[:, :2], list(combinations(range(18), 2)))
    np.testing.assert_allclose(found[:, 3], expected, rtol=1e-8)
    # Each of the two readings scatters along the length by 0.2 um, whatever its direction.
    scattered = all_pairs(experiment, with_repeatability=True)
    np.testing.assert_allclose(scattered[:, 3] ** 2, expected**2 + 2 * 0.2e-6**2, rtol=1e-8)


def test_the_scatter_of_readings_is_that_along_the_length(tmp_path: Path) -> None:
    text = TEXT.replace("repeatability: 0.2 um", "repeatability: [0.2 um, 0.3 um, 0.6 um]")
    experiment = experiment_of(tmp_path, text)
    with_it, without = (
        all_pairs(experiment, with_repeatability=one)[:, 3] for one in (True, False)
    )
    points = grid_points(lay_out(experiment), GRID)
    for row, (i, j) in enumerate(combinations(range(18), 2)):
        direction = (points[j] - points[i]) / np.linalg.norm(points[j] - points[i])
        added = 2 * ((direction * [0.2e-6, 0.3e-6, 0.6e-6]) ** 2).sum()
        assert with_it[row] ** 2 - without[row] ** 2 == pytest.approx(added, rel=1e-9)


def check_group(
    groups: LengthGroups, k: int, u: np.ndarray, ratio: np.ndarray, coverage: float
) -> None:
    assert groups.count[k] == len(u)
    known = ~np.isnan(u)
    assert groups.undetermined[k] == (~known).sum()
    assert groups.within[k] == (ratio[known] <= 1).sum()
    assert groups.within_expanded[k] == (coverage * ratio[known] <= 1).sum()
    if known.any():
        figures = (
            groups.average[k],
            groups.maximum[k],
            groups.average_ratio[k],
            groups.maximum_ratio[k],
        )
        expected = (u[known].mean(), u[known].max(), ratio[known].mean(), ratio[known].max())
        np.testing.assert_allclose(figures, expected, rtol=1e-12)
    else:
        assert np.isnan(groups.average[k]) and np.isnan(groups.maximum_ratio[k])


def direction_of(apart: np.ndarray) -> str:
    """In units of the volume's edges."""
    moving = [axis for axis, size in zip("xyz", apart, strict=True) if abs(size) > 1e-9]
    sizes = {round(abs(size), 9) for size in apart if abs(size) > 1e-9}
    if len(moving) == 1:
        return f"along {moving[0]}"
    if len(sizes) > 1:
        return "other directions"
    return "body diagonals" if len(moving) == 3 else f"face diagonals {''.join(moving)}"


@pytest.mark.parametrize("deficient", [False, True])
def test_groups_are_what_counting_one_by_one_gives(tmp_path: Path, deficient: bool) -> None:
    text = TEXT.replace("volume: [1 m, 1 m, 1 m]", "volume: [1 m, 1.2 m, 1 m]")
    if deficient:
        text = TEXT.replace("position_coefficients: 4", "position_coefficients: 6")
    experiment = experiment_of(tmp_path, text)
    # Points that are not where the balls are, so that they notice what these leave open.
    grid = (2, 3, 4)
    found = length_map(experiment, settings(coverage_factor=1.5, grid=grid))
    rows = all_pairs(experiment, grid=grid)
    u = np.where(rows[:, 4] == 1, np.nan, rows[:, 3])
    ratio = u / (0.1e-6 + 1e-7 * rows[:, 2])
    ends, lengths = rows[:, :2].astype(int), rows[:, 2]
    assert (found.deficiency > 0) is deficient and np.isnan(u).any() == deficient
    check_group(found.whole, 0, u, ratio, 1.5)
    for point in range(24):
        own = (ends == point).any(axis=1)
        check_group(found.by_point, point, u[own], ratio[own], 1.5)
    for k in range(len(found.edges) - 1):
        own = (lengths > found.edges[k] + 1e-9) & (lengths <= found.edges[k + 1] + 1e-9)
        check_group(found.by_length, k, u[own], ratio[own], 1.5)
    extent = found.design.machine.volume.size
    names = np.array([direction_of((found.points[j] - found.points[i]) / extent) for i, j in ends])
    for k, name in enumerate(found.directions):
        check_group(found.by_direction, k, u[names == name], ratio[names == name], 1.5)
    assert found.worst == tuple(ends[np.nanargmax(ratio)])
    assert all(np.isnan(u[(ends == pair).all(axis=1)]).all() for pair in found.open_pairs)
    assert len(found.open_pairs) == (3 if deficient else 0)


def test_classes() -> None:
    assert class_edges(1.7320508)[[1, -1]].tolist() == [0.1, 1.8]
    assert class_edges(2.0)[[1, -1]].tolist() == [0.1, 2.0]
    assert class_edges(7.3)[[1, -1]].tolist() == [0.5, 7.5]
    apart = np.array(
        [[0.0, 0.2, 0.0], [0.4, 0.0, -0.4], [0.5, 0.5, 0.0], [-0.2, 0.2, 0.2], [0.1, 0.2, 0.2]]
    )
    names = [direction_names(3)[k] for k in direction_classes(apart)]
    assert names == [
        "along y",
        "face diagonals xz",
        "face diagonals xy",
        "body diagonals",
        "other directions",
    ]
    names = [
        direction_names(2)[k]
        for k in direction_classes(np.array([[0.1, 0], [0.1, -0.1], [0.1, 0.2]]))
    ]
    assert names == ["along x", "diagonals", "other directions"]


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    experiment_of(tmp_path)
    file, points = (str(tmp_path / name) for name in ("design.yaml", "points.csv"))
    limits = ["--target", "0.1 um + L/10000000", "--grid", "3,2,3", "--coverage-factor", "1.5"]
    assert main(["run", "--lengths", file, *limits, "-o", points]) == 0
    out, err = capsys.readouterr()
    assert err == "" and wording.LENGTHS_BETWEEN_POINTS in out
    assert (
        wording.MET_BY_THE_STANDARD_UNCERTAINTY in out
        and wording.BY_THE_EXPANDED_UNCERTAINTY in out
    )
    found = length_map(load(file)[0], settings(coverage_factor=1.5))
    with open(points, encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    of_points = [row for row in rows if row["group"] == "by point"]
    np.testing.assert_allclose(
        [float(row["average"]) for row in of_points], found.by_point.average, rtol=1e-9
    )
    np.testing.assert_allclose(
        [float(row["share within"]) for row in of_points], found.by_point.share(), rtol=1e-9
    )
    assert main(["run", "--lengths", file, *limits, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["all"]["lengths"] == 153 and len(data["by_point"]) == 18
    assert data["all"]["maximum"] == found.whole.maximum[0]


def test_a_deficient_design_is_told_and_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    experiment_of(tmp_path, TEXT.replace("position_coefficients: 4", "position_coefficients: 6"))
    file = str(tmp_path / "design.yaml")
    assert main(["run", "--lengths", file, "--grid", "3"]) == 1
    out = capsys.readouterr().out
    assert "rank deficiency 3; " in out and wording.CHANGE_NONE_OF_THESE_LENGTHS in out
    assert main(["run", "--lengths", file, "--grid", "4"]) == 1
    out = capsys.readouterr().out
    assert "rank deficiency " in out and wording.LENGTHS_ARE_UNDETERMINED_AND_MEET in out


def test_wrong_usage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    experiment_of(tmp_path, TEXT.replace("target_uncertainty: 0.5 um + L/1000000\n", ""))
    file = str(tmp_path / "design.yaml")
    for options, told in (
        ([], "the file states no target_uncertainty"),
        (["--target", "3"], 'target: "3" has no unit'),
        (
            ["--target", "1 um", "--grid", "3,3"],
            "the grid has 2 numbers, but the experiment has 3 dimensions",
        ),
        (["--target", "1 um", "--grid", "20"], "a grid of 8000 points is too fine"),
        (["--target", "1 um", "--probe", "dwon"], 'unknown probe "dwon"; did you mean "down"?'),
        (["--target", "1 um", "-o", file], "which is read; name another"),
    ):
        assert main(["run", "--lengths", file, *options]) == 2
        assert told in capsys.readouterr().err
