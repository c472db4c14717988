"""Synthetic readings of a true machine."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing.numerics import lstsq
from ballplate.simulator.design.arrays import (
    Design,
    Readings,
    State,
    in_sequence,
    influence_shifts,
    locations,
    nominal_state,
    reading_uncertainties,
)
from ballplate.simulator.design.observations.balls import slopes_apart
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.observations.whitening import at_least_exact
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.protocol import Array, ErrorModel, Integers
from ballplate.simulator.machines.truth import TrueMachine, true_machine


class NoReadingError(ValueError):
    """The true machine's errors are so large that no scale reading belongs to some location."""


def on_true_machine(design: Design, machine: TrueMachine) -> tuple[Design, State]:
    """Return the nominal design on the true machine, whose error model may be another."""
    return replace(design, model=machine.model), replace(nominal_state(design), a=machine.a)


def scale_readings(model: ErrorModel, true: Array, a: Array, p: Array) -> Array:
    """Return scale readings x (m, d) with x + e(x, a, p) = `true`, exact to rounding.

    :raises NoReadingError: the errors are too large for the iteration x <- true - e(x) to settle.
    """
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
    """Return `exact_readings` with noise of the readings' standard uncertainties."""
    readings, x = exact_readings(design, truth)
    noise = design.noise.draw(generator, x.shape, readings.position, 0)
    return readings, x + noise * reading_uncertainties(design, readings)


def true_influences(design: Design, generator: np.random.Generator) -> Array:
    """Draw true values (p,) of influence quantities about the stated ones; unknown ones keep their
    stated values.
    """
    u = np.array([parameter.uncertainty for parameter in design.influence_parameters], float)
    errors = np.where(np.isfinite(u), u, 0.0) * generator.standard_normal(len(u))
    return design.influence_values + errors


# In one piece: the order in which random numbers are drawn determines a seed's values.
def true_artefacts(design: Design, generator: np.random.Generator) -> Array:
    """Draw true balls (n, d) of artefacts, each certified item in error by its uncertainty.

    Of all artefacts that differ so from their certificate, this is the nearest to the nominal one;
    more certified items than can vary independently are met by least squares. The length of a bar
    moves its second ball along the line between its two, that of a Bryan gauge its ball; lengths
    that share balls move these together. Artefacts without certificates are nominal.
    """
    balls = design.balls.places.copy()
    certified = [kind for kind in design.observations if kind.balls.shape[1]]
    rows = [kind.rows(design, nominal_state(design), None) for kind in certified]
    d = design.dimension
    sought = [
        kind.whitened(kind.errors(generator, 1)[0]) - block.residual
        for kind, block in zip(certified, rows, strict=True)
    ]
    # Balls without oblique items vary along each axis separately, which needs no large matrix.
    oblique = [kind.balls[kind.along < 0].ravel() for kind in certified]
    ends = np.unique(np.concatenate([np.zeros(0, np.int64), *oblique]))
    among = np.zeros(len(balls), np.int64)
    among[ends] = np.arange(len(ends))
    pull, stiffness = np.zeros(balls.shape), np.zeros(balls.shape)
    together, sides = [np.zeros((0, d * len(ends)))], [np.zeros(0)]
    for kind, block, side in zip(certified, rows, sought, strict=True):
        separate = np.flatnonzero((kind.along >= 0) & ~np.isin(kind.balls[:, 0], ends))
        coordinate = kind.balls[separate, 0], kind.along[separate]
        slope = block.by_ball[separate, 0, coordinate[1]]
        np.add.at(pull, coordinate, slope * side[separate])
        np.add.at(stiffness, coordinate, slope**2)
        joint = np.setdiff1d(np.arange(len(kind)), separate)
        if len(ends):
            columns = d * among[kind.balls[joint]][:, :, None] + np.arange(d)
            together.append(np.zeros((len(joint), d * len(ends))))
            row = np.broadcast_to(np.arange(len(joint))[:, None, None], columns.shape)
            slopes = slopes_apart(design, kind, block.by_ball)[joint]
            np.add.at(together[-1], (row, columns), slopes)
            sides.append(side[joint])
    balls += np.divide(pull, stiffness, out=np.zeros(balls.shape), where=stiffness > 0)
    if len(ends):
        tied = np.concatenate(together)
        used = np.flatnonzero(tied.any(axis=0))
        move = np.zeros(tied.shape[1])
        move[used] = lstsq(tied[:, used], np.concatenate(sides), rcond=None)[0]
        balls[ends] += move.reshape(-1, d)
    lengths = design.of(Lengths)
    lengths = lengths.select(lengths.is_known)
    pivoted = lengths.select(lengths.to_pivot)
    for certificate in np.unique(pivoted.certificate):
        k = int(np.flatnonzero(pivoted.certificate == certificate)[0])
        gauge = design.balls.artefact[design.readings.ball[pivoted.first[k]]]
        on_gauge = design.balls.artefact == gauge
        true = pivoted.value[k] + pivoted.uncertainty[k] * generator.standard_normal()
        balls[on_gauge] *= true / np.sqrt((balls[on_gauge] ** 2).sum(axis=1))[:, None]
    lengths = lengths.select(~lengths.to_pivot)
    ends = np.stack([design.readings.ball[lengths.first], design.readings.ball[lengths.second]])
    pairs, first = np.unique(ends, axis=1, return_index=True)
    ball, times = np.unique(pairs, return_counts=True)
    # Lengths of artefacts whose lengths share balls.
    shared = np.isin(design.balls.artefact[pairs[0]], design.balls.artefact[ball[times > 1]])
    if shared.any():
        of_shared = lengths.select(first[shared])
        wanted = of_shared.value + of_shared.uncertainty * generator.standard_normal(len(of_shared))
        uncertainty = at_least_exact(of_shared.uncertainty)
        balls += _moved_by_lengths(balls, pairs[:, shared], wanted, uncertainty)
        pairs, first = pairs[:, ~shared], first[~shared]
    for (start, end), k in zip(pairs.T.tolist(), first.tolist(), strict=True):
        between = balls[end] - balls[start]
        length = float(np.sqrt(between @ between))
        true = lengths.value[k] + lengths.uncertainty[k] * generator.standard_normal()
        balls[end] += between * (true / length - 1.0)
    return balls


