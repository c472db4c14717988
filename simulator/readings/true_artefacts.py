"""Artefacts that differ from their certificates, and their certificates with errors."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing.numerics import lstsq
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.balls import slopes_apart
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.observations.whitening import at_least_exact
from ballplate.simulator.design.state import State
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.machines.protocol import ErrorModel


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
    # The certified values are kept, and the artefact differs from them by drawn errors: its values
    # are the certified less the nominal ones, and an error. Least squares of least length then give
    # the displacements from the nominal artefact, so that what no certificate states stays nominal.
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
    # Lengths are non-linear in displacements. The second pass leaves an error of second order of a
    # small step.
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
