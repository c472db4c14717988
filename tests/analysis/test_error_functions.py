"""Error functions and residuals of a fit, by other ways."""

from __future__ import annotations

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.design.measurement import locations
from ballplate.simulator.estimation.functions import corrected_points

SQUARE = "designs/park/plate.yaml"


@pytest.fixture(scope="module")
def fitted() -> bp.Fit:
    return bp.fit(bp.quickstart(), bp.simulate(bp.quickstart(), seed=2), monomials=True)


def test_what_is_undetermined_has_no_curve() -> None:
    experiment = bp.load("designs/npl/6.1.1.yaml", "B")
    curves = bp.fit(experiment, bp.simulate(experiment, seed=1)).error_functions
    unknown = {one.name for one in curves if np.isnan(one.values[1:-1]).any()}
    assert unknown == {"EXX", "EYY", "EZZ"}
    for one in curves:
        np.testing.assert_array_equal(np.isnan(one.values), np.isnan(one.standard_uncertainties))


def test_models_without_lines_have_no_curves() -> None:
    plain = bp.load("designs/certified/two-dimensions.yaml")
    fit = bp.fit(plain, bp.simulate(plain, seed=1))
    assert fit.error_functions == () and "error_functions" not in fit.to_dict()


def test_squareness_is_one_value() -> None:
    experiment = bp.load(SQUARE)
    fit = bp.fit(experiment, bp.simulate(experiment))
    curves = {one.name: one for one in fit.error_functions}
    covariance = fit.covariance("machine")
    assert curves["EC0Y"].values.shape == (1,)
    u = float(np.sqrt(covariance.loc["EC0Y", "EC0Y"]))
    assert curves["EC0Y"].standard_uncertainties[0] == pytest.approx(u, rel=1e-9)


def test_residuals_by_group_are_root_mean_squares(fitted: bp.Fit) -> None:
    design, state = fitted.design, fitted.functions.at.state
    readings = design.readings
    given = corrected_points(design, state, fitted.observed.x, readings.probe)
    left = given - locations(design, state, readings)
    groups = fitted.to_dict()["residuals"]
    kinds = (("position", readings.position, design.positions.names),)
    kinds += (("probe", readings.probe, design.probes.names),)
    for word, of_group, names in kinds:
        for one in groups[f"by_{word}"]:
            own = left[of_group == names.index(one["name"])]
            assert one["count"] == own.size
            rms = float(np.sqrt((own**2).mean()))
            assert one["root_mean_square"] == pytest.approx(rms, rel=1e-6)
            assert one["standardised"] == pytest.approx(rms / 2e-7 / fitted.sigma, rel=1e-6)
    for k, one in enumerate(groups["by_axis"]):
        rms = float(np.sqrt((left[:, k] ** 2).mean()))
        assert one["name"] == "xyz"[k]
        assert one["root_mean_square"] == pytest.approx(rms, rel=1e-6)
