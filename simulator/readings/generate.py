"""Synthetic readings of a stated true machine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..design.arrays import (
    Design,
    Readings,
    State,
    in_sequence,
    influence_shifts,
    locations,
    nominal_state,
    reading_uncertainties,
)
from ..design.observations.joint_lengths import FLAT
from ..design.observations.lengths import Lengths
from ..design.observations.whitening import at_least_exact
from ..machines.protocol import Array, ErrorModel, Integers
from ..machines.truth import TrueMachine


class NoReadingError(ValueError):
    """The true machine's errors are so large that no scale reading belongs to some location."""


def on_true_machine(design: Design, machine: TrueMachine) -> tuple[Design, State]:
    """The design as drawn on the true machine, whose error model may be another than the
    design's.
    """
    return replace(design, model=machine.model), replace(nominal_state(design), a=machine.a)


def scale_readings(model: ErrorModel, true: Array, a: Array, p: Array) -> Array:
    """Scale readings x (m, d) with x + e(x, a, p) = `true`, exact to rounding.

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
    """Scale readings (m, d) without noise, of a true machine with another error model than the
    design's if one is given.

    :raises NoReadingError: as `scale_readings`.
    """
    model = model or design.model
    p, true = truth.probes[readings.probe], locations(design, truth, readings)
    x = scale_readings(model, true, truth.a, p)
    # Each time what the scales say decides a ten-thousandth of the shift at the most.
    for _ in range(5 if design.influences else 0):
        shift, _ = influence_shifts(design, truth, readings, x)
        x = scale_readings(model, true + shift, truth.a, p)
    return x


def exact_readings(design: Design, truth: State) -> tuple[Readings, Array]:
    """Readings of a design, one row for each repeat, without noise: (rows, d) metres."""
    readings = in_sequence(design.readings.expanded(), design.influences)
    return readings, true_readings(design, truth, readings)


def noisy_readings(
    design: Design, truth: State, generator: np.random.Generator
) -> tuple[Readings, Array]:
    """The same with noise of the readings' standard uncertainties added to each co-ordinate."""
    readings, x = exact_readings(design, truth)
    noise = design.noise.draw(generator, x.shape, readings.position, 0)
    return readings, x + noise * reading_uncertainties(design, readings)


def true_influences(design: Design, generator: np.random.Generator) -> Array:
    """True values (p,) of influence quantities, drawn from what is stated of them; of those that
    are unknown, the stated values.
    """
    u = np.array([one.uncertainty for one in design.influence_parameters], float)
    errors = np.where(np.isfinite(u), u, 0.0) * generator.standard_normal(len(u))
    return np.asarray(design.influence_values + errors)


