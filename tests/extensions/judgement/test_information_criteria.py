"""Criteria of the ladder against the logarithm of the likelihood."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from ballplate.extensions.judgement.rung_choice import Comparison, FittedSum
from scipy.stats import norm


@pytest.mark.parametrize("given", [True, False])
def test_criteria_are_those_of_the_normal_likelihood(given: bool) -> None:
    """-2 ln L + 2 k and -2 ln L + k ln n, up to what both models have in common."""
    n, model = 40, None
    found, wanted = [], []
    for seed, parameters in enumerate((10, 13)):
        left = np.random.default_rng(seed).normal(0.0, 1.1, n)
        scale = 1.0 if given else np.sqrt((left**2).mean())
        minus = -2.0 * norm.logpdf(left, scale=scale).sum()
        count = parameters + (not given)
        wanted.append([minus + 2 * count, minus + count * np.log(n)])
        fitted: Any = FittedSum(model, float(left @ left), n - parameters)  # type: ignore[arg-type]
        criteria = Comparison(given, n).criteria(fitted)
        found.append([criteria.aic, criteria.bic])
    np.testing.assert_allclose(np.diff(found, axis=0), np.diff(wanted, axis=0))
