"""Residuals: differences of the readings from the estimate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.rounding import comparable
from ballplate.simulator.design.arrays import Design, Readings, reading_noise
from ballplate.simulator.design.observations.lengths import Lengths, length_deviations
from ballplate.simulator.design.observations.readings import reading_blocks
from ballplate.simulator.estimation.gauss_newton import Solution
from ballplate.simulator.machines.protocol import Array

# Residuals that a fit names.
LARGEST = 10


@dataclass(frozen=True)
class Residual:
    """What a reading of a plate differs by from the estimate along one axis, in metres and in its
    uncertainties.

    Of a length standard the length, as `axis`, is too long by so much; its uncertainty includes the
    certificate's.
    """

    position: str
    ball: str
    probe: str
    axis: str
    value: float
    standardised: float


def reading_residuals(
    design: Design, solution: Solution, x: Array
) -> tuple[Readings, Array, Array]:
    """Readings of plates, with what each differs by from the estimate, (m, d) metres and in
    standard uncertainties.
    """
    chosen = design.plate_readings
    readings = design.readings.select(chosen)
    standardised = reading_blocks(design, solution.state, readings, x[chosen]).residual
    return readings, standardised * reading_noise(design, readings), standardised


def largest_residuals(design: Design, solution: Solution, x: Array) -> tuple[Residual, ...]:
    """The largest residuals of readings and of lengths, largest first."""
    chosen = design.plate_readings
    _, apart, residual = reading_residuals(design, solution, x)
    off, uncertainty = length_deviations(design, solution.state, x)
    standardised = np.concatenate([residual.ravel(), off / uncertainty])
    value = np.concatenate([apart.ravel(), off])
    found = []
    for place in np.argsort(-comparable(np.abs(standardised)), kind="stable")[:LARGEST].tolist():
        i, axis = divmod(place, design.dimension)
        k = place - residual.size
        reading = int(chosen[i] if k < 0 else design.of(Lengths).first[k])
        ball, words = design.ball_label(design.readings.ball[reading]), "xyz"[axis]
        if k >= 0:
            words, second = "radius", design.of(Lengths).second[k]
            if second >= 0:
                other = design.balls.names[design.readings.ball[second]]
                ball, words = f"{ball}-{other}", "length"
        found.append(
            Residual(
                design.positions.names[design.readings.position[reading]],
                ball,
                design.probes.names[design.readings.probe[reading]],
                words,
                float(value[place]),
                float(standardised[place]),
            )
        )
    return tuple(found)
