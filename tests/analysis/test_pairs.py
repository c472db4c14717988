"""Uncertainties of the distances between all pairs of places, against what each pair comes to by
itself.
"""

from __future__ import annotations

import itertools
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from ballplate.simulator.estimation.functions import Displacements
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.geometry.motions import rigid_motions
from ballplate.simulator.inputs.quantities import LengthFunction
from ballplate.uncertainty.pairs import PairTile, all_pairs, pair_tiles, pairs_of
from ballplate.uncertainty.summaries import uncertainties
from numpy.typing import NDArray

from tests.reference.designs import altered, grid, plate_design, six_positions

Real = NDArray[np.float64]


def scattered(n: int, seed: int = 1, d: int = 3, flat: bool = False) -> Displacements:
    """Places at random, some of them at the same point, displaced by variables of all kinds."""
    draw = np.random.default_rng(seed)
    places = draw.uniform(0.0, 1.0, (n, d))
    places[n // 2] = places[n // 3]
    if flat:
        places[:, -1] = 0.25
    common, own = 1e-6 * draw.standard_normal((n, d, 4)), 1e-6 * draw.standard_normal((n, d, d))
    return Displacements(places, common, own, np.zeros((n, d, 0)), places, np.zeros((n, d)))


def with_open(moved: Displacements, size: float, seed: int = 2) -> tuple[Displacements, Real]:
    """The same with two directions open, which move the last fifth of the places by `size` and all
    others by rounding only, on top of a motion of all together that changes no distance; and by how
    much the first direction moves.
    """
    draw, (n, d) = np.random.default_rng(seed), moved.places.shape
    null = 1e-10 * size * draw.standard_normal((n, d, 2))
    null[-(n // 5) :] = size * draw.uniform(0.5, 1.0, (n // 5, d, 2))
    motions = rigid_motions(moved.places)
    return replace(moved, null=null + size * motions[:, :, :2], size=np.full((n, d), size)), null


def one_by_one(moved: Displacements) -> tuple[NDArray[np.int64], Real, Real]:
    """Pairs (m, 2) of places that are apart, with their lengths and standard uncertainties (m,)."""
    every = np.array(list(itertools.combinations(range(len(moved.places)), 2)))
    apart = moved.places[every[:, 0]] - moved.places[every[:, 1]]
    lengths = np.sqrt((apart**2).sum(axis=1))
    every, unit, lengths = every[lengths > 0], apart[lengths > 0], lengths[lengths > 0]
    unit = unit / lengths[:, None]
    first, second = every.T
    parts = [
        np.einsum("md,mdr->mr", unit, moved.common[first] - moved.common[second]),
        np.einsum("md,mdr->mr", unit, moved.own[first]),
        np.einsum("md,mdr->mr", unit, moved.own[second]),
    ]
    return every, lengths, np.sqrt((np.concatenate(parts, axis=1) ** 2).sum(axis=1))


# In one tile, in three, in a plane of space, and in the plane.
MANY = {
    "one tile": scattered(40),
    "tiles": scattered(300),
    "flat": scattered(60, 3, flat=True),
    "plane": scattered(60, 4, d=2),
}


@pytest.mark.parametrize("sigma", [0.0, 1e-320, 1.5])
@pytest.mark.parametrize("moved", MANY.values(), ids=MANY)
def test_all_pairs_are_each_by_itself(moved: Displacements, sigma: float) -> None:
    every, lengths, values = one_by_one(moved)
    labels = 1000 + np.arange(len(moved.places))
    found = all_pairs(moved, labels, LengthFunction(2e-6, 2e-6), sigma)
    assert (found.count, found.undetermined) == (len(every), 0)
    assert found.total == pytest.approx(values.sum(), rel=1e-9)
    assert found.maximum == pytest.approx(values.max(), rel=1e-9)
    assert found.where == tuple(1000 + every[values.argmax()])
    assert found.within == (sigma * values <= 2e-6 + 2e-6 * lengths).sum()
    assert 0 < found.within < found.count or sigma < 1.0
    assert all_pairs(moved, labels).within == 0


@pytest.mark.parametrize("moved", MANY.values(), ids=MANY)
def test_tiles_have_each_pair_once_and_some_pairs_are_the_same(moved: Displacements) -> None:
    every, lengths, values = one_by_one(moved)
    by_pair = {
        (i, j): (length, value)
        for tile in pair_tiles(moved)
        for i, j, length, value in zip(
            tile.first.tolist(), tile.second.tolist(), tile.lengths, tile.uncertainties, strict=True
        )
    }
    assert sum(len(tile.first) for tile in pair_tiles(moved)) == len(by_pair) == len(every)
    expected = np.stack([lengths, values], axis=1)
    np.testing.assert_allclose([by_pair[i, j] for i, j in every.tolist()], expected, rtol=1e-8)
    some = pairs_of(moved, every[::7, ::-1])
    np.testing.assert_allclose(some.lengths, lengths[::7], rtol=1e-12)
    np.testing.assert_allclose(some.uncertainties, values[::7], rtol=1e-9)
    assert not some.is_open.any()


@pytest.mark.parametrize("size", [1e-6, 1.0])
@pytest.mark.parametrize("moved", MANY.values(), ids=MANY)
def test_open_are_the_pairs_whose_distance_an_open_direction_changes(
    moved: Displacements, size: float
) -> None:
    """However long the directions are, and whatever motion of all places they contain."""
    moved, null = with_open(moved, size)
    every, _, values = one_by_one(moved)
    unit = moved.places[every[:, 0]] - moved.places[every[:, 1]]
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    change = np.einsum("md,mdk->mk", unit, null[every[:, 0]] - null[every[:, 1]])
    is_open = np.linalg.norm(change, axis=1) > 1e-5 * size
    found = all_pairs(moved, np.arange(len(moved.places)))
    assert (found.count, found.undetermined) == (len(every), is_open.sum())
    assert 0 < found.undetermined < found.count
    assert found.total == pytest.approx(values[~is_open].sum(), rel=1e-9)
    assert found.maximum == pytest.approx(values[~is_open].max(), rel=1e-9)
    some: PairTile = pairs_of(moved, every)
    np.testing.assert_array_equal(some.is_open, is_open)
    none = all_pairs(moved.select(slice(-(len(moved.places) // 5), None)), np.arange(1000))
    assert none.count == none.undetermined > 0 == none.total == none.maximum


def test_memory_does_not_grow_with_the_pairs() -> None:
    """Less than a number for each pair of 1500 places takes, which is several tiles of them."""
    moved = scattered(1500)
    tracemalloc.start()
    try:
        count = sum(len(tile.first) for tile in pair_tiles(moved))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert count == 1500 * 1499 // 2 - 1
    assert peak < 8 * 1500**2


def test_a_point_next_to_zero_is_named_without_a_sign() -> None:
    """By its number and its place in millimetres, to a tenth of one."""
    design = plate_design(
        grid(3), six_positions(), (), range(9), position_coefficients=3, rotation_coefficients=3
    )
    points = np.array([[-1e-9, 0.2501234, 0.5], [0.1, -2e-9, 0.75]])
    found = uncertainties(linearise(altered(design, evaluation={"points": points})))["U6"]
    names = {"point 1 at (0, 250.1, 500) mm", "point 2 at (100, 0, 750) mm"}
    assert set(found.places) == names and found.largest == "point 1 to point 2"
