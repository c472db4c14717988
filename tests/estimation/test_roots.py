"""Square roots of the covariance of the shared parameters, and the first of largest values."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.simulator.computing.numerics import (
    comparable,
    first_largest,
    first_largest_of_columns,
)
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.linearisation import linearise
from hypothesis import given, strategies as st

from tests.reference.designs import grid_experiment

from .test_against_dense import deficient_grid_of_four


@pytest.mark.parametrize("design", [grid_experiment(3), deficient_grid_of_four()])
def test_all_roots_are_of_one_covariance(design: Design) -> None:
    at = linearise(design)
    found, root = at.spectrum, at.factor.root * at.spectrum.scale
    # What is undetermined left out: the pseudo-inverse of the scaled information.
    expected = np.linalg.pinv(root, rcond=1e-10)
    expected = expected @ expected.T
    for one in (found.root, found.principal_root):
        scaled = one / found.scale[:, None]
        np.testing.assert_allclose(scaled @ scaled.T, expected, atol=1e-9 * np.abs(expected).max())
    assert found.root.shape == (len(at.layout), found.rank)


NUMBERS = st.sampled_from(
    [
        0.0,
        1.0,
        1.0 + 1e-9,
        1.0 - 1e-9,
        1.0 + 2.0**-20,
        0.1 + 0.2,
        0.3,
        2.0,
        2.0 - 1e-12,
        np.nan,
        np.inf,
        -np.inf,
        -3.0,
    ]
)


@given(values=st.lists(NUMBERS, min_size=1, max_size=12))
def test_the_first_of_the_largest_is_that_of_all_compared(values: list[float]) -> None:
    array = np.array(values)
    known = np.flatnonzero(~np.isnan(array))
    if len(known):
        # np.nanargmax takes a NaN for what is not beyond it where the others are -inf.
        assert first_largest(array) == known[comparable(array)[known].argmax()]


@given(rows=st.lists(st.tuples(*3 * [NUMBERS.filter(np.isfinite)]), min_size=1, max_size=12))
def test_the_first_of_the_largest_of_columns_is_that_of_each(rows: list[tuple[float, ...]]) -> None:
    array = np.array(rows) * [1.0, 1e-15, 1e15]
    expected = [first_largest(column) for column in array.T]
    assert first_largest_of_columns(array).tolist() == expected
