"""Directions are described by the space that they span, not by the basis that rounding gives of
it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from ballplate.rank.verdicts import (
    elementary_mixture,
    null_directions,
    principal_directions,
    verdict,
)
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.quantities import LengthFunction, Target
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

DESIGNS = Path(__file__).parents[2] / "designs"
NOISE = 1e-12

Real = NDArray[np.float64]


def orthogonal(seed: int, size: int) -> Real:
    """A random orthogonal matrix."""
    q, r = np.linalg.qr(np.random.default_rng(seed).standard_normal((size, size)))
    return np.asarray(q * np.sign(np.diagonal(r)))


@cache
def judged(file: str, variant: str) -> Linearisation:
    return linearise(lay_out(next(one for one in load(DESIGNS / file) if one.name == variant)))


@pytest.mark.parametrize(
    ("file", "variant"),
    [
        ("npl/6.1.1.yaml", "B"),
        ("npl/6.1.1.yaml", "D"),
        ("hurt_foss/bryan-gauge.yaml", "one height"),
        ("hurt_foss/bar-bell.yaml", "one axis"),
    ],
)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=5, deadline=None)
def test_any_basis_of_what_is_open_gives_the_same_words(file: str, variant: str, seed: int) -> None:
    at = judged(file, variant)
    found = at.spectrum
    assert found.deficiency > 1
    mix, noise = orthogonal(seed, found.deficiency), np.random.default_rng(seed)
    shared = (found.null / found.scale[:, None]) @ mix
    shared += NOISE * noise.standard_normal(shared.shape)
    balls = at.ball_null @ mix
    balls += NOISE * np.abs(balls).max(initial=0.0) * noise.standard_normal(balls.shape)
    directions = np.concatenate(
        [found.directions[:, : found.rank], shared * found.scale[:, None]], axis=1
    )
    other = replace(at, spectrum=replace(found, known=directions, triangle=None))
    vars(other)["balls"] = replace(at.balls, null=balls)
    told = [str(one) for one in null_directions(at)]
    assert [str(one) for one in null_directions(other)] == told
    assert len(set(told)) == found.deficiency


@given(seed=st.integers(0, 2**32 - 1), target=st.sampled_from([2e-8, 4e-8]))
@settings(max_examples=2, deadline=None)
def test_any_basis_of_equally_weak_directions_gives_the_same_words(
    seed: int, target: float
) -> None:
    at = judged("npl/6.1.1.yaml", "A")
    found = at.spectrum
    # Neighbours in threes are made equal, and then mixed.
    values = found.values.copy()
    mixed = found.directions / found.scale[:, None]
    for start in range(0, len(values) - 2, 3):
        values[start : start + 3] = values[start + 1]
        mixed[:, start : start + 3] = mixed[:, start : start + 3] @ orthogonal(seed + start, 3)
    noise = np.random.default_rng(seed)
    mixed += NOISE * noise.standard_normal(mixed.shape)
    equal = replace(found, values=values)
    other = replace(
        found,
        values=np.sort(values * (1.0 + NOISE * noise.standard_normal(len(values))))[::-1],
        known=mixed * found.scale[:, None],
        triangle=None,
    )
    limit = Target(LengthFunction(target, 0.0))
    told, same = (
        [str(direction) for direction in verdict(replace(at, spectrum=one), target=limit).weak]
        for one in (equal, other)
    )
    assert len(told) > 3
    assert same == told


@given(
    rows=st.integers(3, 9),
    count=st.integers(1, 3),
    entries=st.sampled_from([(-1, 0, 1), (0, 1), (-2, -1, 0, 0, 1, 3)]),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=60, deadline=None)
def test_no_direction_involves_all_that_another_combination_does(
    rows: int, count: int, entries: tuple[int, ...], seed: int
) -> None:
    draw = np.random.default_rng(seed)
    space = draw.choice(entries, (rows, count)).astype(float)
    if np.linalg.matrix_rank(space) < count:
        return
    told = space @ elementary_mixture(space)
    assert np.linalg.matrix_rank(told) == count
    for one in told.T:
        absent = np.abs(one) < 1e-9
        # What is zero wherever this direction is: this direction alone, up to its length.
        assert count - (np.linalg.matrix_rank(space[absent]) if absent.any() else 0) == 1
    mixed = told @ orthogonal(seed, count)
    again = mixed @ elementary_mixture(mixed)
    assert again == pytest.approx(told, abs=1e-9)


@given(seed=st.integers(0, 2**32 - 1), alike=st.integers(1, 4))
@settings(max_examples=30, deadline=None)
def test_principal_directions_keep_covariance_and_effects(seed: int, alike: int) -> None:
    draw = np.random.default_rng(seed)
    values = np.sort(np.concatenate([np.full(alike, 0.5), [0.2, 3.0]]))[::-1]
    scale = draw.uniform(0.5, 2.0, 8)
    root = scale[:, None] * np.linalg.qr(draw.standard_normal((8, len(values))))[0] / values
    effect = draw.standard_normal((5, 8)) @ root
    turned, size = principal_directions(values, root, effect, scale)
    assert turned @ turned.T == pytest.approx(root @ root.T, rel=1e-9, abs=1e-9)
    assert (size**2).sum() == pytest.approx((effect**2).sum(), rel=1e-6, abs=0.0)
    # Each is an eigenvector of the effects within its group.
    group = slice(1, 1 + alike)
    squares = np.linalg.eigvalsh(effect[:, group].T @ effect[:, group])
    assert size[group] == pytest.approx(np.sqrt(np.maximum(squares, 0.0)), abs=1e-7)
