"""Splines under constraints, against dense computations, other libraries and closed forms."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from ballplate.simulator.splines.space import SplineError, SplineSpace, at_every, with_boundaries
from ballplate.simulator.splines.spline_fit import Constraint, fit, pieces, rows
from hypothesis import given, settings, strategies as st
from scipy.interpolate import CubicSpline, make_lsq_spline

from tests.reference import truncated_powers

EPSILON = np.finfo(float).eps


def noisy(count: int, lower: float, upper: float, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(seed)
    t = np.sort(np.concatenate([[0.0, 1.0], generator.random(count - 2)]))
    return lower + (upper - lower) * t, np.sin(5 * t) + 0.1 * generator.standard_normal(count)


def clamped(
    space: SplineSpace, values: tuple[float, float], slopes: tuple[float, float]
) -> tuple[Constraint, ...]:
    """The document's four conditions, equation (12)."""
    ends = (space.lower, space.upper)
    return tuple(
        Constraint(end, k, value)
        for k, both in enumerate((values, slopes))
        for end, value in zip(ends, both, strict=True)
    )


def document_rows(space: SplineSpace) -> np.ndarray:
    """Equation (14)."""
    knots, ends = np.array(space.knots), np.array([space.lower, space.upper])
    return np.vstack(
        [truncated_powers.powers(ends, knots), truncated_powers.powers(ends, knots, 1)]
    )


@pytest.mark.parametrize("every", [4, 5, 8])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_pseudo_inverses_give_the_same_curve_where_truncated_powers_are_well_conditioned(
    every: int, seed: int
) -> None:
    x, y = noisy(40, 0.0, 1.0, seed)
    space = SplineSpace(4, 0.0, 1.0, at_every(x, every, 0.0, 1.0))
    fitted = fit(space, x, y, clamped(space, (0.1, -0.9), (4.0, 0.5)))
    knots, conditions = np.array(space.knots), document_rows(space)
    c = truncated_powers.constrained(
        x, y, knots, conditions, np.array([0.1, -0.9, 4.0, 0.5]), 1e-12
    )
    design = truncated_powers.powers(x, knots)
    # What rounding does to a pseudo-inverse solution: the condition times the solution, its square
    # times the residual.
    reduced = design @ (np.eye(space.count) - np.linalg.pinv(conditions) @ conditions)
    found = np.linalg.svd(reduced, compute_uv=False)[: space.count - 4]
    size = np.linalg.norm(c) + np.linalg.norm(fitted.residuals) / found[-1]
    bound = 50 * EPSILON * found[0] / found[-1] * size
    assert bound < 1e-6
    np.testing.assert_allclose(design @ c, fitted.values(x), rtol=0, atol=bound)


@pytest.mark.parametrize(
    ("lower", "upper"), [(0.0, 1.0), (0.0, 6e4), (1000.0, 1060.0), (-0.06, 0.0)]
)
def test_the_documents_formula_with_sixty_digits_gives_the_same_curve_for_any_abscissa(
    lower: float, upper: float
) -> None:
    """In double precision it fails for the second and the third: see below."""
    x, y = noisy(20, lower, upper)
    space = SplineSpace(4, lower, upper, at_every(x, 5, lower, upper))
    slope = 3.0 / (upper - lower)
    fitted = fit(space, x, y, clamped(space, (0.1, -0.9), (slope, 0.0)))
    knots = np.array(space.knots)
    with mpmath.workdps(60):
        design = _exact_powers(x, knots)
        conditions = mpmath.matrix(
            [*_exact_powers([lower, upper], knots).tolist(), *_slopes([lower, upper], knots)]
        )
        inverse = _pseudo_inverse(conditions)
        z = mpmath.eye(design.cols) - inverse * conditions
        start = inverse * mpmath.matrix([0.1, -0.9, slope, 0.0])
        c = start + _pseudo_inverse(design * z) * (mpmath.matrix(y.tolist()) - design * start)
        curve = np.array([float(value) for value in design * c])
    np.testing.assert_allclose(fitted.values(x), curve, rtol=0, atol=1e-11)


def _exact_powers(x: object, knots: np.ndarray) -> mpmath.matrix:
    points, places = (
        [mpmath.mpf(float(value)) for value in x],
        [mpmath.mpf(float(t)) for t in knots],
    )  # type: ignore[attr-defined]
    return mpmath.matrix(
        [[p**0, p, p**2, p**3, *(max(p - t, 0) ** 3 for t in places)] for p in points]
    )