# In one piece: random numbers are drawn in an order on which what a seed gives depends.
def true_artefacts(design: Design, generator: np.random.Generator) -> Array:
    """True balls (n, d) of artefacts whose certificates are the design's, each item wrong by its
    uncertainty.

    Of all artefacts that differ so from their certificate, the nearest to the drawing; where there
    are more certified items than can vary independently, as nearly as a real artefact can. The
    length of a bar moves the second of its balls along the line between the two, that of a Bryan
    gauge the places of its ball; lengths that share balls move these together. Lengths without
    certificates are as drawn.
    """
    balls = design.balls.places.copy()
    known = [one for one in design.observations if one.balls.shape[1]]
    rows = [one.rows(design, nominal_state(design), None) for one in known]
    d, off = design.dimension, np.concatenate([np.zeros(0), *(one.residual for one in rows)])
    sought = np.split(
        generator.standard_normal(len(off)) - off, np.cumsum([len(one) for one in known])
    )
    # Balls that nothing ties to others vary along each axis by themselves, however many there are.
    oblique = [one.balls[one.along < 0].ravel() for one in known]
    ends = np.unique(np.concatenate([np.zeros(0, np.int64), *oblique]))
    among = np.zeros(len(balls), np.int64)
    among[ends] = np.arange(len(ends))
    pull, stiffness = np.zeros(balls.shape), np.zeros(balls.shape)
    together, sides = [np.zeros((0, d * len(ends)))], [np.zeros(0)]
    for one, of_one, side in zip(known, rows, sought, strict=False):
        alone = np.flatnonzero((one.along >= 0) & ~np.isin(one.balls[:, 0], ends))
        place = one.balls[alone, 0], one.along[alone]
        slope = of_one.by_ball[alone, 0, place[1]]
        np.add.at(pull, place, slope * side[alone])
        np.add.at(stiffness, place, slope**2)
        others = np.setdiff1d(np.arange(len(one)), alone)
        if len(ends):
            columns = d * among[one.balls[others]][:, :, None] + np.arange(d)
            together.append(np.zeros((len(others), d * len(ends))))
            at = np.broadcast_to(np.arange(len(others))[:, None, None], columns.shape)
            np.add.at(together[-1], (at, columns), of_one.by_ball[others])
            sides.append(side[others])
    balls += np.divide(pull, stiffness, out=np.zeros(balls.shape), where=stiffness > 0)
    if len(ends):
        tied = np.concatenate(together)
        used = np.flatnonzero(tied.any(axis=0))
        move = np.zeros(tied.shape[1])
        move[used] = np.linalg.lstsq(tied[:, used], np.concatenate(sides), rcond=None)[0]
        balls[ends] += move.reshape(-1, d)
    given = design.of(Lengths)
    given = given.select(given.is_known)
    pivoted = given.select(given.to_pivot)
    for certificate in np.unique(pivoted.certificate):
        k = int(np.flatnonzero(pivoted.certificate == certificate)[0])
        own = design.balls.artefact == design.balls.artefact[design.readings.ball[pivoted.first[k]]]
        true = pivoted.value[k] + pivoted.uncertainty[k] * generator.standard_normal()
        balls[own] *= true / np.sqrt((balls[own] ** 2).sum(axis=1))[:, None]
    given = given.select(~given.to_pivot)
    ends = np.stack([design.readings.ball[given.first], design.readings.ball[given.second]])
    pairs, first = np.unique(ends, axis=1, return_index=True)
    ball, times = np.unique(pairs, return_counts=True)
    # Of artefacts whose lengths share balls.
    shared = np.isin(design.balls.artefact[pairs[0]], design.balls.artefact[ball[times > 1]])
    if shared.any():
        of_shared = given.select(first[shared])
        wanted = of_shared.value + of_shared.uncertainty * generator.standard_normal(len(of_shared))
        uncertainty = at_least_exact(of_shared.uncertainty)
        balls += _moved_by_lengths(balls, pairs[:, shared], wanted, uncertainty)
        pairs, first = pairs[:, ~shared], first[~shared]
    for (one, other), k in zip(pairs.T.tolist(), first.tolist(), strict=True):
        between = balls[other] - balls[one]
        length = float(np.sqrt(between @ between))
        true = given.value[k] + given.uncertainty[k] * generator.standard_normal()
        balls[other] += between * (true / length - 1.0)
    return balls


def _moved_by_lengths(balls: Array, pairs: Integers, wanted: Array, uncertainty: Array) -> Array:
    """The least displacements (n, d) of balls that bring the lengths of `pairs` (2, m) nearest to
    those wanted (m,).
    """
    ends, place = np.unique(pairs, return_inverse=True)
    place = place.reshape(pairs.shape)
    moved = np.zeros_like(balls)
    for _ in range(2):
        between = balls[pairs[0]] + moved[pairs[0]] - balls[pairs[1]] - moved[pairs[1]]
        length = np.sqrt((between**2).sum(axis=1))
        rows = np.zeros((len(wanted), len(ends), balls.shape[1]))
        rows[np.arange(len(wanted)), place[0]] = between / (length * uncertainty)[:, None]
        rows[np.arange(len(wanted)), place[1]] = -rows[np.arange(len(wanted)), place[0]]
        step = np.linalg.lstsq(
            rows.reshape(len(wanted), -1), (wanted - length) / uncertainty, rcond=FLAT
        )[0]
        moved[ends] += step.reshape(len(ends), -1)
    return moved


def noisy_certificate(
    design: Design, truth: State, generator: np.random.Generator, model: ErrorModel | None = None
) -> Design:
    """The design with calibration values, of length standards as well, and priors, drawn about
    those of the truth.

    `model` is the error model of the true machine where it is not the design's.
    """
    drawn = []
    for one in design.observations:
        true = one.true_values(design, truth, model or design.model)
        drawn.append(one.given(value=true + one.errors(generator, 1)[0]))
    return design.observed(*drawn)
