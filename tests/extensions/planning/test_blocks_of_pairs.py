"""Criteria of distances, worked through in blocks, against all distances at once; and what a plan
refuses.
"""

from __future__ import annotations

import tracemalloc
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.planning import criteria, information
from ballplate.extensions.planning.campaign_choice import Request, campaign
from ballplate.extensions.planning.criteria import Criterion, CriterionName, Linear, Pairs, Several
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.protocol import Array

from tests.extensions.planning import wording

from .small_pool import TEXT

SIZE = 9


def some_places(count: int, dimension: int) -> tuple[Array, Array, Array]:
    """Places of which two coincide, how they are displaced, and an open direction that moves one of
    them.
    """
    generator = np.random.default_rng(count + dimension)
    places = generator.random((count, dimension))
    places[count // 2] = places[1]
    open_ = np.zeros((count, dimension, 1))
    open_[count // 3] = 1e-6
    return places, generator.normal(size=(count, dimension, SIZE)), open_


def all_rows(places: Array, displacement: Array, open_: Array) -> tuple[Array, Array, int]:
    """Rows (pairs, z) and lengths (pairs,) of all distances that count, one by one, and how many
    are left open.
    """
    rows, lengths, excluded = [], [], 0
    for i, j in combinations(range(len(places)), 2):
        apart = places[i] - places[j]
        length = float(np.sqrt(apart @ apart))
        if length == 0.0:
            continue
        if np.abs(apart @ (open_[i] - open_[j])).max() > 1e-13 * length:
            excluded += 1
            continue
        rows.append(apart / length @ (displacement[i] - displacement[j]))
        lengths.append(length)
    return np.array(rows), np.array(lengths), excluded


@pytest.mark.parametrize("largest", [False, True])
@pytest.mark.parametrize(("count", "dimension"), [(5, 2), (23, 3), (40, 2)])
@pytest.mark.parametrize(("block", "kept"), [(7, 0), (7, 1000), (256, 1024)])
def test_blocks_make_no_difference(
    monkeypatch: pytest.MonkeyPatch,
    block: int,
    kept: int,
    count: int,
    dimension: int,
    largest: bool,
) -> None:
    monkeypatch.setattr(criteria, "BLOCK", block)
    monkeypatch.setattr(criteria, "MOST_PLACES_KEPT", kept)
    monkeypatch.setattr(criteria, "KEPT", 10 * kept)
    given = some_places(count, dimension), some_places(count + 1, dimension)
    several = Several(tuple(Pairs(*one) for one in given))
    rows, lengths, excluded = (
        np.concatenate(parts) for parts in zip(*map(_listed, given), strict=True)
    )
    assert several.count == len(rows)
    assert [part.excluded for part in several.parts if isinstance(part, Pairs)] == excluded.tolist()
    assert np.sort(np.concatenate(list(several.lengths()))) == pytest.approx(
        np.sort(lengths), rel=1e-12
    )

    root = np.random.default_rng(3).normal(size=(SIZE, SIZE))
    name: CriterionName = "U6-maximum" if largest else "U6"
    found = Criterion(name, False, several, np.zeros((0, SIZE)))
    expected = np.sqrt(np.einsum("pz,zy,py->p", rows, root @ root.T, rows))
    assert found.value(root) == pytest.approx(
        expected.max() if largest else expected.mean(), rel=1e-12
    )

    power = 8.0
    weights = (expected / expected.max()) ** (power - 1) if largest else np.ones(len(rows))
    weights /= weights.sum()
    smooth, value, derivative = found.tangent(root, power)
    assert value == pytest.approx(weights @ expected, rel=1e-12)
    norm = np.mean(expected**power) ** (1 / power) if largest else expected.mean()
    assert smooth == pytest.approx(norm, rel=1e-12)
    direct = (rows.T * (0.5 * weights / expected)) @ rows
    np.testing.assert_allclose(derivative, direct, rtol=0.0, atol=1e-12 * np.abs(direct).max())
    # Functions that are listed one by one have the same tangent.
    whole = Several((Linear(rows, lengths),))
    listed = Criterion(name, False, whole, np.zeros((0, SIZE))).tangent(root, power)
    np.testing.assert_allclose(listed[2], direct, rtol=0.0, atol=1e-12 * np.abs(direct).max())


def _listed(given: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    rows, lengths, excluded = all_rows(*given)
    return rows, lengths, np.array([excluded])


def test_many_points_take_little_memory() -> None:
    """A matrix over all pairs of two thousand places has 32 MB, and some ten of them used to be
    formed.
    """
    generator = np.random.default_rng(1)
    places, displacement = generator.random((2000, 3)), generator.normal(size=(2000, 3, 4))
    pairs = Pairs(places, displacement, np.zeros((2000, 3, 0)))
    found = Criterion("U6", False, Several((pairs,)), np.zeros((0, 4)))
    tracemalloc.start()
    try:
        found.tangent(np.eye(4))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert pairs.count == 1_999_000
    assert peak < 24e6


def test_more_points_than_a_plan_goes_through(tmp_path: Path) -> None:
    path = tmp_path / "pool.yaml"
    path.write_text(TEXT.replace("random: 20", "random: 1001"))
    experiment = load(path, planning=True)[0]
    with pytest.raises(ExperimentError) as caught:
        campaign(experiment, Request("U6-maximum", None))
    assert (
        str(caught.value)
        == f"{path}: evaluation.points: 1001 points make 500500 distances, which a search for"
        " U6-maximum computes some thousand times, which takes too long; give at most 1000,"
        " better some hundred, or plan for tasks"
    )
    criteria.refuse_many_points(experiment, "tasks")


def test_more_candidates_than_there_is_memory_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "pool.yaml"
    path.write_text(TEXT)
    experiment = load(path, planning=True)[0]
    assert experiment.pool is not None
    candidates = experiment.pool.candidates
    monkeypatch.setattr(information, "MOST_BYTES", 0)
    with pytest.raises(
        ExperimentError, match=wording.CANDIDATES_WITH_PARAMETERS_EACH_TAKE
    ) as caught:
        information.pool_information(experiment, candidates, False)
    size = int(str(caught.value).split(" candidates with ")[1].split()[0])
    monkeypatch.setattr(information, "MOST_BYTES", 13 * 8 * size**2)
    assert len(information.pool_information(experiment, candidates, False).matrices) == 13