def _moved_by_lengths(balls: Array, pairs: Integers, wanted: Array, uncertainty: Array) -> Array:
    """Return the least displacements (n, d) of balls that bring the lengths of `pairs` (2, m)
    nearest to those `wanted` (m,).
    """
    from ballplate.simulator.design.observations.joint_lengths import FLAT

    ends, index = np.unique(pairs, return_inverse=True)
    index = index.reshape(pairs.shape)
    moved = np.zeros_like(balls)
    for _ in range(2):
        between = balls[pairs[0]] + moved[pairs[0]] - balls[pairs[1]] - moved[pairs[1]]
        length = np.sqrt((between**2).sum(axis=1))
        rows = np.zeros((len(wanted), len(ends), balls.shape[1]))
        rows[np.arange(len(wanted)), index[0]] = between / (length * uncertainty)[:, None]
        rows[np.arange(len(wanted)), index[1]] = -rows[np.arange(len(wanted)), index[0]]
        step = lstsq(rows.reshape(len(wanted), -1), (wanted - length) / uncertainty, rcond=FLAT)[0]
        moved[ends] += step.reshape(len(ends), -1)
    return moved


def noisy_certificate(
    design: Design, truth: State, generator: np.random.Generator, model: ErrorModel | None = None
) -> Design:
    """Return the design with values of calibrations, length standards and priors drawn about the
    truth.

    `model` is the error model of the true machine, by default the design's.
    """
    drawn = []
    for kind in design.observations:
        true = kind.true_values(design, truth, model or design.model)
        drawn.append(kind.given(value=true + kind.errors(generator, 1)[0]))
    return design.observed(*drawn)


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
            balls = true_artefacts(design, generator)
            truth = replace(truth, balls=balls, influences=true_influences(design, generator))
            readings, x = noisy_readings(on_truth, truth, generator)
    except NoReadingError as error:
        raise too_large(experiment, error) from None
    return Simulated(design, truth, on_truth.model, readings, x, chosen, generator)
