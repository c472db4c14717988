"""U2, U3 and U5 as NPL Report CISE 15/98 tabulates them, against their definitions computed
densely.
"""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.extensions.reproduction.published_quantities import tabulated_quantities
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load

from tests.reference import dense


@pytest.fixture(scope="module")
def computed():  # type: ignore[no-untyped-def]
    experiment = next(one for one in load("designs/npl/6.2.1.yaml") if one.name == "n=4 NDEL=5")
    design = lay_out(experiment)
    problem = dense.planned(design, 5, 5)
    return tabulated_quantities(design), problem, dense.linearised(problem)


def spread_of(function, problem, found):  # type: ignore[no-untyped-def]
    return found.of(dense.jacobian(function, problem.parameters))


def test_transformations_turn_about_the_machine_origin(computed) -> None:  # type: ignore[no-untyped-def]
    """T(y) = R (y - c): c is what the pose's origin o = -R c stands for."""
    quantities, problem, found = computed
    free = sorted({k for k, _ in problem.free_poses})

    def centres(step):  # type: ignore[no-untyped-def]
        _, rotations, origins, _ = dense.unpack(problem, step)
        return np.concatenate([-rotations[k].T @ origins[k] for k in free])

    def turns(step):  # type: ignore[no-untyped-def]
        balls = 3 * len(problem.plate_balls)
        return np.array([step[balls + i] for i, (_, j) in enumerate(problem.free_poses) if j >= 3])

    values = np.concatenate([spread_of(function, problem, found) for function in (centres, turns)])
    assert len(values) == 30 == quantities["U2"].count
    assert quantities["U2"].maximum == pytest.approx(values.max(), rel=1e-9)
    assert quantities["U2"].average == pytest.approx(values.mean(), rel=1e-9)


def test_coefficients_of_positional_errors(computed) -> None:  # type: ignore[no-untyped-def]
    """They are those of t, t - t^2, t^2 - t^3, ..., and of monomials for rotations."""
    quantities, problem, found = computed
    monomials = dense.jacobian(dense.quantities(problem)["U3"], problem.parameters)
    rows, start = [], 0
    for function in problem.functions:
        count = function.coefficients - 1
        own = monomials[start : start + count]
        start += count
        if not function.turns:
            # Columns are the basis by monomials.
            basis = np.diag([1.0, *[-1.0] * (count - 1)]) + np.eye(count, k=1)
            own = np.linalg.solve(basis, own)
            if function.zero_at_one:
                assert np.abs(own[0]).max() < 1e-12 * np.abs(own).max()
                own = own[1:]
        rows.append(own)
    values = found.of(np.concatenate(rows))
    assert len(values) == 69 == quantities["U3"].count
    assert quantities["U3"].maximum == pytest.approx(values.max(), rel=1e-9)
    assert quantities["U3"].average == pytest.approx(values.mean(), rel=1e-9)


def test_distances_from_the_first_ball(computed) -> None:  # type: ignore[no-untyped-def]
    quantities, problem, found = computed

    def distances(step):  # type: ignore[no-untyped-def]
        balls = dense.unpack(problem, step)[0]
        return dense.length(balls[1:] - balls[0])

    values = spread_of(distances, problem, found)
    assert len(values) == 15 == quantities["U5"].count
    assert quantities["U5"].maximum == pytest.approx(values.max(), rel=1e-9)
    assert quantities["U5"].average == pytest.approx(values.mean(), rel=1e-9)
    assert quantities["U5"].largest.startswith("ball r1c1 to ball ")


def test_what_is_undetermined_is_counted() -> None:
    experiment = next(one for one in load("designs/npl/6.2.1.yaml") if one.name == "n=4 NDEL=7")
    found = tabulated_quantities(lay_out(experiment))
    # Six directions change functions of Z, which have six coefficients each, and the plate does not
    # deform.
    assert found["U3"].undetermined > 0 and np.isnan(found["U3"].average)
    assert found["U5"].undetermined == 0
