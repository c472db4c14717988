"""Univariate families: what vanishes where, what they span, and the form they are quoted in."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.simulator.machines._basis_settings import SplineSettings
from ballplate.simulator.machines.bases import Basis, Ends, Monomial, Polynomial, whole_values
from ballplate.simulator.machines.spline_basis import Spline
from hypothesis import given, strategies as st
from scipy.interpolate import BSpline
from scipy.linalg import null_space

FAMILIES: dict[str, Basis] = {
    "Chebyshev": Polynomial(6),
    "monomial": Monomial(6),
    "two coefficients": Polynomial(2),
    "cubic spline": Spline(4, (0.5,)),
    "uneven knots": Spline(3, (0.2, 0.3, 0.9)),
    "double knot": Spline(4, (0.4, 0.4)),
    "broken line": Spline(2, (0.25, 0.5)),
    "no interior knot": Spline(3),
    "periodic": Spline(4, (0.3, 0.5, 0.5), ends="periodic"),
}
CONSTRAINED: tuple[Ends, ...] = (
    "zero slope at start",
    "zero slope at end",
    "zero slopes",
    "periodic",
)
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
    rest = (
        family.values(T)
        - whole[:, 1:] @ np.linalg.lstsq(whole[:, 1:], family.values(T), rcond=None)[0]
    )
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
        np.testing.assert_allclose(
            written_out(family, quoted.names, t) @ quoted.matrix, values, atol=1e-12
        )


@pytest.mark.parametrize(
    ("order", "knots"), [(1, ()), (4, (0.0,)), (4, (0.6, 0.5)), (3, (0.5, 0.5, 0.5)), (4, (1.2,))]
)
def test_impossible_splines_are_refused(order: int, knots: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="order|knot"):
        Spline(order, knots)


@pytest.mark.parametrize("ends", CONSTRAINED)
def test_splines_too_small_for_their_ends_are_refused(ends: Ends) -> None:
    with pytest.raises(ValueError, match="broken lines"):
        Spline(2, (0.5,), ends=ends)
    if ends == "zero slopes":
        with pytest.raises(ValueError, match="without knots"):
            Spline(3, ends=ends)
    if ends == "periodic":
        with pytest.raises(ValueError, match="too close"):
            Spline(3, (1e-5,), ends=ends)


@st.composite
def constrained(draw: st.DrawFn) -> Spline:
    order, ends = draw(st.integers(3, 6)), draw(st.sampled_from(CONSTRAINED))
    places = draw(st.lists(st.integers(1, 19), max_size=4, unique=True))
    knots = [place / 20 for place in places for _ in range(draw(st.integers(1, order - 1)))]
    if ends == "zero slopes" and order + len(knots) < 4:
        knots = [0.5]
    return Spline(order, tuple(sorted(knots)), draw(st.booleans()), ends)


@given(constrained())
def test_constrained_ends_hold_for_every_function_and_for_no_fewer(basis: Spline) -> None:
    """The span is the null space of the conditions on all B-splines, found densely."""
    order = basis.order
    all_ = BSpline(
        [0.0] * order + list(basis.knots) + [1.0] * order, np.eye(basis.count), order - 1
    )

    def jump(k: int) -> np.ndarray:
        return np.asarray(all_(1.0, nu=k) - all_(0.0, nu=k))

    rows = [all_(0.0)] + [all_(1.0)] * basis.zero_at_one
    if basis.ends == "periodic":
        rows += [jump(k) for k in range(1, order - 1)]
    else:
        rows += [all_(0.0, nu=1)] * (basis.ends != "zero slope at end")
        rows += [all_(1.0, nu=1)] * (basis.ends != "zero slope at start")
    conditions = np.stack([row / np.abs(row).max() for row in rows])
    quoted = basis.quoted()
    ours = np.zeros((basis.count, basis.size))
    ours[[int(name[1:].partition("(")[0]) - 1 for name in quoted.names]] = quoted.matrix
    np.testing.assert_allclose(conditions @ ours, 0.0, atol=1e-12)
    wanted = null_space(conditions)
    assert basis.size == wanted.shape[1]
    # Both bases are of full rank, and each lies in the span of the other.
    assert basis.size == 0 or np.linalg.cond(ours) < 1e3
    np.testing.assert_allclose(ours - wanted @ (wanted.T @ ours), 0.0, atol=1e-12)
    np.testing.assert_allclose(basis.values(T), all_(T) @ ours, atol=1e-12)


@pytest.mark.parametrize("slopes", [{"start": 0}, {"end": 0}, {"start": 0, "end": 0}])
def test_slopes_of_zero_are_held_at_the_ends_that_state_them(slopes: dict[str, int]) -> None:
    spline = SplineSettings(knots=(0.3, 0.6), slopes=slopes).spline()
    for at, other, end in ((0.0, 1e-6, "start"), (1.0, 1.0 - 1e-6, "end")):
        change = np.abs(np.diff(spline.values(np.array([at, other])), axis=0)).max()
        assert (change < 1e-10) == (end in slopes)
