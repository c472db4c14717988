"""Univariate families: what vanishes where, what they span, and the form they are quoted in."""

from __future__ import annotations

import numpy as np
import pytest

from simulator.machines.bases import Basis, Monomial, Polynomial, Spline, spline_containing, whole_values

FAMILIES: dict[str, Basis] = {
    "Chebyshev": Polynomial(6),
    "monomial": Monomial(6),
    "two coefficients": Polynomial(2),
    "cubic spline": Spline(4, (0.5,)),
    "uneven knots": Spline(3, (0.2, 0.3, 0.9)),
    "double knot": Spline(4, (0.4, 0.4)),
    "broken line": Spline(2, (0.25, 0.5)),
    "no interior knot": Spline(3),
}
families = pytest.mark.parametrize("family", FAMILIES.values(), ids=FAMILIES)
ENDS = np.array([0.0, 1.0])
T = np.linspace(0.0, 1.0, 41)


def written_out(basis: Basis, names: tuple[str, ...], t: np.ndarray) -> np.ndarray:
    """The functions that names such as t^2, N3(t) and an empty one for 1 stand for."""
    columns = []
    for name in names:
        if name.startswith("N"):
            assert isinstance(basis, Spline)
            columns.append(b_spline(basis, int(name[1:].partition("(")[0]) - 1, basis.order, t))
        else:
            columns.append(t ** int(name.partition("^")[2] or 0))
    return np.stack(columns, axis=1)


def b_spline(basis: Spline, j: int, order: int, t: np.ndarray) -> np.ndarray:
    """B-spline j by the recurrence of Cox and de Boor, on [0, 1)."""
    knots = [0.0] * basis.order + list(basis.knots) + [1.0] * basis.order
    if order == 1:
        return ((knots[j] <= t) & (t < knots[j + 1])).astype(float)
    left, right = knots[j + order - 1] - knots[j], knots[j + order] - knots[j + 1]
    result = np.zeros_like(t)
    if left:
        result += (t - knots[j]) / left * b_spline(basis, j, order - 1, t)
    if right:
        result += (knots[j + order] - t) / right * b_spline(basis, j + 1, order - 1, t)
    return result


@families
def test_functions_vanish_where_they_should(family: Basis) -> None:
    assert family.values(ENDS).shape == (2, family.size)
    np.testing.assert_allclose(family.values(ENDS)[0], 0.0, atol=1e-15)
    np.testing.assert_allclose(family.interior().values(ENDS), 0.0, atol=1e-15)
    assert family.interior().zero_at_one and family.interior().size == family.size - 1


@families
def test_whole_family_is_independent(family: Basis) -> None:
    whole = whole_values(family, T)
    assert np.linalg.matrix_rank(whole) == whole.shape[1] == family.size + 1
    # What vanishes at 0 is in the span of t and the interior functions.
    rest = family.values(T) - whole[:, 1:] @ np.linalg.lstsq(whole[:, 1:], family.values(T), rcond=None)[0]
    np.testing.assert_allclose(rest, 0.0, atol=1e-13)


@families
def test_quoted_form_gives_the_same_functions(family: Basis) -> None:
    t = T[:-1]
    for quoted, values in (
        (family.quoted(), family.values(t)),
        (family.interior().quoted(), family.interior().values(t)),
        (family.quoted_whole(), whole_values(family, t)),
    ):
        assert len(set(quoted.names)) == len(quoted.names) == len(quoted.matrix)
        np.testing.assert_allclose(written_out(family, quoted.names, t) @ quoted.matrix, values, atol=1e-12)


@pytest.mark.parametrize(("order", "knots"), [(1, ()), (4, (0.0,)), (4, (0.6, 0.5)), (3, (0.5, 0.5, 0.5)), (4, (1.2,))])
def test_impossible_splines_are_refused(order: int, knots: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="order|knot"):
        Spline(order, knots)


@pytest.mark.parametrize(
    ("parts", "raised"),
    [
        ((Polynomial(5), Monomial(7)), 0),
        ((Polynomial(5), Polynomial(5)), 1),
        ((Spline(4, (0.5,)), Polynomial(3)), 0),
        ((Spline(4, (0.5,)), Spline(3, (0.25, 0.5))), 1),
        ((Spline(3), Polynomial(5)), 0),
    ],
)
def test_a_containing_family_contains(parts: tuple[Basis, ...], raised: int) -> None:
    whole = whole_values(spline_containing(parts, raised), T)
    for k, part in enumerate(parts):
        values = whole_values(part, T)
        if k >= len(parts) - raised:
            values = values * T[:, None]
        left = values - whole @ np.linalg.lstsq(whole, values, rcond=None)[0]
        np.testing.assert_allclose(left, 0.0, atol=1e-12)
