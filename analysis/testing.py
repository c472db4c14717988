"""Checks for your tests of error models, functions of balls, observations and influence quantities
of your own, as `check_estimator` of scikit-learn is one for estimators.

Each raises AssertionError where derivatives are not those of the values.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from ballplate.simulator.design.arrays import Design, Observations
from ballplate.simulator.design.influence_quantities import Influence
from ballplate.simulator.design.measurement import (
    disturbed_readings,
    in_sequence,
    locations,
    nominal_state,
)
from ballplate.simulator.design.observations.balls import BallFunctions
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.estimation.gauss_newton import moved
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.machines.protocol import ErrorModel

__all__ = ["check_ball_functions", "check_influence", "check_model", "check_observations"]

# Steps move points by this much, in metres.
STEP = 1e-6


def check_model(model: ErrorModel, lower: Array, upper: Array) -> None:
    """Check an error model in a volume between two corners (d,), in metres."""
    generator = np.random.default_rng(1)
    x = generator.uniform(lower, upper, (7, model.dimension))
    p = 0.1 * np.ptp([lower, upper]) * generator.standard_normal(x.shape)
    steps = np.array([STEP / parameter.effect for parameter in model.parameters])
    message = "error(x, 0, p) is not p"
    without = model.error(x, 0.0 * steps, p)
    np.testing.assert_allclose(without, p, rtol=0.0, atol=1e-12, err_msg=message)
    for a in (0.0 * steps, 100.0 * steps * generator.standard_normal(len(steps))):
        _compare("jacobian", model.jacobian(x, a, p), lambda s: model.error(x, a + s, p), steps)  # noqa: B023


def check_ball_functions(functions: BallFunctions, balls: Array) -> None:
    """Check functions of balls at `balls` (n, d), in metres, and that none depends on where the
    artefact is.
    """
    n, d = balls.shape
    slope = functions.derivatives(balls).reshape(-1, n * d)
    _compare(
        "derivatives",
        slope,
        lambda step: functions.values(balls + step.reshape(n, d)),
        np.full(n * d, STEP),
    )
    arms = np.pad(balls - balls.mean(axis=0), ((0, 0), (0, 3 - d)))
    turns = [np.cross(axis, arms)[:, :d] for axis in np.eye(3)[0 if d == 3 else 2 :]]
    shifts = [np.tile(axis, (n, 1)) for axis in np.eye(d)]
    change = slope @ np.reshape([*shifts, *turns], (-1, n * d)).T
    message = "values depend on where the frame of the artefact is; co-ordinates are another kind"
    np.testing.assert_allclose(change, 0.0, atol=1e-6 * np.abs(slope).max(), err_msg=message)


def check_observations(observations: Observations, design: Design) -> None:
    """Check the derivatives of the rows of observations added to a design."""
    design = design.observed(observations)
    layout, state = shared_layout(design), nominal_state(design)
    rows = observations.rows(design, state, None)
    m, s, still = len(rows.residual), len(layout), np.zeros(design.balls.places.shape)
    slope = np.zeros((m, s + still.size))
    slope[:, :s] = 0.0 if rows.by_shared is None else rows.by_shared
    by_ball = slope[:, s:].reshape(m, *still.shape)
    np.add.at(by_ball, (np.arange(m)[:, None], observations.balls), rows.by_ball)
    slope[:, s:] = by_ball.reshape(m, -1)

    def residual(step: Array) -> Array:
        there = moved(state, layout, step[:s], step[s:].reshape(still.shape))
        return observations.rows(design, there, None).residual

    _compare("rows", slope, residual, np.full(slope.shape[1], STEP))


def check_influence(
    make: Callable[[float], Influence], value: float, design: Design, parameter: int = 0
) -> None:
    """Check shifts of the readings of a design: `make` returns the influence quantity whose
    `parameter` has a value.
    """
    influence = make(value)
    readings = in_sequence(design.readings, (influence,))
    state = nominal_state(design)
    x = locations(design, state, readings) - state.probes[readings.probe]
    at = disturbed_readings(state, readings, x)
    _compare(
        "shifts",
        influence.shifts(at)[1][..., parameter, None],
        lambda step: make(value + step[0]).shifts(at)[0],
        np.array([STEP / influence.parameters[parameter].effect]),
    )


def _compare(name: str, slope: Array, values: Callable[[Array], Array], steps: Array) -> None:
    """Compare derivatives (…, n) with central differences of values about 0 by steps (n,)."""
    changes = [(values(step) - values(-step)) / 2.0 for step in np.diag(steps)]
    expected, found = np.stack(changes, axis=-1), slope * steps
    tolerance = 1e-4 * np.abs(expected).max()
    message = f"{name}: not the derivative; change by steps {steps}"
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=tolerance, err_msg=message)
