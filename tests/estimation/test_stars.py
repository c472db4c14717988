"""Stars of probes as one body, against rotations that are parameters, minima over all rotations,
and what is known in closed form.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.extensions.certificates.certificate_files import (
    read_certificate,
    with_drawn_values,
    write_certificate,
)
from ballplate.montecarlo._reference import Truth, reference
from ballplate.montecarlo._replicates import draw, estimate_batch
from ballplate.results.prediction import predict
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.star import Star, Stars, observed_stars
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.estimation.gauss_newton import iterate
from ballplate.simulator.estimation.initial import initial_state
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import written_in_python
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.geometry.motions import rotation_from_vector
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.readings.simulated import simulated_readings
from scipy.optimize import minimize

from tests.reference import dense
from tests.reference.designs import altered
from tests.reference.small_quickstart import small_sections

QUICKSTART: dict[str, Any] = yaml.safe_load(Path("designs/quickstart.yaml").read_text("utf-8"))
TIPS = np.array(
    [[0.0, 0.0, -0.05], [0.05, 0.0, 0.0], [-0.05, 0.0, 0.0], [0.0, 0.05, 0.0], [0.0, -0.05, 0.0]]
)
U = 2e-7


def small(star: dict[str, Any] | None = None, **changes: Any) -> Experiment:
    """The quickstart with few balls and coefficients, and a star of all its probes."""
    stars = {} if star is None else {"stars": [star]}
    return written_in_python(small_sections(**changes | stars), Path())


def arms(count: int, d: int, seed: int) -> np.ndarray:
    return 0.05 * np.random.default_rng(seed).standard_normal((count, d))


def turned(coordinates: np.ndarray, seed: int) -> np.ndarray:
    """The same in another direction, turned by an angle of any size."""
    generator = np.random.default_rng(seed)
    vector = generator.standard_normal((1, 3 if coordinates.shape[1] == 3 else 1))
    return np.asarray(coordinates @ rotation_from_vector(vector)[0].T)


def squares(one: Stars, offsets: np.ndarray) -> float:
    return float((((one.values(offsets) - one.value) / one.uncertainty) ** 2).sum())


@pytest.mark.parametrize("has_place", [True, False])
@pytest.mark.parametrize(("count", "d"), [(5, 3), (2, 3), (4, 2)])
def test_the_sum_of_squares_is_the_least_over_all_directions_and_places(
    count: int, d: int, has_place: bool
) -> None:
    star = Star(tuple("abcde"[:count]), arms(count, d, 1), 1e-3, has_place)
    one = observed_stars([star], star.probes)
    offsets = turned(star.coordinates, 2) + 5e-3 * np.random.default_rng(3).standard_normal(
        (count, d)
    )
    size = 3 if d == 3 else 1

    def misfit(motion: np.ndarray) -> float:
        turn = rotation_from_vector(motion[None, :size])[0]
        shift = 0.0 if has_place else 0.01 * motion[size:]
        return float((((star.coordinates @ turn.T + shift - offsets) / 1e-3) ** 2).sum())

    starts = np.random.default_rng(4).uniform(-3.0, 3.0, (6, size + (0 if has_place else d)))
    found = [minimize(misfit, start, method="BFGS", options={"gtol": 1e-9}) for start in starts]
    assert squares(one, offsets) == pytest.approx(min(one.fun for one in found), rel=1e-7, abs=1e-9)


def test_the_turn_about_the_line_of_two_tips_is_open_and_harmless() -> None:
    """What is known of two tips among one another is their distance; of two that are in line with
    the point that they turn about, four values.
    """
    tips = np.array([[0.05, 0.0, 0.0], [-0.03, 0.0, 0.0]])
    star = Star(("a", "b"), tips, U, False)
    one = observed_stars([star], star.probes)
    offsets = turned(tips, 5) + 1e-6 * np.random.default_rng(6).standard_normal((2, 3))
    distance = float(np.linalg.norm(offsets[0] - offsets[1]))
    assert len(one) == 1
    assert squares(one, offsets) == pytest.approx((distance - 0.08) ** 2 / (2 * U**2), rel=1e-6)
    in_place = replace(star, has_place=True)
    assert len(observed_stars([in_place], star.probes)) == 4


@pytest.mark.parametrize("has_place", [True, False])
@pytest.mark.parametrize("line", [True, False])
def test_half_the_gradient_is_that_of_differences(has_place: bool, line: bool) -> None:
    tips = np.array([[0.05, 0.0, 0.0], [-0.03, 0.0, 0.0]]) if line else TIPS
    names = ("right", "left") if line else tuple(QUICKSTART["probes"])
    design = lay_out(small({"standard_uncertainty": "1 mm", "place": "stated"}))
    star = Star(names, tips, 1e-3, has_place)
    one = observed_stars([star], design.probes.names)
    generator = np.random.default_rng(7)
    own = [design.probes.names.index(name) for name in names]
    offsets = design.probes.offsets.copy()
    offsets[own] = turned(tips, 8) + 1e-3 * generator.standard_normal(tips.shape)
    rows = one.rows(design, replace(nominal_state(design), probes=offsets), None)
    assert rows.by_shared is not None
    columns = design.once(shared_layout).offset_columns
    gradient = (rows.by_shared.T @ rows.residual)[columns]
    step, expected = 1e-7, np.zeros_like(offsets)
    for place in np.ndindex(*offsets.shape):
        moved = step * (
            np.arange(offsets.size).reshape(offsets.shape) == columns[place] - columns.min()
        )
        expected[place] = (
            0.25 * (squares(one, offsets + moved) - squares(one, offsets - moved)) / step
        )
    np.testing.assert_allclose(gradient, expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())


def dense_offsets(experiment: Experiment) -> dict[str, np.ndarray]:
    """Uncertainties behind U1 to U6 where the turn of a star in its place is a parameter."""
    design = lay_out(experiment)
    problem = dense.planned(design, 3, 3)
    drawn = design.probes.offsets
    free = np.flatnonzero(design.probes.free.ravel())
    n = problem.parameters

    def split(step: Any) -> tuple[Any, Any, Any]:
        offsets = drawn.astype(step.dtype).ravel()
        offsets[free] += step[n : n + len(free)]
        offsets = offsets.reshape(drawn.shape)
        return (
            replace(problem, design=altered(design, probes={"offsets": offsets})),
            offsets,
            step[n + len(free) :],
        )

    def rows(step: Any) -> Any:
        moved, offsets, motion = split(step)
        body = drawn + np.cross(motion, drawn)
        return np.concatenate([dense.residuals(moved, step[:n]), ((offsets - body) / U).ravel()])

    count = n + len(free) + 3
    spread = dense.spread(dense.jacobian(rows, count))
    assert spread.deficiency == 0
    found = {}
    for symbol in ("U1", "U4", "U5", "U6"):

        def values(step: Any, symbol: str = symbol) -> Any:
            return dense.quantities(split(step)[0])[symbol](step[:n])

        found[symbol] = spread.of(dense.jacobian(values, count))
    return found


def test_uncertainties_are_those_of_directions_as_parameters() -> None:
    experiment = small({"standard_uncertainty": "0.2 um", "place": "stated"})
    expected = dense_offsets(experiment)
    got = predict(experiment).quantities
    for symbol, values in expected.items():
        assert got[symbol].average == pytest.approx(float(values.mean()), rel=1e-6)
        assert got[symbol].maximum == pytest.approx(float(values.max()), rel=1e-6)


def test_where_the_star_is_hardly_moves_what_depends_on_no_frame() -> None:
    """A shift of all tips is one of all poses."""
    known, unknown = (
        predict(small({"standard_uncertainty": "0.2 um", "place": place})).quantities
        for place in ("stated", "unknown")
    )
    for symbol in ("U5", "U6"):
        assert known[symbol].average == pytest.approx(unknown[symbol].average, rel=1e-6)
    assert known["U6"].average > predict(small()).quantities["U6"].average


@pytest.mark.parametrize("place", ["stated", "unknown"])
def test_a_star_that_points_elsewhere_is_found(place: str) -> None:
    """Exact readings with tips turned by 40 degrees; the file has them as they were certified."""
    star = {"standard_uncertainty": "0.2 um", "place": place}
    every = [{**one, "probes": list(QUICKSTART["probes"])} for one in QUICKSTART["positions"]]
    for one in every:
        one["corner"] = {axis: "150 mm" for axis in one["corner"]}
        one["level"] = {"low": "350 mm", "high": "650 mm"}[one["name"].split()[1]]
    plate = {"kind": "grid", "balls": [3, 3], "size": ["600 mm", "600 mm"]}
    stated = small(star, positions=every, artefacts={"plate": plate})
    pivot = TIPS[0] if place == "unknown" else np.zeros(3)
    turn = rotation_from_vector(np.radians(40.0) * np.array([[0.48, -0.6, 0.64]]))[0]
    tips = (TIPS - pivot) @ turn.T + pivot
    written = {
        name: [f"{v!r} m" for v in tip.tolist()]
        for name, tip in zip(QUICKSTART["probes"], tips, strict=True)
    }
    real = small(positions=every, artefacts={"plate": plate}, probes=written)
    found = simulated_readings(real, exact=True)
    design = lay_out(stated)
    solution = iterate(design, found.x, initial_state(design, found.x))
    assert solution.status == "converged"
    assert solution.factor.sum_of_squares < 1e-6
    np.testing.assert_allclose(solution.state.probes, tips, rtol=0, atol=1e-10)


def test_replicates_follow_the_estimator_exactly() -> None:
    """With a star turned by a degree and loosely known tips, so that turns are not small; with a
    certificate of co-ordinates and a prior on a turn besides.
    """
    places = {"kind": "coordinates", "balls": ["r1c1", "r3c2"], "standard_uncertainty": "0.2 um"}
    sides = {"kind": "distances", "pairs": "corners", "standard_uncertainty": "0.3 um"}
    prior = {"parameter": "x low: rotation y", "standard_uncertainty": "10 urad"}
    star = {"standard_uncertainty": "20 um"}
    design = lay_out(small(star, calibration=[sides, places], priors=[prior]))
    drawn = nominal_state(design)
    turn = rotation_from_vector(np.array([[0.01, -0.02, 0.015]]))[0]
    shared = reference(design, Truth(replace(drawn, probes=TIPS @ turn.T), design.model))
    found, drawn_noise, design = estimate_batch(shared, 1, 0, 3), draw(shared, 1, 0), shared.design
    order = np.concatenate(
        [
            [
                int(np.flatnonzero(is_group)[0])
                for ball in np.arange(9)[group.ball]
                for is_group in [
                    (design.readings.position == group.position)
                    & (design.readings.ball == ball)
                    & (design.readings.probe == group.probe[0])
                ]
            ]
            for group in shared.groups
            if group.probe is not None
        ]
    )
    for k in range(3):
        x = shared.exact.copy()
        x[order] += drawn_noise.moved[k].T
        observed = design.observed(
            *(
                one.given(value=one.value + errors[k])
                for one, errors in zip(design.observations, drawn_noise.errors, strict=True)
            )
        )
        solution = iterate(observed, x, shared.start)
        moved = found.found.offsets[k]
        assert np.abs(moved).max() > 1e-7
        # To a few millionths of what replicates differ by, as of all else.
        np.testing.assert_allclose(
            shared.start.probes + moved,
            solution.state.probes,
            rtol=0,
            atol=5e-6 * np.abs(found.found.offsets).max(),
        )
        assert found.sum_of_squares[k] == pytest.approx(solution.factor.sum_of_squares, rel=1e-5)


def test_a_certificate_of_the_star_is_drawn_and_read_again(tmp_path: Path) -> None:
    experiment = small({"standard_uncertainty": "0.2 um"})
    found = simulated_readings(experiment, seed=5)
    drawn = with_drawn_values(experiment, found)
    moved = drawn.stars[0].coordinates - TIPS
    assert 0.5 * U < float(moved.std()) < 2.0 * U
    path = tmp_path / "certificate.csv"
    with path.open("w", encoding="utf-8") as stream:
        write_certificate(stream, drawn, "certificate")
    again = read_certificate(path, experiment)
    np.testing.assert_array_equal(again.stars[0].coordinates, drawn.stars[0].coordinates)
    for name, tip in zip(QUICKSTART["probes"], TIPS, strict=True):
        np.testing.assert_array_equal(again.probes[name].offset, tip)


@pytest.mark.parametrize(
    ("star", "probes", "expected"),
    [
        ({"probes": ["down", "rihgt"]}, {}, 'unknown probe "rihgt"; did you mean "right"?'),
        (
            {"probes": ["down", "right"]},
            {"right": {"unknown": True}},
            "its star states the uncertainty",
        ),
        ({}, {"down": {"reference": True}}, "turns about a stated place, which is the reference"),
        ({"values": "tips.csv"}, {}, "no co-ordinates for left"),
    ],
)
def test_what_is_wrong_with_a_star_is_told(
    star: dict[str, Any], probes: dict[str, Any], expected: str, tmp_path: Path
) -> None:
    (tmp_path / "tips.csv").write_text(
        "probe,x_mm,y_mm,z_mm\ndown,0,0,-50\nright,50,0,0\nback,0,50,0\nfront,0,-50,0\n"
    )
    offsets = {
        name: {"offset": offset, **probes[name]} if name in probes else offset
        for name, offset in QUICKSTART["probes"].items()
    }
    stated = {
        **QUICKSTART,
        "probes": offsets,
        "stars": [{"standard_uncertainty": "0.2 um", **star}],
    }
    with pytest.raises(ExperimentError, match=expected.replace("?", r"\?")):
        written_in_python(stated, tmp_path)
