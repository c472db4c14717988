"""Exact values that contradict one another are refused, and none that some plate has."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.simulator.inputs.messages import ExperimentError
from numpy.typing import NDArray

from tests.experiment import wording

QUICKSTART = Path("designs/quickstart.yaml")
CORNERS = ["r1c1", "r1c5", "r5c1", "r5c5"]
NINE = [f"r{i}c{j}" for i in (1, 3, 5) for j in (1, 3, 5)]


def places(names: list[str]) -> NDArray[np.float64]:
    """The drawing in metres."""
    return np.array([[0.1875 * (int(one[3]) - 1), 0.1875 * (int(one[1]) - 1), 0] for one in names])


def distances(names: list[str], at: NDArray[np.float64]) -> dict[tuple[str, str], float]:
    """All distances in metres."""
    pairs = itertools.combinations(range(len(names)), 2)
    return {(names[i], names[j]): float(np.linalg.norm(at[i] - at[j])) for i, j in pairs}


def item(values: dict[tuple[str, str], float], uncertainty: str = "0 um") -> dict[str, Any]:
    return {
        "kind": "distances",
        "pairs": [list(pair) for pair in values],
        "values": [{"balls": list(pair), "distance": f"{x!r} m"} for pair, x in values.items()],
        "standard_uncertainty": uncertainty,
    }


def complaints(folder: Path, *items: dict[str, Any]) -> list[str]:
    sections = yaml.safe_load(QUICKSTART.read_text(encoding="utf-8"))
    sections["calibration"] = list(items)
    (folder / "plate.yaml").write_text(yaml.safe_dump(sections), encoding="utf-8")
    try:
        bp.load(folder / "plate.yaml")
    except ExperimentError as error:
        return [one.text for one in error.messages]
    return []


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("bent", [0.0, 3e-6, 1e-4, 3e-3])
def test_no_distances_of_a_plate_are_refused_however_it_is_bent(
    tmp_path: Path, seed: int, bent: float
) -> None:
    generator = np.random.default_rng(seed)
    off = generator.standard_normal((9, 3)) * [1e-4, 1e-4, bent]
    assert not complaints(tmp_path, item(distances(NINE, places(NINE) + off)))
    # One more that is wrong by less than a hundredth of a micrometre contradicts them.
    wrong = distances(NINE, places(NINE) + off)
    wrong["r1c1", "r5c5"] += 5e-9
    (told,) = complaints(tmp_path, item(wrong))
    assert wording.CONTRADICT_ONE_ANOTHER in told


def square_of_volume(at: dict[tuple[str, str], float]) -> float:
    """288 times the squared volume of four points with such distances [Cayley; Menger]."""
    matrix = np.ones((5, 5)) - np.eye(5)
    for (i, j), (first, second) in zip(
        itertools.combinations(range(4), 2), itertools.combinations(CORNERS, 2), strict=True
    ):
        matrix[i, j] = matrix[j, i] = at[first, second] ** 2
    return float(np.linalg.det(matrix))


def test_six_distances_of_four_balls_are_refused_where_their_volume_is_imaginary(
    tmp_path: Path,
) -> None:
    right, found = distances(CORNERS, places(CORNERS)), []
    for pair, error in itertools.product(right, (1e-6, -1e-6)):
        wrong = {**right, pair: right[pair] + error}
        volume = square_of_volume(wrong)
        assert abs(volume) > 1e-8
        found.append(volume < 0.0)
        told = complaints(tmp_path, item(wrong))
        assert bool(told) == (volume < 0.0)
        assert all(f"{a}–{b}" in text for a, b in right for text in told)
    assert set(found) == {True, False}


@pytest.mark.parametrize(("error", "is_possible"), [(1e-7, False), (-1e-7, True), (0.0, True)])
def test_three_distances_in_a_line_are_refused_where_no_triangle_has_them(
    tmp_path: Path, error: float, is_possible: bool
) -> None:
    values = {("r1c1", "r1c3"): 0.375, ("r1c3", "r1c5"): 0.375, ("r1c1", "r1c5"): 0.75 + error}
    told = complaints(tmp_path, item({("r5c1", "r5c5"): 0.75}), item(values))
    assert (not told) == is_possible
    if not is_possible:
        # A third each, at the least sum of squares; the distance elsewhere is not blamed.
        assert wording.MM_IN in told[0] and "0.0333 µm" in told[0]
        assert "r5c1" not in told[0]


def test_one_distance_in_two_items_is_refused_where_they_differ(tmp_path: Path) -> None:
    first, second = {("r1c1", "r1c3"): 0.375}, {("r1c3", "r1c1"): 0.375001}
    (told,) = complaints(tmp_path, item(first), item(second))
    assert wording.MM_IN_MM in told
    assert not complaints(tmp_path, item(first), item(second, "0.001 um"))
    assert not complaints(tmp_path, item(first), item({("r1c3", "r1c1"): 0.375}))


def test_co_ordinates_and_distances_that_differ_are_refused(tmp_path: Path) -> None:
    exact = {"kind": "coordinates", "balls": "corners", "standard_uncertainty": "0 um"}
    (told,) = complaints(tmp_path, exact, item({("r1c1", "r1c5"): 0.7501}))
    assert "x of r1c1" in told and "r1c1–r1c5" in told and "r5c1" not in told
    assert not complaints(tmp_path, exact, item({("r1c1", "r1c5"): 0.75}))


@pytest.mark.parametrize(("away", "second"), [(1e8 / 3.0, 375.0), (0.0, 0.0)])
def test_exact_co_ordinates_far_out_or_in_one_place_contradict_a_distance_alone(
    tmp_path: Path, away: float, second: float
) -> None:
    given = 1e3 * places(NINE)
    given[1, 0] = second
    drawn = (given + away).tolist()
    rows = [f"{name},{x},{y},{z}" for name, (x, y, z) in zip(NINE, drawn, strict=True)]
    lines = ["ball,x_mm,y_mm,z_mm", *rows]
    (tmp_path / "c.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    exact = {"kind": "coordinates", "balls": NINE, "values": "c.csv"}
    exact["standard_uncertainty"] = "0 um"
    assert not complaints(tmp_path, exact)
    (told,) = complaints(tmp_path, exact, item({("r1c1", "r1c3"): 0.376}))
    assert "contradict one another" in told and "r1c1–r1c3" in told
