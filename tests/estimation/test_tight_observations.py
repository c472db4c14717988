"""What is known all but exactly beside what is known hardly: ranks that never fall, and
uncertainties to 60 digits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import mpmath
import numpy as np
import pytest
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.uncertainty.summaries import point_pairs
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from tests.reference import dense
from tests.reference.designs import altered, corner_sides, grid, plate_design, six_positions

Real = NDArray[np.float64]

DIGITS = 60
COEFFICIENTS = 3


@dataclass(frozen=True)
class Known:
    """One thing that is known: what kind, which ones, and its standard uncertainty in metres."""

    kind: str
    choice: int
    uncertainty: float


def design_of(positions: tuple[int, ...], certificate: str, repeatability: float = 2e-7) -> Design:
    """A plate of 3 x 3 balls in some of the six positions."""
    balls, six = grid(3), six_positions()
    design = plate_design(
        balls,
        [six[k] for k in positions],
        corner_sides(balls) if certificate == "sides" else (),
        {"all": range(9), "one": (4,)}.get(certificate, ()),
        position_coefficients=COEFFICIENTS,
        rotation_coefficients=COEFFICIENTS,
        repeatability=(repeatability,) * 3,
    )
    n = len(design.model.parameters)
    none, empty = np.zeros(0, np.int64), np.zeros(0)
    priors = Priors((), none, none, none, np.zeros((0, n)), empty, empty)
    return altered(
        design, priors=priors, evaluation={"points": np.random.default_rng(3).random((6, 3))}
    )


def with_known(design: Design, known: Known) -> Design:
    """The design with one thing more that is known."""
    draw, u = np.random.default_rng(known.choice), known.uncertainty
    if known.kind in ("coefficient", "combination"):
        reported = design.model.reported().matrix
        if known.kind == "coefficient":
            row = reported[draw.choice(np.flatnonzero(reported.any(axis=1)))]
        else:
            # Entries of many sizes, but none that is all but rounding beside another.
            row = draw.standard_normal(reported.shape[1]) * 10.0 ** draw.integers(
                -5, 1, reported.shape[1]
            )
        return _with_prior(design, -1, -1, row, u)
    if known.kind == "pose":
        free = np.argwhere(~design.positions.held)
        # Of what is held nothing can be known.
        position, component = free[draw.integers(len(free))].tolist() if len(free) else (-1, -1)
        return _with_prior(design, position, component, np.zeros(len(design.model.parameters)), u)
    if known.kind == "reading":
        readings = design.readings
        uncertainty = readings.uncertainty
        if uncertainty is None:
            uncertainty = np.tile(design.machine.repeatability, (len(readings), 1))
        uncertainty = uncertainty.copy()
        at = int(draw.integers(0, len(readings))), int(draw.integers(0, 3))
        uncertainty[at] = min(u, uncertainty[at])
        return replace(design, readings=replace(readings, uncertainty=uncertainty))
    if known.kind == "distance":
        first, second = draw.choice(9, 2, replace=False).tolist()
        old = design.of(CalibratedDistances)
        value = np.sqrt(((design.balls.places[first] - design.balls.places[second]) ** 2).sum())
        return design.observed(
            CalibratedDistances(
                np.append(old.first, first),
                np.append(old.second, second),
                np.append(old.dimensions, 3),
                np.append(old.value, value),
                np.append(old.uncertainty, u),
            )
        )
    ball, axis = int(draw.integers(0, 9)), int(draw.integers(0, 3))
    given = design.of(CalibratedCoordinates)
    return design.observed(
        CalibratedCoordinates(
            np.append(given.ball, ball),
            np.append(given.axis, axis),
            np.append(given.value, design.balls.places[ball, axis]),
            np.append(given.uncertainty, u),
        )
    )


def _with_prior(
    design: Design, position: int, component: int, row: Real, uncertainty: float
) -> Design:
    old = design.of(Priors)
    value = (
        design.positions.origins[position, component] if position >= 0 and component < 3 else 0.0
    )
    return design.observed(
        Priors(
            (*old.names, f"prior {len(old)}"),
            np.append(old.position, position),
            np.append(old.probe, -1),
            np.append(old.component, component),
            np.concatenate([old.by_model, row[None]]),
            np.append(old.value, value),
            np.append(old.uncertainty, uncertainty),
        )
    )


def unweighted(design: Design) -> tuple[dense.Problem, Real, Real]:
    """The dense reference's problem, its rows without their uncertainties, and these."""
    alike = altered(
        design,
        machine={"repeatability": np.ones(3)},
        distances=replace(
            design.of(CalibratedDistances), uncertainty=np.ones(len(design.of(CalibratedDistances)))
        ),
        coordinates=replace(
            design.of(CalibratedCoordinates),
            uncertainty=np.ones(len(design.of(CalibratedCoordinates))),
        ),
    )
    problem = dense.planned(alike, COEFFICIENTS, COEFFICIENTS)
    rows = dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)
    uncertainty = design.readings.uncertainty
    if uncertainty is None:
        uncertainty = np.tile(design.machine.repeatability, (len(design.readings), 1))
    priors = np.zeros((len(design.of(Priors)), problem.parameters))
    start = problem.parameters - len(problem.a)
    known = design.of(Priors)
    # The other program's coefficients are others of the same polynomials.
    ours, theirs, at = design.model.reported().matrix, np.zeros((0, len(problem.a))), 0
    for function in problem.functions:
        block = dense.monomial_matrix(function)
        wide = np.zeros((len(block), len(problem.a)))
        wide[:, at : at + function.free] = block
        theirs, at = np.concatenate([theirs, wide]), at + function.free
    priors[:, start:] = known.by_model @ np.linalg.pinv(ours) @ theirs
    for k in np.flatnonzero(known.position >= 0):
        pose = (int(known.position[k]), int(known.component[k]))
        if pose in problem.free_poses:
            priors[k, 3 * len(problem.plate_balls) + problem.free_poses.index(pose)] = 1.0
    stated = [
        uncertainty.ravel(),
        design.of(CalibratedDistances).uncertainty,
        design.of(CalibratedCoordinates).uncertainty,
        known.uncertainty,
    ]
    return problem, np.concatenate([rows, priors]), np.concatenate(stated)