def _slopes(x: list[float], knots: np.ndarray) -> list[list[mpmath.mpf]]:
    points, places = [mpmath.mpf(value) for value in x], [mpmath.mpf(float(t)) for t in knots]
    return [
        [p * 0, p**0, 2 * p, 3 * p**2, *(3 * max(p - t, 0) ** 2 for t in places)] for p in points
    ]


def _pseudo_inverse(matrix: mpmath.matrix) -> mpmath.matrix:
    wide = matrix.rows < matrix.cols
    u, s, v = mpmath.svd_r(matrix.T if wide else matrix)
    inverse = mpmath.diag([1 / value if value > mpmath.mpf(10) ** -35 * s[0] else 0 for value in s])
    found = v.T * inverse * u.T
    return found.T if wide else found


@pytest.mark.parametrize(("lower", "upper", "worst"), [(0.0, 6e4, 1e-3), (1000.0, 1060.0, 1.0)])
def test_double_precision_pseudo_inverses_fail_far_from_zero_and_in_small_units(
    lower: float, upper: float, worst: float
) -> None:
    """Cubes of the abscissa leave a condition beyond the tolerance that tells zero singular
    values.
    """
    x, y = noisy(20, lower, upper)
    space = SplineSpace(4, lower, upper, at_every(x, 5, lower, upper))
    slope = 3.0 / (upper - lower)
    fitted = fit(space, x, y, clamped(space, (0.1, -0.9), (slope, 0.0)))
    knots, values = np.array(space.knots), np.array([0.1, -0.9, slope, 0.0])
    design = truncated_powers.powers(x, knots)
    assert np.linalg.cond(design) > 1e13
    for tolerance in (1e-15, 1e-12, 1e-10):
        c = truncated_powers.constrained(x, y, knots, document_rows(space), values, tolerance)
        assert np.abs(design @ c - fitted.values(x)).max() > worst
    # The fit itself is indifferent to unit and origin.
    t = (x - lower) / (upper - lower)
    same = SplineSpace(4, 0.0, 1.0, tuple((knots - lower) / (upper - lower)))
    scaled = fit(same, t, y, clamped(same, (0.1, -0.9), (3.0, 0.0)))
    np.testing.assert_allclose(fitted.values(x), scaled.values(t), rtol=0, atol=1e-11)


def test_no_constraints_is_the_least_squares_spline_of_scipy() -> None:
    x, y = noisy(50, 2.0, 5.0)
    fitted = fit(SplineSpace(4, 2.0, 5.0, (3.0, 4.0, 4.0)), x, y)
    other = make_lsq_spline(x, y, [2.0] * 4 + [3.0, 4.0, 4.0] + [5.0] * 4, 3)
    np.testing.assert_allclose(fitted.coefficients, other.c, rtol=1e-10)


def test_as_many_constraints_as_freedom_is_interpolation() -> None:
    x, y = noisy(9, 0.0, 4.0)
    space = SplineSpace(4, 0.0, 4.0, tuple(x[1:-1]))
    fitted = fit(space, x, y, (Constraint(0.0, 1, 2.0), Constraint(4.0, 1, -1.0)))
    places = np.linspace(0.0, 4.0, 101)
    other = CubicSpline(x, y, bc_type=((1, 2.0), (1, -1.0)))
    np.testing.assert_allclose(fitted.values(places), other(places), atol=1e-12)
    assert fitted.degrees_of_freedom == 0 and np.isnan(fitted.sigma)

    ends = (*clamped(space, (0.0, 1.0), (0.0, 0.0)), Constraint(0.0, 2, 0.0))
    alone = SplineSpace(4, 0.0, 4.0, (2.0,))
    decided = fit(alone, np.array([1.0]), np.array([9.0]), ends)
    assert decided.free == 0 and decided.degrees_of_freedom == 1
    assert decided.spread(places).max() == 0.0


