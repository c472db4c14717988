"""Synthetic readings of a stated true machine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..design.arrays import Design, State, locations, nominal_state, reading_uncertainties
from ..design.joint_lengths import FLAT
from ..design.observations import Priors, Readings
from ..estimation.observations import distance_rows, prior_values
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


def exact_readings(design: Design, truth: State) -> tuple[Readings, Array]:
    """Readings of a design, one row for each repeat, without noise: (rows, d) metres."""
    readings = design.readings.expanded()
    p = truth.probes[readings.probe]
    return readings, scale_readings(design.model, locations(design, truth, readings), truth.a, p)


def noisy_readings(
    design: Design, truth: State, generator: np.random.Generator
) -> tuple[Readings, Array]:
    """The same with normal noise of the readings' standard uncertainties added to each
    co-ordinate.
    """
    readings, x = exact_readings(design, truth)
    return readings, x + generator.standard_normal(x.shape) * reading_uncertainties(
        design, readings
    )


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
    tied = distance_rows(design, nominal_state(design))
    known = design.coordinates
    stated = design.dimension * known.ball + known.axis
    off = np.concatenate(
        [tied.residual, (balls[known.ball, known.axis] - known.value) / known.uncertainty]
    )
    wanted = generator.standard_normal(len(off)) - off
    # Balls that no distance ties to others vary by themselves, however many there are.
    ends = np.unique(np.concatenate([design.distances.first, design.distances.second]))
    alone = ~np.isin(known.ball, ends)
    weight = 1.0 / known.uncertainty[alone]
    pull = np.bincount(stated[alone], weight * wanted[len(tied.residual) :][alone], balls.size)
    stiffness = np.bincount(stated[alone], weight**2, balls.size)
    balls += np.divide(pull, stiffness, out=np.zeros(balls.size), where=stiffness > 0).reshape(
        balls.shape
    )
    among = np.zeros(len(design.balls.places), np.int64)
    among[ends] = np.arange(len(ends))
    together = ~np.concatenate([np.zeros(len(tied.residual), bool), alone])
    if len(tied.residual):
        rows = np.zeros((int(together.sum()), design.dimension * len(ends)))
        at = np.arange(len(tied.residual))
        for axis in range(design.dimension):
            rows[at, design.dimension * among[design.distances.first] + axis] = tied.derivative[
                :, axis
            ]
            rows[at, design.dimension * among[design.distances.second] + axis] = -tied.derivative[
                :, axis
            ]
        at = len(at) + np.arange(len(rows) - len(at))
        rows[at, design.dimension * among[known.ball[~alone]] + known.axis[~alone]] = (
            1.0 / known.uncertainty[~alone]
        )
        used = np.flatnonzero(rows.any(axis=0))
        move = np.zeros(rows.shape[1])
        move[used] = np.linalg.lstsq(rows[:, used], wanted[together], rcond=None)[0]
        balls[ends] += move.reshape(-1, design.dimension)
    given = design.lengths
    given = given.select(np.ones(len(given), bool) if given.free is None else given.free < 0)
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
        balls += _moved_by_lengths(balls, pairs[:, shared], wanted, of_shared.uncertainty)
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


def true_lengths(design: Design, truth: State) -> Array:
    """Lengths (m,) of the design's standards as they truly are; the same wherever one certificate's
    is read.
    """
    given = design.lengths
    if not len(given):
        return given.value
    there = locations(design, truth, design.readings)
    pivot = truth.origins[design.readings.position[given.first]]
    between = there[given.first] - np.where(
        given.to_pivot[:, None], pivot, there[np.maximum(given.second, 0)]
    )
    along = np.abs(np.einsum("md,md->m", given.direction, between))
    length = np.where(given.projected, along, np.sqrt((between**2).sum(axis=1)))
    _, first = np.unique(given.certificate, return_index=True)
    return np.asarray(length[first][given.certificate])


def true_priors(design: Design, model: ErrorModel, truth: State) -> Priors:
    """The design's priors with the values of the truth, whose error model is `model`.

    Priors about an error model that is not the true machine's stay what they are.
    """
    priors = design.priors
    if not len(priors):
        return priors
    if model == design.model:
        return replace(priors, value=prior_values(design, truth))
    of_model = (priors.position < 0) & (priors.probe < 0)
    elsewhere = replace(truth, a=np.zeros(priors.by_model.shape[1]))
    return replace(priors, value=np.where(of_model, priors.value, prior_values(design, elsewhere)))


def noisy_certificate(
    design: Design, truth: State, generator: np.random.Generator, model: ErrorModel | None = None
) -> Design:
    """The design with calibration values, of length standards as well, and priors, drawn about
    those of the truth.

    `model` is the error model of the true machine where it is not the design's.
    """
    distances, coordinates, lengths = design.distances, design.coordinates, design.lengths
    difference = truth.balls[distances.first] - truth.balls[distances.second]
    difference *= np.arange(design.dimension) < distances.dimensions[:, None]
    true_distance = np.sqrt((difference**2).sum(axis=1))
    true_coordinate = truth.balls[coordinates.ball, coordinates.axis]
    priors = true_priors(design, model or design.model, truth)

    def drawn(value: Array, uncertainty: Array) -> Array:
        return np.asarray(value + uncertainty * generator.standard_normal(len(uncertainty)))

    # One error for each certificate, wherever it is read.
    error = generator.standard_normal(int(lengths.certificate.max(initial=-1)) + 1)[
        lengths.certificate
    ]
    return replace(
        design,
        distances=replace(distances, value=drawn(true_distance, distances.uncertainty)),
        coordinates=replace(coordinates, value=drawn(true_coordinate, coordinates.uncertainty)),
        lengths=replace(lengths, value=true_lengths(design, truth) + lengths.uncertainty * error),
        priors=replace(priors, value=drawn(priors.value, priors.uncertainty)),
    )
