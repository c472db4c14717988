"""Adjustments of a machine: what a map predicts, against exact geometry, and what a second campaign
says of it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.certificates.certificate_files import with_drawn_values
from ballplate.extensions.maps.adjusted_machine import (
    AdjustedMachine,
    adjusted_machine,
    adjusted_map,
)
from ballplate.extensions.maps.machine_changes import (
    MachineChange,
    guideway_turn,
    scale_change,
)
from ballplate.results.estimates import estimated_functions
from ballplate.results.map_of_fit import map_of
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.machines.spatial_metric import SpatialMetricModel
from ballplate.simulator.maps.fit_verdict import LackOfFit
from ballplate.simulator.maps.fitted_map import FittedMap
from ballplate.simulator.readings.observed_readings import observe
from ballplate.simulator.readings.simulated import simulated_readings
from numpy.typing import NDArray
from scipy.stats import binom, chi2

from tests.extensions.certificates.campaigns import IN_PLANE, IN_SPACE
from tests.extensions.maps import wording
from tests.maps.kinds import fit_of, write_files

Real = NDArray[np.float64]
NAMES = ("scale x", "scale y", "scale z", "C0Y", "B0Z", "A0Z")
TRUE = np.array([12e-6, -8e-6, 15e-6, 20e-6, -25e-6, 10e-6])
# Sixteen turns of the same guideways: their order in `machine_lines` and in the fit's adjustments.
FIGURES = ("scale x", "scale y", "scale z", "angle xy", "angle xz", "angle yz")


def experiment_of(true: Real, sigma: str = "given") -> bp.Experiment:
    """A plate in seven positions on a machine of straight axes with errors that are known."""
    values = {
        name: f"{1e6 * value!r} {'ppm' if k < 3 else 'urad'}"
        for k, (name, value) in enumerate(zip(NAMES, true.tolist(), strict=True))
    }
    return bp.experiment(
        {
            **IN_SPACE,
            "error_model": {"kind": "metric"},
            "true_machine": {"kind": "coefficients", "values": values},
            "sigma": sigma,
        }
    )


def campaign(true: Real, seed: int) -> Any:
    """A fit of one campaign: readings, and a certificate that belongs to them."""
    experiment = experiment_of(true)
    certificate = bp.certificate(experiment, seed)
    return bp.fit(experiment, bp.simulate(experiment, seed), certificate=certificate)


def map_of_campaign(true: Real, seed: int) -> FittedMap:
    """The map of such a campaign, without what a fit says of gross errors."""
    experiment = experiment_of(true)
    simulated = simulated_readings(experiment, seed, False)
    certified = with_drawn_values(experiment, simulated)
    observed = observe(lay_out(certified), simulated.readings, simulated.x)
    at = linearised_fit(observed.design, estimate(observed.design, observed.x))
    freedom = observed.design.observation_count - observed.design.parameter_count
    fit = SimpleNamespace(
        label="",
        experiment=certified,
        observed=observed,
        sigma=1.0,
        sigma_is_estimated=False,
        degrees_of_freedom=freedom,
        sum_of_squares=at.factor.sum_of_squares,
        lack_of_fit=LackOfFit(at.factor.sum_of_squares, 0),
        assumptions=None,
        estimates=(),
        functions=estimated_functions(at, False),
    )
    return map_of(fit)  # type: ignore[arg-type]


def test_maps_are_those_of_fits() -> None:
    one, two = campaign(TRUE, 5).to_map(), map_of_campaign(TRUE, 5)
    assert np.abs(one.values - two.values).max() < 1e-12
    assert np.abs(one.covariance - two.covariance).max() < 1e-6 * np.abs(one.covariance).max()


def told_of(fitted: FittedMap) -> dict[str, float]:
    """Scale errors, and what angles exceed 90 degrees by, of a map."""
    return dict(zip(FIGURES, figures(fitted.values).tolist(), strict=True))


def turned_axes(true: Real, changes: list[MachineChange]) -> Real:
    """Errors of the machine after changes, by what its axes then do: M times the readings is where
    the tip is, and M'M tells scales and angles (US 4,437,151, equations (102) to (107)).
    """
    m = SpatialMetricModel(True, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)).axes(true)
    for change in changes:
        m = m.copy()
        if change.towards is None:
            # It reads more by a share for the same way.
            m[:, change.axis] /= 1.0 + change.amount
        else:
            size = np.linalg.norm(m[:, change.axis])
            other = m[:, change.towards] / np.linalg.norm(m[:, change.towards])
            along = m[:, change.axis] / size
            across = other - (other @ along) * along
            across /= np.linalg.norm(across)
            m[:, change.axis] = size * (
                np.cos(change.amount) * along + np.sin(change.amount) * across
            )
    size = np.sqrt((m**2).sum(axis=0))
    g = m.T @ m / np.outer(size, size)
    return np.array([*(size - 1.0), -np.arcsin(g[0, 1]), np.arcsin(g[0, 2]), -np.arcsin(g[1, 2])])


def figures(errors: Real) -> Real:
    """Scale errors, and what angles exceed 90 degrees by, of the errors of a metric."""
    return errors * np.array([1.0, 1.0, 1.0, 1.0, -1.0, 1.0])


CHANGES = [
    scale_change("x=20 um/m"),
    scale_change("z=-5 ppm"),
    guideway_turn("y-x=6 arcsec"),
    guideway_turn("z+x=0.02 turns of 1 mm at 800 mm"),
    guideway_turn("z-y=3 arcsec"),
]


def values_of(lines: Any) -> Real:
    return np.array([one.value for one in lines[: len(FIGURES)]])


def test_prediction_is_that_of_the_geometry() -> None:
    fit = campaign(TRUE, 1)
    found = adjusted_machine("", fit.to_map(), CHANGES)
    assert tuple(one.name for one in found.lines_of_machine[:6]) == FIGURES
    expected = figures(turned_axes(fit.to_map().values, CHANGES))
    assert np.abs(values_of(found.predicted) - expected).max() < 5e-9
    # One change at a time, to what is first order in it.
    for change in CHANGES:
        one = adjusted_machine("", fit.to_map(), [change])
        moved = values_of(one.predicted) - values_of(one.before)
        told = figures(turned_axes(fit.to_map().values, [change])) - figures(fit.to_map().values)
        assert np.abs(moved - told).max() < 5e-9


def test_turns_of_the_first_guideway_are_those_of_the_second() -> None:
    fitted = campaign(TRUE, 1).to_map()
    one, two = (
        values_of(adjusted_machine("", fitted, [guideway_turn(text)]).predicted)
        for text in ("y-x=6 arcsec", "x-y=6 arcsec")
    )
    assert np.abs(one - two).max() < 5e-9


def test_figures_are_those_that_fit_reports(tmp_path: Path) -> None:
    write_files(tmp_path)
    for kind in ("spatial metric", "listed axes", "estimated probe"):
        fit = fit_of(kind, tmp_path)
        fitted = fit.to_map()
        found = adjusted_machine("", fitted, [scale_change("x=1 ppm")])
        by_name = dict(zip([one.name for one in found.lines_of_machine], found.before, strict=True))
        for one in fit.adjustments:
            if one.name not in by_name:
                continue
            own = by_name[one.name]
            assert own.value == pytest.approx(one.value, rel=1e-6, abs=1e-12, nan_ok=True)
            u = one.standard_uncertainty
            assert own.standard_uncertainty == pytest.approx(u, rel=1e-6, nan_ok=True)


def test_what_is_told_to_be_adjusted_leaves_nothing() -> None:
    fit = campaign(TRUE, 2)
    told = {one.name: one.value for one in fit.adjustments}
    changes = [MachineChange(k, told[f"scale {axis}"]) for k, axis in enumerate("xyz")]
    # An angle above 90 degrees is closed by a turn of the second guideway towards the first.
    pairs = (("angle xy", 1, 0), ("angle xz", 2, 0), ("angle yz", 2, 1))
    changes += [MachineChange(axis, told[name], to) for name, axis, to in pairs]
    found = adjusted_machine("", fit.to_map(), changes)
    assert np.abs(values_of(found.predicted)).max() < 5e-9 < np.abs(values_of(found.before)).min()
    u = [one.standard_uncertainty for one in found.predicted]
    assert u == pytest.approx([one.standard_uncertainty for one in found.before], rel=1e-4)


@pytest.mark.parametrize("kind", ["spatial metric", "kinematic", "plane", "estimated probe"])
def test_diagonals_are_those_of_corrected_points(kind: str, tmp_path: Path) -> None:
    write_files(tmp_path)
    fit = fit_of(kind, tmp_path)
    fitted = fit.to_map()
    found = bp.adjust(fitted, "x=10 ppm")
    lower, upper = map(np.array, fitted.volume.corners)
    for one, before in zip(found.lines_of_machine, found.before, strict=True):
        if one.unit != "m":
            continue
        ups = np.array([sign == "+" for sign in one.name.removeprefix("diagonal ")])
        ends = np.array([np.where(ups, lower, upper), np.where(ups, upper, lower)])
        points = fit.correct(ends, fitted.probe)
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        weights = np.concatenate([-along, along])
        if np.isnan(points.covariance).any():
            assert np.isnan(before.value) and np.isnan(before.standard_uncertainty)
            continue
        value = float(weights @ (points.points - ends).ravel())
        u = float(np.sqrt(weights @ points.covariance @ weights))
        assert before.value == pytest.approx(value, rel=1e-6, abs=1e-12)
        # The root of a map's covariance has lost digits of what is nearly known.
        assert before.standard_uncertainty == pytest.approx(u, rel=1e-4, abs=1e-12)


def test_uncertain_changes_add_to_the_uncertainty() -> None:
    fitted = campaign(TRUE, 1).to_map()
    exact, rough = (bp.adjust(fitted, "x=40 um/m", share=share) for share in (0.0, 0.05))
    u, more = (one.predicted[0].standard_uncertainty for one in (exact, rough))
    assert more == pytest.approx(np.hypot(u, 0.05 * 40e-6), rel=1e-6)
    assert rough.predicted[1].standard_uncertainty == pytest.approx(
        exact.predicted[1].standard_uncertainty, rel=1e-6
    )


def test_predicted_map_is_a_map(tmp_path: Path) -> None:
    fitted = campaign(TRUE, 1).to_map()
    found = bp.adjust(fitted, "x=20 um/m", ["y-x=6 arcsec", "z-y=3 arcsec"])
    for name in ("after.yaml",):
        bp.write_map(found.predicted_map, tmp_path / name)
        again = adjusted_machine("", bp.load_map(tmp_path / name), [scale_change("x=0 ppm")])
        assert np.abs(values_of(again.before) - values_of(found.predicted)).max() < 1e-15


@cache
def compared(seed: int, slip: float = 0.0) -> AdjustedMachine:
    """A machine with errors of its own, inspected, adjusted by what that tells, and inspected
    again; one turn slips by some of it.
    """
    drawn = np.random.default_rng([17, seed]).normal(0.0, 20e-6, 6)
    first = map_of_campaign(drawn, 2 * seed + 1)
    told = told_of(first)
    changes = [MachineChange(k, float(f"{told[f'scale {a}']:.2g}")) for k, a in enumerate("xyz")]
    for name, axis, to in (("angle xy", 1, 0), ("angle xz", 2, 0), ("angle yz", 2, 1)):
        changes.append(MachineChange(axis, float(f"{told[name]:.2g}"), to))
    made = [*changes[:3], replace(changes[3], amount=changes[3].amount + slip), *changes[4:]]
    second = map_of_campaign(turned_axes(drawn, made), 2 * seed + 2)
    return adjusted_machine("", first, changes, second)


def within(trials: int) -> tuple[list[int], int]:
    """How many of so many pairs of campaigns have |E_n| up to 1, by figure; and as predicted."""
    errors = np.array([compared(seed).normalised_errors for seed in range(trials)])
    verdicts = [compared(seed).is_within for seed in range(trials)]
    return (np.abs(errors) <= 1.0).sum(axis=0).tolist(), sum(map(bool, verdicts))


def check_share(count: int, trials: int, share: float) -> None:
    low, high = binom.ppf([1e-5, 1 - 1e-5], trials, share)
    assert low <= count <= high, (count, trials, share)


def test_second_campaigns_agree_as_often_as_they_should() -> None:
    trials = 12
    by_figure, as_predicted = within(trials)
    for count in by_figure:
        check_share(count, trials, float(chi2.cdf(4.0, 1)))
    check_share(as_predicted, trials, 0.95)
    # Not whenever one of ten is above 1.
    verdicts = [compared(seed).is_within for seed in range(trials)]
    errors = np.array([compared(seed).normalised_errors for seed in range(trials)])
    assert ((np.abs(errors) > 1.0).any(axis=1) & np.array(verdicts)).any()


@pytest.mark.long
def test_a_thousand_second_campaigns_agree_as_often_as_they_should() -> None:
    trials = 1000
    by_figure, as_predicted = within(trials)
    for count in by_figure:
        check_share(count, trials, float(chi2.cdf(4.0, 1)))
    check_share(as_predicted, trials, 0.95)


def test_a_screw_that_slipped_is_found() -> None:
    found = compared(0, 30e-6)
    k = FIGURES.index("angle xy")
    assert abs(found.normalised_errors[k]) > 1.0
    assert found.is_within is False and "not as predicted" in found.headline()
    assert found.normalised_errors[k] == pytest.approx(
        (found.found[k].value - found.predicted[k].value)  # type: ignore[index]
        / 2.0
        / np.hypot(found.found[k].standard_uncertainty, found.predicted[k].standard_uncertainty)  # type: ignore[index]
    )


def test_the_verdict_is_of_the_weighted_sum_of_squares() -> None:
    found, other = compared(0), map_of_campaign(TRUE, 77)
    again = adjusted_machine("", found.predicted_map, [scale_change("x=0 ppm")], other)
    # The same sum by parameters: a metric's are its scales and angles.
    both = [found.predicted_map, other]
    apart = both[1].values - both[0].values
    covariance = both[0].covariance + both[1].covariance
    square = float(apart @ np.linalg.solve(covariance, apart))
    assert again.difference is not None
    test = again.difference.comparison.test
    assert test is not None and test.dimensions == 6
    assert test.statistic == pytest.approx(square, rel=1e-3)
    assert test.p == pytest.approx(chi2.sf(test.statistic, 6), rel=1e-6)
    assert again.is_within is (test.p >= 0.05)
    assert [row["quantity"] for row in found.rows()][:6] == list(FIGURES)
    assert again.to_dict()["difference"] == again.difference.to_dict()


def test_undetermined_figures_are_told_and_left_out() -> None:
    level = {**IN_SPACE, "error_model": {"kind": "metric"}, "positions": IN_SPACE["positions"][:2]}
    experiment = bp.experiment(level)
    first, second = (bp.fit(experiment, bp.simulate(experiment, k)).to_map() for k in (1, 2))
    found = bp.adjust(first, "z=10 ppm", after=second)
    k = FIGURES.index("scale z")
    assert np.isnan(found.predicted[k].value) and np.isnan(found.normalised_errors[k])
    line = next(one for one in found.lines() if one.startswith("scale z"))
    assert line.split().count("undetermined") == 6 and line.split()[-2] == "-"
    assert found.to_dict()["quantities"]["scale z"]["predicted"]["value"] is None
    assert np.isfinite(found.normalised_errors).any() and found.is_within is not None


def test_a_model_without_an_error_cannot_follow_its_change(tmp_path: Path) -> None:
    write_files(tmp_path)
    # The mean of the scales of this model is what it is.
    with pytest.raises(ValueError, match=wording.MADE_TO_READ_CANNOT_FOLLOW):
        bp.adjust(fit_of("metric", tmp_path).to_map(), "x=10 ppm")
    both = bp.adjust(fit_of("metric", tmp_path).to_map(), turn="y+x=3 urad")
    assert both.predicted[2].value - both.before[2].value == pytest.approx(-3e-6, rel=1e-4)
    with pytest.raises(ValueError, match=wording.HAS_THE_AXES):
        bp.adjust(fit_of("plane", tmp_path).to_map(), "z=10 ppm")


def test_other_volumes_are_not_compared(tmp_path: Path) -> None:
    write_files(tmp_path)
    fitted = campaign(TRUE, 1).to_map()
    flat = fit_of("plane", tmp_path).to_map()
    with pytest.raises(ValueError, match="another volume"):
        bp.adjust(fitted, "x=10 ppm", after=flat)
    assert IN_PLANE["machine"]["volume"] != IN_SPACE["machine"]["volume"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x", "no change of a scale"),
        ("w=3 ppm", "no change of a scale"),
        ("x=3 um", "a ratio is expected"),
        ("x=10 %", "more than 5 %"),
    ],
)
def test_wrong_scale_changes_are_told(text: str, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        scale_change(text)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("y=3 arcsec", "no turn of a guideway"),
        ("y-y=3 arcsec", "no turn of a guideway"),
        ("y-x=3 ppm", "an angle is expected"),
        ("y-x=10 deg", "more than 5 %"),
        ("y-x=1 turn of 1 mm at 0 mm", "no arm of a screw"),
        ("y-x=. turns of 1 mm at 100 mm", "could not convert|number"),
        ("y-x=1 turn of 1 at 100 mm", "unit"),
    ],
)
def test_wrong_turns_are_told(text: str, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        guideway_turn(text)


def test_a_machine_that_is_exactly_known_differs_or_not(tmp_path: Path) -> None:
    fitted = campaign(TRUE, 1).to_map()
    known: FittedMap = replace(fitted, covariance=0.0 * fitted.covariance, data=None)
    same = adjusted_machine(
        "", known, [scale_change("x=5 ppm")], adjusted_map(known, [scale_change("x=5 ppm")])
    )
    assert np.isnan(same.normalised_errors).all() and same.is_within is None
    assert "undetermined" not in "".join(same.lines()[1:-1])
    assert same.headline() == wording.NOTHING_THAT_IS_DETERMINED_IN_BOTH
