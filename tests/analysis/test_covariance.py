"""Covariances of what a fit gives: against dense algebra and finite differences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.results.estimates import EstimatedFunctions, correct, estimated_functions
from ballplate.results.fits import Fit
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.gauss_newton import moved
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.readings.simulated import exact_readings
from numpy.typing import NDArray

from tests.estimation.test_against_dense import (
    deficient_grid_of_four,
    grid_of_four,
    repeats,
    with_points,
)
from tests.estimation.test_priors_and_offsets import SPHERE, all_residuals, with_bar
from tests.reference import dense
from tests.reference.designs import altered

Real = NDArray[np.float64]

TASKS = """\
  tasks:
    - {name: along, from: [100 mm, 200 mm, 0 mm], to: [600 mm, 200 mm, 50 mm]}
    - {name: across, from: [0 mm, 300 mm, 400 mm], to: [900 mm, 400 mm, 450 mm], probes: [right, left]}
"""
BAR = "  bar: {kind: two_spheres, length: 400 mm, role: length_standard}\n"


def small(text: str) -> str:
    for old, new in (
        ("balls: [5, 5]", "balls: [3, 3]"),
        ("n_coefficients: 5", "n_coefficients: 3"),
    ):
        text = text.replace(old, new)
    text = text.replace("cal_coefficients: 5", "cal_coefficients: 3")
    return text.replace("  probe: down\n", "  probe: down\n" + TASKS)


def offsets_and_lengths(folder: Path) -> Design:
    """Unknown and uncertain offsets, a sphere, a certified bar, one whose length is not known, and
    two tasks.
    """
    text = with_bar(small(SPHERE)).replace(
        "artefacts:\n", "artefacts:\n" + BAR.replace("bar:", "other:")
    )
    place = (
        "{name: other, artefact: other, pose: {origin: [300 mm, 500 mm, 400 mm]}, probes: [left,"
        " back]}"
    )
    text = text.replace("positions:\n", f"positions:\n  - {place}\n")
    return design_of(folder, text)


def design_of(folder: Path, text: str, variant: str | None = None) -> Design:
    path = folder / "experiment.yaml"
    path.write_text(text, encoding="utf-8")
    return lay_out(bp.load(path, variant))


def assert_same(found: Real, expected: Real, tolerance: float) -> None:
    """Two covariances, each entry to a part of the standard uncertainties; NaN at the same
    places.
    """
    np.testing.assert_array_equal(np.isnan(found), np.isnan(expected))
    size = np.sqrt(np.nan_to_num(np.diag(expected)))
    off = np.nan_to_num(np.abs(found - expected))
    assert (off <= tolerance * np.outer(size, size)).all()


def covariance_of(jacobian: Real, spread: dense.Spread) -> Real:
    """Covariance of functions, with NaN for those that an undetermined direction changes."""
    root = np.where(np.isnan(spread.of(jacobian))[:, None], np.nan, jacobian @ spread.root)
    return np.asarray(root @ root.T)


@pytest.mark.parametrize(
    ("make", "coefficients", "deficiency"),
    [(grid_of_four, 5, 0), (repeats, 5, 0), (deficient_grid_of_four, 7, 6)],
)
def test_covariances_are_those_of_the_dense_reference(
    make: Callable[[], Design], coefficients: int, deficiency: int
) -> None:
    """Machine, poses, balls, tasks and corrected points together, of full rank and deficient."""
    design = with_points(make(), 6)
    ends = design.evaluation.points[:6].reshape(3, 2, 3)
    design = altered(
        design,
        tasks={
            "names": ("a", "b", "c"),
            "points": ends,
            "probes": np.full((3, 2), design.evaluation.probe),
            "targets": (None,) * 3,
        },
    )
    problem = dense.planned(design, coefficients, 5)
    reference = dense.linearised(problem)
    assert reference.deficiency == deficiency
    asked = dense.quantities(problem)

    def tasks(step: dense.Values) -> dense.Values:
        places = asked["U4"](step).reshape(-1, 3)
        return dense.length(places[1::2] - places[::2])

    parts = (asked["U3"], asked["U2"], asked["U1"], tasks)
    jacobian = np.concatenate([dense.jacobian(part, problem.parameters) for part in parts])
    at = linearise(design)
    found = estimated_functions(at, monomials=True)
    expected = covariance_of(jacobian, reference)
    assert np.isnan(expected).any() == bool(deficiency) and not np.isnan(expected).all()
    assert_same(found.covariance(), expected, 1e-6)

    points = dense.jacobian(asked["U4"], problem.parameters)
    corrected = correct(
        at,
        design.evaluation.points,
        np.full(len(design.evaluation.points), design.evaluation.probe),
        3.0,
    )
    of_points = 9.0 * covariance_of(points, reference)
    assert_same(corrected.covariance, of_points, 1e-6)
    for k, block in enumerate(corrected.blocks):
        assert_same(block, of_points[3 * k : 3 * k + 3, 3 * k : 3 * k + 3], 1e-6)
    np.testing.assert_allclose(
        corrected.standard_uncertainties.ravel() ** 2, np.diag(of_points), rtol=1e-6
    )


def by_differences(at: Linearisation) -> tuple[Real, Real]:
    """Derivatives of functions (m, s + balls) and of all residuals by all parameters, by central
    differences.
    """
    design, layout = at.design, at.layout
    _, x = exact_readings(
        replace(
            design, readings=replace(design.readings, repeats=np.ones_like(design.readings.ball))
        ),
        at.state,
    )
    count, d = len(layout), design.dimension

    def at_step(step: Real) -> State:
        balls = np.zeros(design.balls.places.shape)
        balls[design.plate_balls] = step[count:].reshape(-1, d)
        return moved(at.state, layout, step[:count], balls)

    def values(step: Real) -> Real:
        return estimated_functions(replace(at, state=at_step(step)), monomials=False).values

    def residuals(step: Real) -> Real:
        return all_residuals(design, at_step(step), x)

    sizes = np.append(np.minimum(layout.scale, 1.0), np.ones(d * len(design.plate_balls))) * 1e-4
    steps = list(zip(np.diag(sizes), sizes, strict=True))
    of_values, of_residuals = (
        np.stack([(function(s) - function(-s)) / (2 * h) for s, h in steps], axis=1)
        for function in (values, residuals)
    )
    return of_values, of_residuals


def assert_as_by_differences(design: Design, deficiency: int) -> EstimatedFunctions:
    at = linearise(design)
    of_values, of_residuals = by_differences(at)
    reference = dense.spread(of_residuals, exact=1e-8)
    assert at.deficiency == reference.deficiency == deficiency
    found = estimated_functions(at, monomials=False)
    assert_same(found.covariance(), covariance_of(of_values, reference), 1e-4)
    return found


def test_offsets_and_unknown_lengths_are_as_by_differences(tmp_path: Path) -> None:
    found = assert_as_by_differences(offsets_and_lengths(tmp_path), 0)
    kinds = [one.kind for one in found.functions]
    assert {kind: kinds.count(kind) for kind in ("offset", "length", "task", "ball")} == {
        "offset": 12,
        "length": 1,
        "task": 2,
        # The sphere is a ball as well.
        "ball": 30,
    }


@pytest.mark.parametrize(("variant", "deficiency"), [("any angles", 0), ("half a turn", 2)])
def test_two_dimensions_are_as_by_differences(
    tmp_path: Path, variant: str, deficiency: int
) -> None:
    text = Path("designs/hocken_borchardt/angles.yaml").read_text("utf-8")
    assert_as_by_differences(design_of(tmp_path, text, variant), deficiency)


@pytest.fixture(scope="module")
def fitted() -> Fit:
    experiment = bp.quickstart()
    return bp.fit(experiment, bp.simulate(experiment), monomials=True)


def test_a_frame_has_the_uncertainties_and_names_of_the_estimates(fitted: Fit) -> None:
    names = list(fitted.to_dict()["estimates"])
    found = fitted.covariance()
    assert list(found.index) == list(found.columns) == names
    stated = [one.standard_uncertainty for one in fitted.estimates]
    np.testing.assert_allclose(np.sqrt(np.diag(found)), stated, rtol=1e-9)
    assert fitted.sigma != 1.0
    by_kind = fitted.covariance("machine", "pose", "ball")
    assert by_kind.equals(found)
    machine = fitted.design.model.reported().names
    assert fitted.covariance("r1c2: x", "machine", "r1c2: x").shape == (1 + len(machine),) * 2
    some = ["r1c2: x", "x low: rotation y", "EXX t^2"]
    np.testing.assert_allclose(fitted.covariance(*some), found.loc[some, some], rtol=1e-12)


def test_correlations_are_between_minus_one_and_one(fitted: Fit) -> None:
    found, spread = fitted.correlation("machine", "ball"), fitted.covariance("machine", "ball")
    np.testing.assert_allclose(np.diag(found)[np.diag(spread) > 0], 1.0)
    assert (np.abs(found.to_numpy()[found.notna()]) <= 1.0 + 1e-12).all()
    one, other = "EXX t^1", "EXX t^2"
    expected = spread.loc[one, other] / np.sqrt(spread.loc[one, one] * spread.loc[other, other])
    assert found.loc[one, other] == pytest.approx(expected)


def test_corrected_points_have_the_errors_of_the_estimated_machine(fitted: Fit) -> None:
    points = fitted.design.evaluation.points[:5]
    found = fitted.correct(points)
    probes = np.full(5, fitted.design.evaluation.probe)
    offsets = fitted.design.probes.offsets[probes]
    np.testing.assert_allclose(
        found.points,
        points + fitted.design.model.error(points, fitted.solution.state.a, offsets),
        rtol=1e-15,
    )
    assert found.standard_uncertainties.max() <= fitted.quantities["U4"].maximum * (1.0 + 1e-9)
    names = [fitted.design.probes.names[k] for k in probes]
    np.testing.assert_array_equal(fitted.correct(points, names).covariance, found.covariance)
    turned = fitted.correct(points, ["left", "right", "left", "left", "left"])
    assert not np.allclose(turned.points, found.points, atol=1e-12)
    # A notebook shows one line, whatever the number of points.
    assert repr(found) == "<CorrectedPoints of 5 scale readings>"
    # The volume is a cube of one metre; up to its size beside it, points are extrapolated.
    assert np.isfinite(fitted.correct([[-0.999, 0.2, 1.999]]).covariance).all()


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda fit: fit.covariance("machines"), 'no estimate "machines"; did you mean "machine"'),
        (lambda fit: fit.correlation("r9c9: x"), 'no estimate "r9c9: x"'),
        (lambda fit: fit.correct([0.1, 0.2, 0.3]), r"points of shape \(3,\); expected \(n, 3\)"),
        (lambda fit: fit.correct([[0.1, 0.2]]), r"points of shape \(1, 2\)"),
        (
            lambda fit: fit.correct([[0.1, 0.2, 0.3], [0.1, 200.0, 300.0]]),
            r"y = 200 m of points\[1\] is far outside the volume; give points in metres",
        ),
        (
            lambda fit: fit.correct([[-1.001, 0.2, 0.3]]),
            r"x = -1.001 m of points\[0\] is far outside the volume",
        ),
    ],
)
def test_messages(fitted: Fit, call: Callable[[Fit], object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        call(fitted)


def test_a_fit_that_has_not_converged_has_no_covariance(fitted: Fit) -> None:
    failed = replace(fitted, solution=replace(fitted.solution, status="diverged"))
    with pytest.raises(ValueError, match="diverged"):
        failed.covariance("machine")
