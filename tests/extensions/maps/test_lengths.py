"""Lengths throughout the volume: against U6, a dense computation, and pairs counted one by one."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.maps.length_map import LengthMap, length_map
from ballplate.simulator.estimation.functions import MeasuredPoints, displacements
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.uncertainty import pair_tiles

from tests.reference import dense

TEXT = (
    Path("designs/quickstart.yaml")
    .read_text(encoding="utf-8")
    .replace("coefficients: 5", "coefficients: 4")
    .replace("balls: [5, 5]", "balls: [4, 4]")
)
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


def check_points(found: LengthMap, u: np.ndarray, target: np.ndarray) -> None:
    """Against standard uncertainties of all pairs, NaN where undetermined, and targets of them."""
    ends = np.array(list(combinations(range(len(found.points)), 2)))
    for point in range(len(found.points)):
        own = (ends == point).any(axis=1)
        known = own & ~np.isnan(u)
        assert found.undetermined[point] == (own & ~known).sum()
        met = (u[known] <= target[known]).sum()
        assert found.missed[point] == pytest.approx(1.0 - met / own.sum(), abs=1e-12)
        if not known.any():
            assert np.isnan(found.maximum[point]) and np.isnan(found.maximum_ratio[point])
            continue
        assert found.maximum[point] == pytest.approx(u[known].max(), rel=1e-8)
        ratio = (u[known] / target[known]).max()
        assert found.maximum_ratio[point] == pytest.approx(ratio, rel=1e-8)
    whole = found.to_dict()
    assert whole["lengths"] == len(u) and whole["undetermined"] == np.isnan(u).sum()


def sizes(points: np.ndarray) -> np.ndarray:
    return np.array([np.linalg.norm(b - a) for a, b in combinations(points, 2)])


@pytest.mark.parametrize("factor", [1, 1.5])
def test_every_length_against_a_dense_computation(experiment: Experiment, factor: float) -> None:
    design = lay_out(experiment)
    problem = dense.planned(design, 4, 4)
    u = dense.standard_uncertainties(problem, dense.linearised(problem), symbols=["U6"])["U6"]
    found = length_map(experiment.with_(coverage_factor=factor), GRID)
    check_points(found, u, (0.1e-6 + 1e-7 * sizes(found.points)) / factor)
    none = length_map(experiment.with_(target_uncertainty=None), GRID)
    np.testing.assert_array_equal(none.maximum, found.maximum)
    assert np.isnan(none.missed).all() and none.coverage_factor == 2.0


def test_undetermined_lengths_are_counted_and_miss_the_target(tmp_path: Path) -> None:
    text = TEXT.replace("position_coefficients: 4", "position_coefficients: 6")
    experiment = experiment_of(tmp_path, text)
    # Points that are not where the balls are, so that they notice what these leave open.
    found = length_map(experiment, (2, 3, 4))
    at = linearise(lay_out(experiment))
    probes = np.zeros(24, np.int64) + at.design.probes.names.index("down")
    u = np.zeros((24, 24))
    for tile in pair_tiles(displacements(at, MeasuredPoints(found.points, probes))):
        u[tile.first, tile.second] = np.where(tile.is_open, np.nan, tile.uncertainties)
    pairs = u[np.triu_indices(24, 1)]
    assert np.isnan(pairs).any() and not np.isnan(pairs).all()
    check_points(found, pairs, 0.5e-6 + 1e-6 * sizes(found.points))
