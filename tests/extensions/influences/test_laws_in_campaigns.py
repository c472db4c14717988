"""Influence quantities by laws written down beside the program: their derivatives, dense
computations, simulated campaigns, Monte Carlo and fits, of each kind alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.montecarlo.experiments import trials
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.readings import reading_blocks
from ballplate.simulator.estimation.functions import linear_functions
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.readings.simulated import simulated_readings
from ballplate.uncertainty.quantities import QUANTITIES

from tests.extensions.influences import (
    test_drift as drift,
    test_sag as sag,
    test_temperature as temperature,
)
from tests.extensions.influences.campaigns import (
    Law,
    Real,
    assert_covered,
    coverage,
    dense_spread,
    file_with,
    plain,
    told_on_page,
)
from tests.extensions.influences.test_position_effects import EVERY
from tests.reference import dense


@dataclass(frozen=True)
class Stated:
    """A statement, the law of what its parameters e (p,) add beside their values, with their
    uncertainties; of a fit the beginning of a line, and the unit at its end; and how far the law
    neglects what moves with the places of balls.
    """

    settings: dict[str, Any]
    law: Law
    spread: Real
    line: tuple[str, str] = ("", "")
    neglected: float = 1e-6


KINDS = {
    "drift": Stated(drift.STATED, drift.law, drift.SPREAD, ("drift of the scales", "ppm/h")),
    "sag": Stated(sag.STATED, sag.law, sag.SPREAD, ("sag of plate", "µm")),
    "temperature": Stated(
        temperature.STATED,
        temperature.law,
        temperature.SPREAD,
        ("expansion of plate", "ppm/K"),
        1e-4,
    ),
    **{
        name: Stated(one.settings, one.law, one.spread, neglected=1e-4)
        for name, one in EVERY.items()
    },
}
# Rows of the page by what is stated to the fit.
ON_PAGE = [
    ("temperatures, values alone", "temperature", temperature.STATED | temperature.EXACT),
    ("temperatures not", "temperature", None),
    ("drift not", "drift", None),
    ("sag of another shape", "sag", sag.STATED | {"shape": "x"}),
    ("sag not", "sag", None),
    ("probing of 0.1 µm not", "probing, 0.1 µm", None),
    ("probing of 0.3 µm not", "probing, 0.3 µm", None),
    ("scale of each position not", "scale of each position", None),
    ("reproducibility of probes not", "reproducibility of positions and probes", None),
    ("reproducibility of balls not", "reproducibility of positions and balls", None),
]
TOLD_ALONE = [name for name, one in KINDS.items() if one.line[0]]


@pytest.fixture(scope="module", params=KINDS)
def kind(request: pytest.FixtureRequest) -> Stated:
    return KINDS[request.param]


@pytest.fixture(scope="module")
def drawn(kind: Stated, tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    return file_with(tmp_path_factory.mktemp("drawn"), [kind.settings])


def test_the_derivative_is_that_of_the_law(kind: Stated, drawn: Experiment) -> None:
    design = lay_out(drawn)
    state, readings, count = nominal_state(design), design.readings, len(kind.spread)
    x = np.random.default_rng(3).random((len(readings), 3))
    blocks = reading_blocks(design, state, readings, x)
    assert len(design.influence_parameters) == count
    assert blocks.by_influence is not None
    for k in range(count):
        slope = kind.law(design, x, 1e-30j * np.eye(count)[k]).imag / 1e-30
        expected = -slope / design.machine.repeatability
        np.testing.assert_allclose(blocks.by_influence[:, :, k], expected, rtol=1e-9, atol=1e-6)
    undisturbed = reading_blocks(plain(design), state, readings, x).residual
    shift = kind.law(design, x, np.zeros(count)) / design.machine.repeatability
    np.testing.assert_allclose(blocks.residual, undisturbed - shift, rtol=0, atol=1e-6)


def test_every_uncertainty_is_that_of_the_dense_computation(
    kind: Stated, drawn: Experiment
) -> None:
    design, count = lay_out(drawn), len(kind.spread)
    (found, of), at = dense_spread(design, kind.law, kind.spread), linearise(design)
    assert at.deficiency == found.deficiency == 0
    without = dense.standard_uncertainties(of)
    for symbol, function in dense.quantities(of).items():
        wide = np.pad(dense.jacobian(function, of.parameters), ((0, 0), (0, count)))
        (functions,) = QUANTITIES[symbol].functions(design, at.layout)
        expected = found.of(wide)
        values = at.uncertainty(linear_functions(at, functions))
        np.testing.assert_allclose(values, expected, rtol=kind.neglected)
        assert expected.mean() > without[symbol].mean()
    own = at.of_shared(np.eye(len(at.layout))[at.layout.influences])
    expected = np.sqrt(np.diag(found.covariance))[-count:]
    np.testing.assert_allclose(own, expected, rtol=kind.neglected)


@pytest.mark.parametrize("kind", TOLD_ALONE, indirect=True, scope="module")
@pytest.mark.parametrize("count", [40, pytest.param(3000, marks=pytest.mark.long)])
def test_what_is_declared_is_covered(kind: Stated, drawn: Experiment, count: int) -> None:
    design = lay_out(drawn)
    assert_covered(coverage(design, design, kind.law, kind.spread, count), count)


@pytest.mark.long
@pytest.mark.parametrize(("name", "kind", "settings"), ON_PAGE, indirect=["kind"], scope="module")
def test_the_page_states_what_is_wrong_otherwise(
    name: str, settings: dict[str, Any] | None, kind: Stated, drawn: Experiment, tmp_path: Path
) -> None:
    design = lay_out(drawn)
    told = plain(design) if settings is None else lay_out(file_with(tmp_path, [settings]))
    found = coverage(design, told, kind.law, kind.spread, 400)
    assert told_on_page(name) == pytest.approx(found.row, rel=0.01, abs=0.5)


def test_monte_carlo_scatters_by_the_uncertainty(drawn: Experiment) -> None:
    outcome = trials(drawn, 600, 8).outcome
    assert outcome is not None and not outcome.failed
    for one in outcome.comparisons.values():
        assert abs(one.spread.value - 1.0) < 4.0 * one.spread.error


@pytest.mark.parametrize("kind", TOLD_ALONE, indirect=True, scope="module")
def test_a_fit_tells_the_parameters(kind: Stated, drawn: Experiment) -> None:
    fitted = bp.fit(drawn, bp.simulate(drawn, seed=9))
    truth = simulated_readings(drawn, seed=9).truth.influences
    told = {one.name: one for one in fitted.estimates if one.kind == "influence"}
    off = np.array([one.value for one in told.values()]) - truth
    u = np.array([one.standard_uncertainty for one in told.values()])
    assert len(told) == len(kind.spread)
    assert (np.abs(off) < 4.5 * u).all() and (u <= kind.spread * 1.001).all()
    (line,) = [one for one in fitted.lines() if one.startswith(kind.line[0])]
    *_, value, _, unit = line.split()
    first = next(one for name, one in told.items() if name.startswith(kind.line[0]))
    assert unit == kind.line[1]
    assert float(value) == pytest.approx(1e6 * first.value, rel=1e-2)