def deficiency_of(rows: Real) -> int:
    """Rank deficiency of rows of about equal size, each divided by its own."""
    size = np.sqrt((rows**2).sum(axis=1))
    return dense.spread(rows[size > 0] / size[size > 0, None]).deficiency


KINDS = ["coefficient", "combination", "pose", "reading", "distance", "coordinate"]
things = st.builds(
    Known,
    st.sampled_from(KINDS),
    st.integers(0, 10**6),
    st.integers(-18, 0).map(lambda power: 10.0**power),
)


designs = st.tuples(
    st.lists(st.integers(0, 5), min_size=1, max_size=4, unique=True),
    st.sampled_from(["none", "sides", "one", "all"]),
    st.sampled_from([3e-9, 2e-7, 1e-3]),
)


@given(designs, st.lists(things, min_size=1, max_size=4))
@settings(max_examples=15, deadline=None)
def test_knowing_more_never_lowers_the_rank(
    what: tuple[list[int], str, float], more: list[Known]
) -> None:
    """Whatever is added, and however exact it is; the deficiency is that of the dense rows, too."""
    assert_never_lower(what, more)


@pytest.mark.long
@given(designs, st.lists(things, min_size=1, max_size=6))
@settings(max_examples=300, deadline=None)
def test_knowing_more_never_lowers_the_rank_of_many_designs(
    what: tuple[list[int], str, float], more: list[Known]
) -> None:
    assert_never_lower(what, more)


def assert_never_lower(what: tuple[list[int], str, float], more: list[Known]) -> None:
    positions, certificate, repeatability = what
    design = design_of(tuple(positions), certificate, repeatability)
    deficiency = linearise(design).deficiency
    for known in more:
        design = with_known(design, known)
        found = linearise(design).spectrum
        assert found.deficiency <= deficiency
        deficiency = found.deficiency
    assert deficiency == deficiency_of(unweighted(design)[1])