@st.composite
def problems(draw: st.DrawFn) -> tuple[SplineSpace, np.ndarray, np.ndarray, tuple[Constraint, ...]]:
    order = draw(st.integers(2, 6))
    lower = draw(st.sampled_from([0.0, -3.0, 1e3]))
    length = draw(st.sampled_from([1.0, 1e-3, 60.0]))
    places = draw(st.lists(st.integers(1, 9), max_size=4, unique=True))
    knots = sorted(
        lower + length * k / 10 for k in places for _ in range(draw(st.integers(1, order - 1)))
    )
    space = SplineSpace(order, lower, lower + length, tuple(knots))
    generator = np.random.default_rng(draw(st.integers(0, 99)))
    x = np.sort(
        np.concatenate(
            [lower + length * np.linspace(0, 1, 41), lower + length * generator.random(20)]
        )
    )
    x = np.clip(x, space.lower, space.upper)
    found = []
    for end in (space.lower, space.upper):
        for k in range(min(order - 1, 2)):
            if draw(st.booleans()):
                # By the length as rounded: beside 1e3, four conditions on a parabola that agree for
                # 1e-3 contradict each other for it, by less than what is refused.
                value = draw(st.sampled_from([0.0, 1.0, -0.7])) / space.length**k
                found.append(Constraint(end, k, value))
    return space, x, generator.standard_normal(61), tuple(found)


@settings(max_examples=60, deadline=None)
@given(problems())
def test_constraints_hold_and_nothing_that_meets_them_fits_better(
    problem: tuple[SplineSpace, np.ndarray, np.ndarray, tuple[Constraint, ...]],
) -> None:
    space, x, y, constraints = problem
    try:
        fitted = fit(space, x, y, constraints)
    except SplineError as error:
        if "contradicts" in str(error):
            # Straight lines and parabolas without knots cannot meet all four.
            assert len(constraints) > space.count - 2
            return
        # Between two knots of full multiplicity there may be fewer points than the piece has
        # coefficients.
        matrix, _ = rows(space, constraints)
        whole = np.vstack([space.rows(x), matrix.reshape(-1, space.count)])
        assert "lacks" in str(error) and np.linalg.matrix_rank(
            whole / np.abs(whole).max(axis=1, keepdims=True)
        ) < (space.count)
        return
    scale = np.abs(fitted.coefficients).max() + np.abs(y).max()
    for constraint in constraints:
        at = np.array([constraint.at])
        missed = fitted.values(at, constraint.derivative)[0] - constraint.value
        assert abs(missed) * space.length**constraint.derivative < 1e-12 * scale
    # The gradient is a combination of the constraints' rows: Lagrange's conditions.
    design = space.rows(x)
    gradient = design.T @ (design @ fitted.coefficients - y)
    matrix, _ = rows(space, constraints)
    multipliers = np.linalg.lstsq(matrix.T, gradient, rcond=None)[0] if constraints else np.zeros(0)
    assert np.abs(gradient - matrix.T @ multipliers).max() < 1e-9 * scale
    # Covariance: the first block of the inverse of Lagrange's matrix.
    if np.linalg.matrix_rank(matrix, 1e-10) == len(constraints):
        n, m = space.count, len(constraints)
        whole = np.block([[design.T @ design, matrix.T], [matrix, np.zeros((m, m))]])
        np.testing.assert_allclose(
            fitted.root @ fitted.root.T, np.linalg.inv(whole)[:n, :n], atol=1e-8
        )


def test_powers_of_x_are_those_of_the_documents_recursion() -> None:
    x, y = noisy(30, 0.0, 2.0)
    space = SplineSpace(4, 0.0, 2.0, at_every(x, 5, 0.0, 2.0))
    fitted = fit(space, x, y, clamped(space, (0.0, 0.0), (1.0, 0.0)))
    knots, values = np.array(space.knots), np.array([0.0, 0.0, 1.0, 0.0])
    c = truncated_powers.constrained(x, y, knots, document_rows(space), values, 1e-12)
    wanted = truncated_powers.pieces(c, knots)
    np.testing.assert_allclose(
        pieces(fitted, local=False), wanted, rtol=0, atol=1e-9 * np.abs(wanted).max()
    )


