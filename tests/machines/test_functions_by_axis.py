"""Univariate functions of their own along each axis, against NumPy's polynomials and SciPy's splines.

NPL Report CISE 15/98, equation (4): three, possibly different, classes of univariate function.
"""

from __future__ import annotations

import re
from itertools import product
from typing import Any

import numpy as np
import pytest
from ballplate.simulator.machines._basis_settings import SplineSettings
from ballplate.simulator.machines._empirical import FUNCTIONS, EmpiricalModel
from ballplate.simulator.machines.empirical_settings import EmpiricalSettings
from ballplate.simulator.machines.settings import build_error_model
from numpy.polynomial import Chebyshev, Polynomial
from scipy.interpolate import BSpline

LOWER, UPPER = (-0.2, 0.1, 0.0), (0.8, 0.7, 1.3)
TERMS = ("sums", "univariate", "tensor")


def interior(basis: Any, count: int | None) -> list[Any]:
    """Functions that vanish at 0 and 1, of a basis as a file states it."""
    if isinstance(basis, dict):
        order, knots = basis["order"], basis.get("knots", ())
        every = [0.0] * order + list(knots) + [1.0] * order
        size = order + len(knots)
        return [BSpline(every, np.eye(size)[k], order - 1) for k in range(1, size - 1)]
    assert count is not None
    if basis == "monomial":
        return [Polynomial([0.0] * k + [1.0, -1.0]) for k in range(1, count - 1)]
    return [
        lambda t, k=k: t * (1.0 - t) * Chebyshev.basis(k, domain=[0.0, 1.0])(t)
        for k in range(count - 2)
    ]


def drawn(seed: int) -> tuple[EmpiricalSettings, list[list[Any]]]:
    """Settings with a random basis along each axis, and their interior functions."""
    draw = np.random.default_rng(seed)
    bases: list[Any] = []
    counts: list[int | None] = []
    for kind in draw.permutation(["spline", "chebyshev", "monomial"]):
        order, knots = int(draw.integers(2, 5)), np.sort(draw.uniform(0.1, 0.9, draw.integers(3)))
        is_spline = kind == "spline"
        bases.append({"order": order, "knots": tuple(knots.tolist())} if is_spline else str(kind))
        counts.append(None if is_spline else order + 1)
    settings = EmpiricalSettings.model_validate({
        "kind": "empirical", "terms": TERMS[seed % 3], "basis": dict(zip("xyz", bases, strict=True)),
        "coefficients": {a: n for a, n in zip("xyz", counts, strict=True) if n}, "rotations": ("linearised", "full")[seed % 2],
    })  # fmt: skip
    return settings, list(map(interior, bases, counts))


def model_of(settings: EmpiricalSettings) -> EmpiricalModel:
    model = build_error_model(settings, LOWER, UPPER)
    assert isinstance(model, EmpiricalModel)
    return model


@pytest.mark.parametrize("seed", range(12))
def test_terms_are_products_of_the_functions_of_each_axis(seed: int) -> None:
    settings, functions = drawn(seed)
    terms = model_of(settings).terms
    t = np.random.default_rng(seed).random((300, 3))
    values = terms.values(t)

    def factor(written: str) -> Any:
        if written == "1":
            return np.ones(len(t))
        index, variable = re.fullmatch(r"(?:s(\d+)\()?([xyz])\)?", written).groups()  # type: ignore[union-attr]
        axis = "xyz".index(variable)
        return functions[axis][int(index) - 1](t[:, axis]) if index else t[:, axis]

    dense = [np.prod([factor(part) for part in name.split("*")], axis=0) for name in terms.names]
    np.testing.assert_allclose(values, np.stack(dense, axis=1), rtol=0, atol=1e-13)

    # The whole space: all products, equation (4) with its redundancy, or equation (3).
    families = [
        np.stack([np.ones(len(t)), t[:, k], *(f(t[:, k]) for f in functions[k])], axis=1)
        for k in range(3)
    ]
    whole = []
    for indices in product(*(range(family.shape[1]) for family in families)):
        low, middle, _ = sorted(indices)
        if {"tensor": True, "univariate": middle == 0, "sums": low == 0 and middle <= 1}[
            settings.terms
        ]:
            whole.append(np.prod([families[k][:, indices[k]] for k in range(3)], axis=0))
    columns = np.stack(whole, axis=1)
    assert np.linalg.matrix_rank(columns) == np.linalg.matrix_rank(values) == values.shape[1]
    both = np.linalg.matrix_rank(np.concatenate([columns, values], axis=1), tol=1e-9)
    assert both == values.shape[1]


@pytest.mark.parametrize("seed", range(6))
def test_derivatives_and_quoted_coefficients(seed: int) -> None:
    settings, functions = drawn(seed)
    model = model_of(settings)
    draw = np.random.default_rng(seed)
    x, p = draw.uniform(LOWER, UPPER, (8, 3)), draw.normal(0.0, 0.1, (8, 3))
    a = draw.normal(0.0, 1e-2, len(model.parameters))
    jacobian = model.jacobian(x, a, p)
    for k in range(0, len(a), 7):
        step = 1e-4 * np.eye(len(a))[k]
        slope = (model.error(x, a + step, p) - model.error(x, a - step, p)) / 2e-4
        np.testing.assert_allclose(jacobian[:, :, k], slope, rtol=0, atol=1e-8)
    # Monomials along axes of polynomials, splines along the others, both by their written names.
    reported = model.reported()
    t = (x - LOWER) / np.subtract(UPPER, LOWER)
    known = dict(zip("xyz", t.T, strict=True))
    found = np.zeros((8, 6))
    for name, coefficient in zip(reported.names, reported.matrix @ a, strict=True):
        function, written = name.split(" ")
        value = np.full(8, coefficient)
        for part in written.split("*"):
            if part.startswith("s"):
                axis = "xyz".index(part[-2])
                assert isinstance(getattr(settings.basis, "xyz"[axis]), SplineSettings)
                value = value * functions[axis][int(part[1:-3]) - 1](t[:, axis])
            else:
                variable, _, power = part.partition("^")
                value = value * known[variable] ** int(power or 1)
        found[:, list(FUNCTIONS).index(function)] += value
    np.testing.assert_allclose(found, model.functions(x, a), rtol=0, atol=1e-13)


@pytest.mark.parametrize("terms", TERMS)
def test_one_family_for_all_axes_is_the_same_as_three(terms: str) -> None:
    one: dict[str, Any] = {"kind": "empirical", "terms": terms, "coefficients": 4}
    three = one | {"coefficients": {"x": 4, "y": 4, "z": 4}}
    first, second = (model_of(EmpiricalSettings.model_validate(each)) for each in (one, three))
    assert first == second
