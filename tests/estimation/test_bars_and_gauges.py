"""Ball bars and Bryan gauges against closed forms, differences, and a fit that shares no code with
ours.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from ballplate.extensions.estimators.length_equations import LengthEstimator, length_estimate
from ballplate.results.fitting import fit
from ballplate.results.prediction import predict
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.gauss_newton import moved
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.truth import true_machine
from ballplate.simulator.readings.reading_files import read_readings, write_readings
from ballplate.simulator.readings.simulated import exact_readings, on_true_machine
from ballplate.simulator.readings.true_artefacts import true_artefacts
from scipy.optimize import least_squares

from tests.reference.derivatives import assert_derivative, central_difference

FOLDER = Path("designs/hurt_foss")


def changed(tmp_path: Path, file: str, **sections: object) -> Experiment:
    """A shipped design without its variants, some sections replaced."""
    content = yaml.safe_load((FOLDER / f"{file}.yaml").read_text(encoding="utf-8"))
    del content["variants"], content["expected_rank_deficiency"]
    path = tmp_path / f"{file}.yaml"
    path.write_text(yaml.safe_dump(content | sections), encoding="utf-8")
    (experiment,) = load(path)
    return experiment


def shipped(file: str, variant: str) -> Experiment:
    return {one.name: one for one in load(FOLDER / f"{file}.yaml")}[variant]


def truth_of(experiment: Experiment, design: Design) -> tuple[Design, State]:
    corners = design.machine.volume.corners
    return on_true_machine(design, true_machine(experiment.true_machine, design.model, *corners))


def scattered(count: int, seed: int, lowest: float = 0.0) -> list[list[str]]:
    """Azimuths and elevations that are spread evenly over the sphere above the lowest elevation."""
    turn, height = np.random.default_rng(seed).random((2, count))
    low = np.sin(np.radians(lowest))
    elevations = np.degrees(np.arcsin(low + (1.0 - low) * height))
    return [[f"{a:.6f} deg", f"{e:.6f} deg"] for a, e in zip(360.0 * turn, elevations, strict=True)]


BOTH = {
    "artefacts": {
        "bar": {"kind": "two_spheres", "length": "400 mm", "role": "length_standard"},
        "gauge": {"kind": "bryan_gauge", "radius": "300 mm", "directions": scattered(12, 1, 10.0)},
        "short": {"kind": "bryan_gauge", "radius": "200 mm", "directions": scattered(6, 2)},
    },
    "probes": {
        "magnet": ["0 mm", "0 mm", "0 mm"],
        "other": {"offset": ["0 mm", "0 mm", "-50 mm"], "unknown": True},
    },
    "positions": [
        {
            "name": "bar",
            "artefact": "bar",
            "pose": {"origin": ["100 mm", "100 mm", "100 mm"]},
            "probes": ["magnet"],
        },
        *(
            {
                "name": name,
                "artefact": gauge,
                "pose": {"origin": [x, "400 mm", "150 mm"]},
                "probes": [probe],
            }
            for name, gauge, x, probe in (
                ("left", "gauge", "350 mm", "magnet"),
                ("right", "gauge", "650 mm", "other"),
                ("middle", "short", "500 mm", "magnet"),
            )
        ),
    ],
    "calibration": [
        {"kind": "radius", "artefact": "gauge", "standard_uncertainty": "2 um", "value": "300.1 mm"}
    ],
}


def test_rows_are_derivatives(tmp_path: Path) -> None:
    """By machine errors, pivots, probe offsets and unknown lengths together, certificates
    shared.
    """
    experiment = changed(tmp_path, "bryan-gauge", **BOTH)
    design = lay_out(experiment)
    layout = shared_layout(design)
    assert design.unknown_lengths.names == ("bar: length", "short: radius")
    assert [p.name for p in layout.parameters[layout.poses]] == [
        f"{name}: origin {axis}" for name in ("left", "right", "middle") for axis in "xyz"
    ]
    on_truth, truth = truth_of(experiment, design)
    _, x = exact_readings(on_truth, truth)
    generator = np.random.default_rng(1)

    def residual(step: np.ndarray) -> np.ndarray:
        still = np.zeros_like(design.balls.places)
        there = moved(state, layout, step, still)
        return design.of(Lengths).rows(design, there, x).residual

    state = replace(nominal_state(design), a=1e-4 * generator.standard_normal(6))
    expected = central_difference(residual, np.zeros(len(layout)), 1e-6)
    found = design.of(Lengths).rows(design, state, x).by_shared
    assert found is not None
    assert_derivative(found, expected, 1e-6)


def test_one_bar_along_one_axis_has_the_uncertainty_of_the_closed_form(tmp_path: Path) -> None:
    places = [
        {"name": str(k), "pose": {"origin": ["250 mm", f"{100 * k} mm", "300 mm"]}}
        for k in range(1, 6)
    ]
    at = linearise(lay_out(changed(tmp_path, "bar-bell", positions=places)))
    assert at.deficiency == 5
    values = at.of_shared(np.eye(len(at.layout))[at.layout.model])
    # The mean of five lengths whose ends have 1 um each, on a certificate with 0.5 um.
    assert values[~np.isnan(values)] == pytest.approx(
        [np.sqrt(2e-12 / 5 + 0.25e-12) / 0.5], rel=1e-9
    )


def directions(parameters: np.ndarray) -> np.ndarray:
    """Axes of a machine with scale errors and angles, written down anew: columns are what a unit of
    reading moves.
    """
    sx, sy, sz, c, b, a = parameters
    y = np.array([np.cos(np.pi / 2 + c), np.sin(np.pi / 2 + c), 0.0])
    z0 = np.cos(np.pi / 2 - b)
    z1 = (np.cos(np.pi / 2 + a) - y[0] * z0) / y[1]
    z = np.array([z0, z1, np.sqrt(1.0 - z0**2 - z1**2)])
    return np.column_stack([(1 + sx) * np.array([1.0, 0.0, 0.0]), (1 + sy) * y, (1 + sz) * z])


@pytest.mark.parametrize("variant", ["length known", "radius known", "two pivots"])
def test_the_fit_is_the_one_of_scipy(variant: str, tmp_path: Path) -> None:
    """Values and uncertainties; the certificate as an observation of one unknown length."""
    file = "bar-bell" if variant == "length known" else "bryan-gauge"
    experiment = shipped(file, variant)
    design = lay_out(experiment)
    path = tmp_path / "readings.csv"
    on_truth, truth = truth_of(experiment, design)
    generator = np.random.default_rng(5)
    readings, x = exact_readings(on_truth, replace(truth, balls=true_artefacts(design, generator)))
    x = x + 1e-6 * generator.standard_normal(x.shape)
    with path.open("w", encoding="utf-8") as stream:
        write_readings(stream, design, readings, x)
    found = fit(experiment, read_readings(path, lay_out(experiment)), "given")
    drawn = 0.5 if file == "bar-bell" else 0.3
    pivots = len(design.gauge_positions)
    # The ends of a bar move independently; the pivot stands still.
    noise = 1e-6 * (np.sqrt(2.0) if file == "bar-bell" else 1.0)

    def residual(unknown: np.ndarray) -> np.ndarray:
        unknown = 1e-6 * unknown
        axes, radius = directions(unknown[:6]), drawn + unknown[6]
        if file == "bar-bell":
            lengths = [np.linalg.norm(axes @ (x[2 * k] - x[2 * k + 1])) for k in range(12)]
        else:
            centres = design.positions.origins + unknown[7:].reshape(pivots, 3)
            lengths = [
                np.linalg.norm(axes @ p - centres[k])
                for k, p in zip(readings.position, x, strict=True)
            ]
        return np.append((np.array(lengths) - radius) / noise, unknown[6] / 0.5e-6)

    theirs = least_squares(
        residual,
        np.zeros(7 + 3 * pivots),
        "3-point",
        x_scale="jac",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    spread = np.sqrt(np.diag(np.linalg.inv(theirs.jac.T @ theirs.jac)))
    ours = {e.name: e for e in found.estimates}
    for k, name in enumerate(("scale x", "scale y", "scale z", "C0Y", "B0Z", "A0Z")):
        assert ours[name].value == pytest.approx(1e-6 * theirs.x[k], abs=1e-4 * 1e-6 * spread[k])
        assert ours[name].standard_uncertainty == pytest.approx(1e-6 * spread[k], rel=1e-4)
    assert found.solution.factor.sum_of_squares == pytest.approx(2.0 * theirs.cost, rel=1e-6)


def test_where_the_ball_was_to_be_does_not_matter(tmp_path: Path) -> None:
    """Readings of other directions than drawn, of a pivot that stands elsewhere, fit just as
    well.
    """
    drawn = changed(tmp_path, "bryan-gauge")
    really = changed(
        tmp_path,
        "bryan-gauge",
        artefacts={
            "gauge": {"kind": "bryan_gauge", "radius": "300 mm", "directions": scattered(60, 4)}
        },
        positions=[{"name": "pivot", "pose": {"origin": ["480 mm", "430 mm", "120 mm"]}}],
    )
    design = lay_out(really)
    on_truth, truth = truth_of(really, design)
    readings, x = exact_readings(on_truth, truth)
    with (tmp_path / "r.csv").open("w", encoding="utf-8") as stream:
        write_readings(stream, design, readings, x)
    found = fit(drawn, read_readings(tmp_path / "r.csv", lay_out(drawn)), "given")
    values = {e.name: e.value for e in found.estimates}
    np.testing.assert_allclose(
        [values[p.name] for p in design.model.parameters], truth.a, rtol=0, atol=1e-10
    )
    assert [values[f"pivot: origin {axis}"] for axis in "xyz"] == pytest.approx(
        [0.48, 0.43, 0.12], abs=1e-10
    )
    uncertainty = {e.name: e.standard_uncertainty for e in found.estimates}
    planned = predict(really).quantities["U3"]
    assert max(uncertainty[p.name] for p in design.model.parameters) == pytest.approx(
        planned.maximum, rel=1e-3
    )


def test_each_repeat_of_a_gauge_is_a_length_of_its_own(tmp_path: Path) -> None:
    once, twice = (
        changed(
            tmp_path,
            "bryan-gauge",
            positions=[
                {"name": "pivot", "pose": {"origin": ["500 mm", "400 mm", "100 mm"]}, "repeats": k}
            ],
        )
        for k in (1, 2)
    )
    known = predict(twice).quantities["U3 angles"].maximum
    assert known == pytest.approx(
        predict(once).quantities["U3 angles"].maximum / np.sqrt(2.0), rel=1e-9
    )
    design = lay_out(twice)
    readings, x = exact_readings(*truth_of(twice, design))
    # The second time the ball stands 20 mm to the side of the first on the same sphere.
    centre = design.positions.origins[0]
    aside = x[1::2] + 0.02 * np.cross(x[1::2] - centre, [0.0, 0.0, 1.0])
    x[1::2] = centre + 0.3 * (aside - centre) / np.linalg.norm(aside - centre, axis=1)[:, None]
    with (tmp_path / "r.csv").open("w", encoding="utf-8") as stream:
        write_readings(stream, design, readings, x)
    observed = read_readings(tmp_path / "r.csv", design)
    assert (
        len(observed.design.of(Lengths)) == 120
        and len(np.unique(observed.design.of(Lengths).first)) == 120
    )


def metric_of(factors: np.ndarray) -> np.ndarray:
    """The metric tensor of e1 to e6."""
    metric = np.eye(3)
    metric[np.triu_indices(3)] += factors
    return np.asarray(np.triu(metric) + np.triu(metric, 1).T)


@pytest.mark.parametrize("estimator", ["length-equations", "sphere-then-metric"])
def test_length_equations_are_solved_as_scipy_does(
    estimator: LengthEstimator, tmp_path: Path
) -> None:
    """Centres, radii, the metric and its parameters' uncertainties; two gauges of a known radius,
    one of an unknown one, and a bar of an unknown length.
    """
    experiment = changed(tmp_path, "bryan-gauge", **BOTH)
    design = lay_out(experiment)
    _, x = exact_readings(*truth_of(experiment, design))
    x = x + 1e-5 * np.random.default_rng(8).standard_normal(x.shape)
    found = length_estimate(design, x, estimator)
    seen = x + design.probes.offsets[design.readings.probe]
    position = design.readings.position
    bar = np.subtract(*seen[position == 0])
    gauges = [seen[position == k] for k in (1, 2, 3)]

    def of_gauges(metric: np.ndarray, centres: np.ndarray, short: float) -> np.ndarray:
        rows = [
            np.einsum("mi,ij,mj->m", places - centre, metric, places - centre) - radius**2
            for places, centre, radius in zip(
                gauges, centres.reshape(3, 3), (0.3001, 0.3001, short), strict=True
            )
        ]
        return np.concatenate(rows)

    centres = np.array([places.mean(axis=0) for places in gauges]).ravel()
    strict = {"x_scale": "jac", "xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    spheres = least_squares(
        lambda u: of_gauges(np.eye(3), u[:9], u[9]), np.append(centres, 0.2), "3-point", **strict
    ).x
    if estimator == "sphere-then-metric":
        centres, short = spheres[:9], spheres[9]
        # Linear in the factors; the bar's equation gives its own length only.
        derivative = central_difference(
            lambda u: of_gauges(metric_of(u), centres, short), np.zeros(6), 1e-3
        )
        residual = of_gauges(np.eye(3), centres, short)
        factors = np.linalg.lstsq(derivative, -residual, rcond=None)[0]
    else:
        whole = least_squares(
            lambda u: of_gauges(metric_of(u[:6]), u[6:15], u[15]),
            np.append(np.zeros(6), spheres),
            "3-point",
            **strict,
        )
        factors, centres, short, derivative = whole.x[:6], whole.x[6:15], whole.x[15], whole.jac
    metric = metric_of(factors)
    left = of_gauges(metric, centres, short)
    freedom = len(left) - derivative.shape[1]
    covariance = left @ left / freedom * np.linalg.inv(derivative.T @ derivative)[:6, :6]

    def factors_of(parameters: np.ndarray) -> np.ndarray:
        axes = directions(parameters)
        return np.asarray((axes.T @ axes - np.eye(3))[np.triu_indices(3)])

    by_factor = np.linalg.inv(central_difference(factors_of, np.zeros(6), 1e-5))
    spread = np.sqrt(np.diag(by_factor @ covariance @ by_factor.T))
    ours = np.sqrt((found.spread**2).sum(axis=1))
    assert found.degrees_of_freedom == freedom and found.deficiency == 0 and found.converged
    np.testing.assert_allclose(found.factors, factors, rtol=0, atol=1e-9)
    np.testing.assert_allclose(factors_of(found.parameters), factors, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.centres[1:].ravel(), centres, rtol=0, atol=1e-10)
    wanted = [np.sqrt(bar @ metric @ bar), short]
    np.testing.assert_allclose(found.lengths, wanted, rtol=0, atol=1e-10)
    assert found.scatter == pytest.approx(np.sqrt(left @ left / freedom), rel=1e-6)
    np.testing.assert_allclose(ours, spread, rtol=1e-5)


def test_true_gauges_have_the_certified_radius(tmp_path: Path) -> None:
    design = lay_out(changed(tmp_path, "bryan-gauge", **BOTH))
    drawn = np.linalg.norm(true_artefacts(design, np.random.default_rng(1)), axis=1)
    of_gauge = design.balls.artefact == 1
    assert (
        len(set(drawn[of_gauge].round(12))) == 1 and 1e-7 < abs(drawn[of_gauge][0] - 0.3001) < 1e-5
    )
    np.testing.assert_allclose(drawn[design.balls.artefact == 2], 0.2, rtol=1e-12)