def test_sigma_and_the_band_cover_as_they_say() -> None:
    """1200 data sets of a curve within the space: spread of the fitted curve and mean of sigma
    squared.
    """
    x = np.linspace(0.0, 1.0, 15)
    space = SplineSpace(4, 0.0, 1.0, (0.5,))
    ends = (Constraint(0.0, 1, 0.0),)
    truth = fit(space, x, np.sin(3 * x), ends)
    generator = np.random.default_rng(np.random.SeedSequence(7))
    places = np.array([0.0, 0.3, 1.0])
    found = [
        fit(space, x, truth.values(x) + 0.1 * generator.standard_normal(15), ends)
        for _ in range(1200)
    ]
    curves = np.array([one.values(places) for one in found])
    np.testing.assert_allclose(curves.std(axis=0), 0.1 * truth.spread(places), rtol=0.08)
    assert np.mean([one.sigma**2 for one in found]) == pytest.approx(0.01, rel=0.05)


def test_features_share_value_and_slope_and_no_more() -> None:
    x, y = noisy(60, 0.0, 3.0)
    y += 3 * np.abs(x - 1.0) ** 2 * (x > 1.0)
    boundaries = (1.0, 2.5)
    space = SplineSpace(4, 0.0, 3.0, with_boundaries((0.4, 1.7), boundaries, 4))
    fitted = fit(space, x, y)
    polynomials = [np.polynomial.Polynomial(one) for one in pieces(fitted, local=False)]
    for boundary in boundaries:
        k = space.breaks.tolist().index(boundary)
        below, above = polynomials[k - 1 : k + 1]
        for derivative, largest in ((0, 1e-10), (1, 1e-9)):
            jump = above.deriv(derivative)(boundary) - below.deriv(derivative)(boundary)
            assert abs(jump) < largest
        assert abs(above.deriv(2)(boundary) - below.deriv(2)(boundary)) > 1.0
    # Three cubics with knots, less value and slope at each boundary.
    assert fitted.free == 3 * 4 + 2 - 4


def test_a_band_of_points_that_leaves_the_curve_open_is_named() -> None:
    x = np.array([0.0, 0.1, 0.2, 0.3, 0.9, 1.0])
    with pytest.raises(SplineError) as error:
        fit(SplineSpace(4, 0.0, 1.0, (0.35, 0.5, 0.6, 0.7, 0.8)), x, x)
    told = [problem.told(lambda place: f"{1e3 * place:g} mm") for problem in error.value.problems]
    assert told == [
        "the curve lacks 3 points between 350 mm and 1000 mm, where it has 2; leave out knots or"
        " prescribe more"
    ]
    with pytest.raises(SplineError, match="lacks 1 point between 0.5 and 1, where it has 1"):
        fit(SplineSpace(2, 0.0, 1.0, (0.5,)), np.array([0.0, 0.2, 0.5]), np.zeros(3))


def test_contradictions_are_told_and_repetitions_count_once() -> None:
    x, y = noisy(12, 0.0, 1.0)
    cubic, line = SplineSpace(4, 0.0, 1.0), SplineSpace(2, 0.0, 1.0)
    assert fit(cubic, x, y, (Constraint(0.0, 1, 0.5),) * 2).free == 3
    for space, told, conditions in (
        (cubic, "the slope at 0", [(0.0, 1, 0.5), (0.0, 1, 0.6)]),
        (line, r"the \w+ at [01]", [(0.0, 0, 0.0), (1.0, 0, 1.0), (0.0, 1, 2.0)]),
        (line, "the second derivative at 0", [(0.0, 2, 1.0)]),
    ):
        with pytest.raises(SplineError, match=f"^{told} contradicts what else is prescribed; "):
            fit(space, x, y, tuple(Constraint(*condition) for condition in conditions))


def test_nothing_is_extrapolated() -> None:
    x, y = noisy(12, 0.0, 1.0)
    fitted = fit(SplineSpace(4, 0.0, 1.0), x, y)
    for ask in (fitted.values, fitted.spread):
        with pytest.raises(SplineError, match="1.1 is outside the curve, from 0 to 1; it is not"):
            ask(np.array([0.5, 1.1]))


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((1, 0.0, 1.0), "order is at least 2"),
        ((4, 1.0, 1.0), "ends at 1, not above its start at 1"),
        ((4, 0.0, 1.0, (1.0, 0.5)), "the knot at 1 is not between.*out of order"),
        ((3, 0.0, 1.0, (0.5,) * 4), "is given 4 times; give it 3 times at most"),
    ],
)
def test_impossible_spaces_are_refused(arguments: tuple, text: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(SplineError, match=text):
        SplineSpace(*arguments)
