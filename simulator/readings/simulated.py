"""Readings of an experiment's true machine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from ballplate.simulator.design.arrays import Design, Readings
from ballplate.simulator.design.measurement import (
    in_sequence,
    influence_shifts,
    locations,
    nominal_state,
    reading_uncertainties,
)
from ballplate.simulator.design.state import State
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.machines.protocol import ErrorModel
from ballplate.simulator.machines.truth import TrueMachine, true_machine


class NoReadingError(ValueError):
    """The true machine's errors are so large that no scale reading belongs to some location."""


@runtime_checkable
class HasRandomPart(Protocol):
    """An error model of a true machine whose errors are partly random."""

    def random_roots(self, x: Array, p: Array) -> tuple[Array, Array]:
        """Return square roots of the covariance of errors, in metres, at scale readings x (m, d)
        with probe offsets p (m, d): (m, d, k) of those drawn anew at each approach, (m, d, l) of
        lasting ones.
        """
        ...


def random_displacements(
    model: ErrorModel,
    truth: State,
    readings: Readings,
    x: Array,
    generator: np.random.Generator,
    count: int,
) -> Array:
    """Draw displacements (count, m, d) of readings at x (m, d), means of their repeats, in metres,
    in `count` campaigns; zero if the `model` of the true machine has no random part.
    """
    if not isinstance(model, HasRandomPart):
        return np.zeros((count, *x.shape))
    approach, lasting = model.random_roots(x, truth.probes[readings.probe])
    # An equal root of as few numbers as there are axes, since many of them are drawn.
    root = (
        np.linalg.qr(approach.swapaxes(1, 2), mode="r") / np.sqrt(readings.repeats)[:, None, None]
    )
    anew = generator.standard_normal((count, *root.shape[:2]))
    once = generator.standard_normal((count, lasting.shape[2]))
    drawn = np.einsum("bmk,mkd->bmd", anew, root) + np.einsum("bl,mdl->bmd", once, lasting)
    return np.asarray(drawn)


def on_true_machine(design: Design, machine: TrueMachine) -> tuple[Design, State]:
    """Return the nominal design on the true machine, whose error model may be another."""
    return replace(design, model=machine.model), replace(nominal_state(design), a=machine.a)


def scale_readings(model: ErrorModel, true: Array, a: Array, p: Array) -> Array:
    """Return scale readings x (m, d) with x + e(x, a, p) = `true`, exact to rounding.

    :raises NoReadingError: the errors are too large for the iteration x <- true - e(x) to settle.
    """
    # The scales show where the corrected point is at the ball: x + e(x) = true. Errors change by
    # far less than a reading does, so that each pass shortens the rest by that ratio.
    x = true - p
    rounding = 4e-16 * max(1.0, float(np.abs(true).max(initial=0.0)))
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(100):
            change = true - x - model.error(x, a, p)
            x = x + change
            largest = float(np.abs(change).max(initial=0.0))
            if largest <= rounding:
                return x
    if not largest <= 10 * rounding:
        raise NoReadingError(
            "the errors of the true machine are too large for its readings to be found"
        )
    return x


def true_readings(
    design: Design, truth: State, readings: Readings, model: ErrorModel | None = None
) -> Array:
    """Return scale readings (m, d) without noise, of a true machine, whose error model is by
    default the design's.

    :raises NoReadingError: as `scale_readings`.
    """
    model = model or design.model
    p, true = truth.probes[readings.probe], locations(design, truth, readings)
    x = scale_readings(model, true, truth.a, p)
    # Scale readings determine at most a ten-thousandth of the shift: five passes reach rounding.
    for _ in range(5 if design.influences else 0):
        shift, _ = influence_shifts(design, truth, readings, x)
        x = scale_readings(model, true + shift, truth.a, p)
    return x


def exact_readings(design: Design, truth: State) -> tuple[Readings, Array]:
    """Return readings of a design, one row per repeat, without noise: (rows, d) metres."""
    readings = in_sequence(design.readings.expanded(), design.influences)
    return readings, true_readings(design, truth, readings)


def noisy_readings(
    design: Design, truth: State, generator: np.random.Generator
) -> tuple[Readings, Array]:
    """Return `exact_readings` with noise of the readings' standard uncertainties, and with the
    random part of the machine's errors.
    """
    readings, x = exact_readings(design, truth)
    noise = design.noise.draw(generator, x.shape, readings.position, 0)
    random = random_displacements(design.model, truth, readings, x, generator, 1)
    return readings, x + noise * reading_uncertainties(design, readings) + random[0]


def true_influences(design: Design, generator: np.random.Generator) -> Array:
    """Draw true values (p,) of influence quantities about the stated ones; unknown ones keep their
    stated values.
    """
    u = np.array([parameter.uncertainty for parameter in design.influence_parameters], float)
    errors = np.where(np.isfinite(u), u, 0.0) * generator.standard_normal(len(u))
    return design.influence_values + errors


@dataclass(frozen=True)
class Simulated:
    """Scale readings `x` (readings, d) in metres of the true artefacts on the true machine, `truth`
    on `model`.

    `generator` continues after the readings; None without noise.
    """

    design: Design
    truth: State
    model: ErrorModel
    readings: Readings
    x: Array
    seed: int
    generator: np.random.Generator | None


def on_stated_machine(experiment: Experiment, design: Design) -> tuple[Design, State]:
    """Return an experiment's nominal design on the true machine that its file states."""
    machine = true_machine(experiment.true_machine, design.model, *design.machine.volume.corners)
    return on_true_machine(design, machine)


def too_large(experiment: Experiment, error: Exception) -> ExperimentError:
    """Return the error of a true machine whose errors prevent readings or a fit."""
    return experiment.refused(("true_machine",), f"{error}; state smaller ones")


def simulated_readings(
    experiment: Experiment, seed: int | None = None, exact: bool = False
) -> Simulated:
    """Return noisy readings of the true machine, of artefacts that differ from their certificates.

    `seed` replaces that of the experiment. `exact` omits all noise and uses nominal artefacts.

    :raises ExperimentError: the true machine's errors are too large for a reading to exist.
    """
    design = lay_out(experiment)
    on_truth, truth = on_stated_machine(experiment, design)
    chosen = experiment.seed if seed is None else seed
    generator = None if exact else np.random.default_rng(np.random.SeedSequence(chosen))
    try:
        if generator is None:
            readings, x = exact_readings(on_truth, truth)
        else:
            from .true_artefacts import true_artefacts

            balls = true_artefacts(design, generator)
            truth = replace(truth, balls=balls, influences=true_influences(design, generator))
            readings, x = noisy_readings(on_truth, truth, generator)
    except NoReadingError as error:
        raise too_large(experiment, error) from None
    return Simulated(design, truth, on_truth.model, readings, x, chosen, generator)
