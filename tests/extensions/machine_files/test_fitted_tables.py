"""Machine files whose tables are replaced by least-squares polynomials and splines."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.machine_files.curves import Points
from ballplate.extensions.machine_files.description import (
    fitted_volumetric,
    reference_functions,
    true_volumetric,
)
from ballplate.extensions.machine_files.machine_file import load_machine
from numpy.testing import assert_allclose

from tests.extensions.machine_files.kinds import IN_SPACE

POSITIONS = np.linspace(-100.0, 500.0, 25)
VALUES = 2.0 * np.sin(POSITIONS / 90.0) + 1e-3 * POSITIONS


def machine(folder: Path, fit: str, name: str = "EXX", shift: float = 0.0) -> Path:
    pairs = zip((POSITIONS + shift).tolist(), VALUES.tolist(), strict=True)
    rows = [f"{x!r},{y!r}" for x, y in pairs]
    (folder / "table.csv").write_text("\n".join([f"position_mm,{name}_um", *rows, ""]))
    (folder / "machine.yaml").write_text(
        "title: one table\narrangement: MB2\n"
        f"volume: {{x: [{shift - 100} mm, {shift + 500} mm], y: [0 mm, 500 mm], z: [0 mm, 500 mm]}}\n"
        f"errors: {{{name}: {{file: table.csv, fit: {fit}}}}}\n"
    )
    return folder / "machine.yaml"


def test_a_polynomial_by_least_squares_from_samples(tmp_path: Path) -> None:
    described = load_machine(machine(tmp_path, "{order: 6}"))
    t = np.linspace(0.0, 1.0, 77)
    expected = np.polynomial.Polynomial.fit(POSITIONS, VALUES, 5)
    found = 1e6 * reference_functions(described)["EXX"].values(t)[:, 0]
    x = -100.0 + 600.0 * t
    assert_allclose(found, expected(x) - expected(-100.0), atol=1e-9)
    assert abs(found - np.interp(x, POSITIONS, VALUES - VALUES[0])).max() > 0.05


def test_a_spline_by_least_squares_is_that_of_scipy_and_of_the_command(tmp_path: Path) -> None:
    from scipy.interpolate import make_lsq_spline

    knots = [50.0, 200.0, 350.0]
    described = load_machine(machine(tmp_path, f"{{knots: {[f'{k} mm' for k in knots]}}}"))
    t = np.linspace(0.0, 1.0, 77)
    x = -100.0 + 600.0 * t
    full = np.array([-100.0] * 4 + knots + [500.0] * 4)
    expected = make_lsq_spline(POSITIONS, VALUES, full, 3)
    found = 1e6 * reference_functions(described)["EXX"].values(t)[:, 0]
    assert_allclose(found, expected(x) - expected(-100.0), atol=1e-9)
    described = load_machine(machine(tmp_path, "{every: 5}"))
    curve = bp.spline(tmp_path / "table.csv", every=5)
    found = reference_functions(described)["EXX"].values(t)[:, 0]
    wanted = curve.values(1e-3 * x) - curve.values(np.array([-0.1]))
    assert_allclose(found, wanted, atol=1e-15)


def test_a_straightness_error_loses_the_line_of_the_fit(tmp_path: Path) -> None:
    described = load_machine(machine(tmp_path, "{order: 4}", "EYX"))
    found = reference_functions(described)["EYX"].values(np.array([0.0, 0.5, 1.0]))[:, 0]
    assert_allclose(found[[0, 2]], 0.0, atol=1e-18)
    line = np.polynomial.Polynomial.fit(POSITIONS, VALUES, 3)
    middle = line(200.0) - 0.5 * (line(-100.0) + line(500.0))
    assert found[1] == pytest.approx(1e-6 * middle, rel=1e-9)


def test_readings_of_the_fitted_curve_are_fitted_by_a_model_of_the_same_knots(
    tmp_path: Path,
) -> None:
    file = machine(tmp_path, "{every: 6}", shift=100.0)
    same = {"kind": "machine", "file": "machine.yaml"}
    experiment = bp.experiment({**IN_SPACE, "error_model": same, "true_machine": same}, tmp_path)
    fit = bp.fit(experiment, bp.simulate(experiment, exact=True), sigma="given")
    # Readings are written to a nanometre's thousandth.
    assert fit.to_dict()["sum_of_squares"] < 1e-9
    curve = bp.spline(tmp_path / "table.csv", every=6)
    truth = true_volumetric(load_machine(file))
    x = np.array([[0.15, 0.2, 0.1], [0.4, 0.1, 0.3]])
    expected = curve.values(x[:, 0]) - curve.values(np.zeros(1))
    assert_allclose(truth.model.error(x, truth.a, np.zeros(x.shape))[:, 0], expected, atol=1e-16)


def test_the_model_that_is_estimated_has_the_same_knots(tmp_path: Path) -> None:
    described = load_machine(machine(tmp_path, "{every: 6}"))
    model = fitted_volumetric(described, described.lower, described.upper, 3)
    shape = described.errors[0].shape
    assert isinstance(shape, Points) and len(shape.knots) == 4
    assert len(model.parameters) == 4 + 4 - 1
    polynomial = load_machine(machine(tmp_path, "{order: 5}"))
    assert len(fitted_volumetric(polynomial, polynomial.lower, polynomial.upper, 3).parameters) == 4


@pytest.mark.parametrize(
    ("fit", "told"),
    [
        ("{every: 2, knots: [1 mm]}", "every.*knots.*both"),
        ("{knots: [900 mm]}", "the knot at 900 mm is not between the ends"),
        ("{knots: [1 mm, 2 mm, 3 mm, 4 mm, 5 mm]}", "the curve lacks"),
        ("{order: 1}", "order"),
        ("{order: 11, every: 1}", "lower the order|lacks"),
    ],
)
def test_wrong_fits_are_told(fit: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(bp.ExperimentError, match=told) as refused:
        load_machine(machine(tmp_path, fit))
    assert "errors.EXX" in str(refused.value)


def test_the_curves_say_what_was_fitted(tmp_path: Path) -> None:
    text = str(bp.curves(machine(tmp_path, "{order: 6}")))
    residuals = VALUES - np.polynomial.Polynomial.fit(POSITIONS, VALUES, 5)(POSITIONS)
    sigma = np.sqrt((residuals**2).sum() / (25 - 6))
    assert f"polynomial fitted to the table of 25 points, sigma {sigma:.2g} µm" in text