def exact_uncertainties(design: Design) -> dict[str, Real]:
    """U1 to U4 from normal equations in `DIGITS` digits; what is undetermined is held, which
    changes nothing else.
    """
    problem, rows, stated = unweighted(design)
    size = np.sqrt((rows**2).sum(axis=1))
    open_ = dense.spread(rows[size > 0] / size[size > 0, None]).null
    mpmath.mp.dps = DIGITS
    weights = np.array([1 / mpmath.mpf(u) for u in stated.tolist()])
    whole = np.concatenate([_exact(rows) * weights[:, None], _exact(open_.T) * mpmath.mpf(10) ** 6])
    root = _cholesky(whole.T @ whole)
    found = {}
    for symbol, function in dense.quantities(problem).items():
        if symbol in ("U5", "U6"):
            continue
        linear = dense.jacobian(function, problem.parameters)
        change = np.abs(linear @ open_).max(axis=1, initial=0.0)
        values = _solved(root, _exact(linear.T))
        squares = (values * values).sum(axis=0)
        exact = np.array([float(mpmath.sqrt(one)) for one in squares])
        found[symbol] = np.where(change > 1e-9 * np.abs(linear).max(axis=1), np.nan, exact)
    return found


def _exact(values: Real) -> Any:
    return np.array(
        [[mpmath.mpf(value) for value in row] for row in values.tolist()], object
    ).reshape(values.shape)


def _cholesky(matrix: Any) -> Any:
    """Lower triangular root."""
    left = matrix.copy()
    for k in range(len(left)):
        left[k:, k] /= mpmath.sqrt(left[k, k])
        for j in range(k + 1, len(left)):
            left[j:, j] -= left[j:, k] * left[j, k]
    return left


def _solved(root: Any, sides: Any) -> Any:
    found = sides.copy()
    for k in range(len(root)):
        found[k] /= root[k, k]
        found[k + 1 :] -= root[k + 1 :, k, None] * found[k]
    return found


TIGHT = [
    ("distances", (0, 1, 2, 4), "none", 2e-7, [Known("distance", k, 1e-14) for k in range(5)]),
    (
        "everything",
        (0, 1, 2, 4),
        "sides",
        2e-7,
        [Known(kind, 7, 10.0 ** -(9 + 2 * i)) for i, kind in enumerate(KINDS)],
    ),
]


@pytest.mark.parametrize(
    ("positions", "certificate", "repeatability", "more"),
    [
        pytest.param(*one[1:], id=one[0], marks=[pytest.mark.long] * (one[0] == "distances"))
        for one in TIGHT
    ],
)
def test_every_uncertainty_beside_what_is_known_all_but_exactly(
    positions: tuple[int, ...], certificate: str, repeatability: float, more: list[Known]
) -> None:
    design = design_of(positions, certificate, repeatability)
    for known in more:
        design = with_known(design, known)
    at = linearise(design)
    layout = at.layout
    expected = exact_uncertainties(design)
    reported = design.model.reported().matrix
    quoted = np.zeros((len(reported), len(layout)))
    quoted[:, layout.model] = reported
    found = {
        "U1": at.of_balls().ravel(),
        "U2": at.of_shared(np.eye(len(layout))[layout.poses]),
        "U3": at.of_shared(quoted[reported.any(axis=1)]),
        "U4": point_pairs(at)[0].ravel(),
    }
    for symbol, values in found.items():
        theirs = expected[symbol]
        np.testing.assert_array_equal(np.isnan(values), np.isnan(theirs))
        known_ = ~np.isnan(values)
        # What is known to 1e-15 m is a difference of what is known to 1e-6: its own digits are
        # beyond double precision.
        atol = 1e-14 * np.nanmax(theirs, initial=0.0)
        np.testing.assert_allclose(
            values[known_], theirs[known_], rtol=1e-9, atol=atol, err_msg=symbol
        )
