"""Variance components against a dense restricted likelihood that is written out, closed forms, and
simulated readings.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pandas
import pytest
from ballplate.cli import main
from ballplate.extensions.judgement.components import (
    AS_STATED,
    LARGER,
    SMALLER,
    VarianceComponent,
    judged,
    told_apart,
)
from ballplate.extensions.judgement.observation_groups import (
    ObservationGroup,
    groups_of,
)
from ballplate.extensions.judgement.restricted_likelihood import (
    at_ratios,
    estimated_ratios,
    group_sums,
)
from ballplate.extensions.reliability.remainders import Leftover, leftover
from ballplate.results.groupings import GROUPINGS, Grouping
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.inputs.messages import ExperimentError
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import binomtest, chi2

from tests.extensions.judgement import wording
from tests.reference import dense
from tests.reference.small_quickstart import OF_ENTRIES, small_sections

Real = NDArray[np.float64]


@pytest.fixture(scope="module")
def small() -> bp.Experiment:
    return bp.quickstart().with_(OF_ENTRIES)


@pytest.fixture(scope="module")
def design(small: bp.Experiment) -> Design:
    return lay_out(small)


@pytest.fixture(scope="module")
def left(design: Design) -> Leftover:
    return leftover(linearise(design), None, 1)


def with_errors(left: Leftover, errors: Real) -> Leftover:
    """What the estimate leaves of whitened errors (n,)."""
    return replace(left, residual=left.of(errors[:, None])[:, 0])


def variances(groups: tuple[ObservationGroup, ...], ratios: Real, count: int) -> Real:
    """The variance of each whitened row."""
    found = np.ones(count)
    for group, ratio in zip(groups, ratios, strict=True):
        found[group.rows] = ratio
    return found


def dense_deviance(whole: Real, y: Real, v: Real) -> float:
    """Minus twice the restricted log-likelihood of y (n,) = whole x + errors of variances v (n,),
    as it is defined.
    """
    weighted = whole / v[:, None]
    information = weighted.T @ whole
    x = np.linalg.solve(information, weighted.T @ y)
    misfit = y - whole @ x
    determinant = np.linalg.slogdet(information)[1]
    return float(np.log(v).sum() + determinant + misfit @ (misfit / v))


def dense_jacobian(problem: dense.Problem) -> Real:
    """The Jacobian of all residuals, with columns of unit length."""
    whole = dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)
    return np.asarray(whole / np.sqrt((whole**2).sum(axis=0)))


@pytest.mark.parametrize("by", ["axis", "position", "probe"])
def test_estimates_minimise_the_dense_restricted_likelihood(
    by: Grouping, design: Design, left: Leftover
) -> None:
    groups = groups_of(design, by)
    n, g = len(left.residual), len(groups)
    assert sorted(np.concatenate([group.rows for group in groups])) == list(range(n))
    generator = np.random.default_rng(7)
    truth = variances(groups, np.exp(generator.normal(0.0, 0.7, g)), n)
    y = np.sqrt(truth) * generator.standard_normal(n)
    whole = dense_jacobian(dense.planned(design, 3, 3))

    def deviance(logarithms: Real) -> float:
        return dense_deviance(whole, y, variances(groups, np.exp(logarithms), n))

    sums = group_sums(with_errors(left, y), groups)
    # The likelihoods differ by a constant.
    one, other = np.zeros(g), generator.normal(0.0, 0.5, g)
    expected = deviance(other) - deviance(one)
    found = at_ratios(sums, np.exp(other)).deviance - at_ratios(sums, np.exp(one)).deviance
    assert found == pytest.approx(expected, abs=1e-6)
    ratios = estimated_ratios(sums, np.arange(g))
    best = minimize(deviance, np.zeros(g), method="BFGS", options={"gtol": 1e-5})
    np.testing.assert_allclose(np.log(ratios), best.x, atol=2e-4)


def test_the_information_is_that_of_the_dense_projector(design: Design, left: Leftover) -> None:
    groups = groups_of(design, "position")
    n = len(left.residual)
    ratios = np.exp(np.random.default_rng(3).normal(0.0, 0.5, len(groups)))
    weight = 1.0 / np.sqrt(variances(groups, ratios, n))
    whole = weight[:, None] * dense_jacobian(dense.planned(design, 3, 3))
    q, _ = np.linalg.qr(whole)
    projector = np.eye(n) - q @ q.T
    at = at_ratios(group_sums(with_errors(left, np.ones(n)), groups), ratios)
    for i, one in enumerate(groups):
        assert at.redundancies[i] == pytest.approx(np.trace(projector[np.ix_(one.rows, one.rows)]))
        square = ((projector @ (weight * 1.0))[one.rows] ** 2).sum()
        assert at.squares[i] == pytest.approx(square, rel=1e-7)
        for j, other in enumerate(groups):
            expected = (projector[np.ix_(one.rows, other.rows)] ** 2).sum()
            assert at.information[i, j] == pytest.approx(expected, rel=1e-7, abs=1e-9)


def components(left: Leftover, groups: tuple[ObservationGroup, ...]) -> list[VarianceComponent]:
    return judged(told_apart(group_sums(left, groups), groups))


def test_of_one_group_the_interval_is_that_of_chi_squared(left: Leftover) -> None:
    n = len(left.residual)
    some = with_errors(left, 1.3 * np.random.default_rng(5).standard_normal(n))
    (found,) = components(some, (ObservationGroup("everything", np.arange(n)),))
    freedom = n - 90
    square = some.sum_of_squares
    assert found.redundancy == pytest.approx(freedom)
    assert found.ratio == pytest.approx(square / freedom)
    assert found.standard_uncertainty == pytest.approx(found.ratio * np.sqrt(2.0 / freedom))
    ends = square / chi2.ppf([0.975, 0.025], freedom)
    assert (found.lower, found.upper) == pytest.approx(tuple(ends), rel=1e-5)
    assert found.verdict == LARGER
    (smaller,) = components(
        replace(some, residual=0.5 * some.residual), (ObservationGroup("", np.arange(n)),)
    )
    assert smaller.verdict == SMALLER


def test_what_leaves_no_residual_is_not_estimated(small: bp.Experiment) -> None:
    """Distances of one length more than the frame needs have no redundancy."""
    one = small.with_(
        calibration=[
            {"kind": "distances", "pairs": [["r1c1", "r1c3"]], "standard_uncertainty": "0.2 um"}
        ]
    )
    design = lay_out(one)
    every = components(
        with_errors(leftover(linearise(design), None, 1), np.ones(3 * 90 + 1)),
        groups_of(design, "calibration"),
    )
    assert [found.verdict for found in every][1] == wording.CANNOT_BE_ESTIMATED
    assert np.isnan([every[1].ratio, every[1].lower, every[1].upper]).all()
    assert not np.isnan(every[0].ratio)


def test_groups_that_nothing_tells_apart_are_not_estimated(small: bp.Experiment) -> None:
    """A displacement for each reading is the same as its noise."""
    each = {"each": ["position", "ball", "probe"], "standard_uncertainty": "0.2 um"}
    same = small.with_(influences=[{"kind": "reproducibility", **each}])
    fit = bp.fit(same, bp.simulate(same), components="calibration")
    assert fit.variance_components is not None
    verdicts = {one.name: one.verdict for one in fit.variance_components.groups}
    assert (
        verdicts["displacements by position and ball and probe"]
        == wording.CANNOT_BE_TOLD_FROM_READINGS
    )
    assert verdicts["readings"] == AS_STATED


def tallied(
    left: Leftover, groups: tuple[ObservationGroup, ...], ratios: Real, count: int
) -> tuple[Real, Real, int]:
    """Estimates (count, g) over true ratios, shares of intervals that hold these (g,), and the
    number of tables with a verdict other than agreement.
    """
    n, generator = len(left.residual), np.random.default_rng(11)
    spread = np.sqrt(variances(groups, ratios, n))
    found, inside, alarms = [], np.zeros(len(groups)), 0
    for _ in range(count):
        every = components(with_errors(left, spread * generator.standard_normal(n)), groups)
        found.append([one.ratio for one in every])
        inside += [one.lower <= r <= one.upper for one, r in zip(every, ratios, strict=True)]
        alarms += any(one.verdict != AS_STATED for one in every)
    return np.array(found) / ratios, inside / count, alarms


def ensure_tallied(
    left: Leftover, groups: tuple[ObservationGroup, ...], ratios: Real, count: int
) -> None:
    found, inside, alarms = tallied(left, groups, ratios, count)
    off = np.abs(found.mean(axis=0) - 1.0)
    assert (off < 4.0 * found.std(axis=0) / np.sqrt(count)).all()
    assert (np.abs(inside - 0.95) < 4.0 * np.sqrt(0.95 * 0.05 / count)).all()
    if (ratios == 1.0).all():
        assert binomtest(alarms, count, 0.05).pvalue > 1e-4


def test_intervals_hold_the_truth_and_alarms_are_as_rare_as_stated(
    design: Design, left: Leftover
) -> None:
    ensure_tallied(left, groups_of(design, "calibration"), np.ones(2), 80)


@pytest.mark.long
@pytest.mark.parametrize(
    ("by", "ratios"),
    [("axis", [1, 1, 1, 1]), ("axis", [4, 1, 0.25, 1]), ("position", [1, 1, 1, 4, 1, 0.25, 2])],
)
def test_they_do_so_in_many_fits(
    by: Grouping, ratios: list[float], design: Design, left: Leftover
) -> None:
    ensure_tallied(left, groups_of(design, by), np.array(ratios, float), 2000)


@pytest.fixture(scope="module")
def noisy(small: bp.Experiment) -> pandas.DataFrame:
    """Readings that scatter 2.5 times as much along z as stated."""
    return bp.simulate(small.with_({"machine.repeatability": ["0.2 um", "0.2 um", "0.5 um"]}))


def test_a_fit_names_the_axis_that_scatters_more(
    small: bp.Experiment, noisy: pandas.DataFrame
) -> None:
    fit = bp.fit(small, noisy)
    found = {one.name: one for one in fit.components("axis").groups}
    assert [one.name for one in found.values() if one.verdict == LARGER] == ["readings along z"]
    assert found["readings along z"].lower < 6.25 < found["readings along z"].upper
    assert sum(one.redundancy for one in found.values()) == pytest.approx(fit.degrees_of_freedom)
    assert {one.by for one in map(fit.components, GROUPINGS)} == set(GROUPINGS)


def test_co_ordinates_of_holes_that_are_not_read_are_in_no_group(small: bp.Experiment) -> None:
    holes = small.with_({"artefacts.plate.reads": "in plane", "artefacts.plate.flatness": "1 um"})
    fit = bp.fit(holes, bp.simulate(holes))
    for by in GROUPINGS:
        groups = fit.components(by).groups
        assert sum(one.redundancy for one in groups) == pytest.approx(fit.degrees_of_freedom)
        assert sum(one.observations for one in groups) == fit.design.observation_count


def test_a_fit_has_the_estimates_of_the_dense_likelihood(
    small: bp.Experiment, design: Design, noisy: pandas.DataFrame
) -> None:
    fit = bp.fit(small, noisy, components="axis")
    assert fit.variance_components is not None
    problem = replace(
        dense.planned(fit.design, 3, 3), scales=noisy[["x_mm", "y_mm", "z_mm"]].to_numpy() / 1e3
    )
    y, whole = dense.residuals(problem, np.zeros(problem.parameters)), dense_jacobian(problem)
    groups = groups_of(fit.design, "axis")

    def deviance(logarithms: Real) -> float:
        return dense_deviance(whole, y, variances(groups, np.exp(logarithms), len(y)))

    best = minimize(deviance, np.zeros(4), method="BFGS", options={"gtol": 1e-4})
    ratios = [one.ratio for one in fit.variance_components.groups]
    np.testing.assert_allclose(np.log(ratios), best.x, atol=2e-3)


def test_the_command_prints_and_writes_them(
    tmp_path: Path,
    noisy: pandas.DataFrame,
    small: bp.Experiment,
    capsys: pytest.CaptureFixture[str],
    write: Callable[[bp.Experiment], Path],
) -> None:
    path, readings = write(small), tmp_path / "readings.csv"
    noisy.to_csv(readings, index=False)
    command = ["fit", str(path), str(readings), "--components", "axis"]
    assert main([*command, "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    expected = bp.fit(small, noisy, components="axis").variance_components
    assert expected is not None
    assert found["variance_components"] == json.loads(json.dumps(expected.to_dict()))
    assert main(command) == 0
    text = capsys.readouterr().out
    assert "readings along z" in text
    assert "larger than stated" in text
    assert expected.to_frame()["group"].tolist()[2] == "readings along z"
    assert wording.LARGER_THAN_STATED in repr(expected)


@pytest.fixture
def write(tmp_path: Path) -> Callable[[bp.Experiment], Path]:
    """Write an experiment, or what is like the small one, to a file."""
    import yaml

    def written(_: bp.Experiment) -> Path:
        told = small_sections(20, true_machine={"kind": "zero"})
        path = tmp_path / "quickstart.yaml"
        path.write_text(yaml.safe_dump(told), encoding="utf-8")
        return path

    return written


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"components": "balls"}, '"balls" is unknown'),
        (
            {"components": "axis", "estimator": "distances"},
            "components applies to the estimator full",
        ),
    ],
)
def test_what_does_not_go_together_is_refused(
    arguments: dict[str, Any], text: str, small: bp.Experiment, noisy: pandas.DataFrame
) -> None:
    with pytest.raises(ValueError, match=text):
        bp.fit(small, noisy, **arguments)


def test_too_many_groups_are_refused(
    small: bp.Experiment, noisy: pandas.DataFrame, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ballplate.extensions.judgement.components.MOST_ENTRIES", 1000)
    with pytest.raises(ExperimentError, match=wording.GROUPS_OF_OBSERVATIONS_OF_PARAMETERS):
        bp.fit(small, noisy, components="axis")
