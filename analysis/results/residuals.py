"""Residuals: differences of the readings from the estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.simulator.computing.rounding import comparable
from ballplate.simulator.design.arrays import Design, Readings, measured, reading_noise
from ballplate.simulator.design.observations.lengths import Lengths, length_deviations
from ballplate.simulator.design.observations.readings import reading_blocks
from ballplate.simulator.estimation.gauss_newton import Solution
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.machines.protocol import Array, Integers

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


def residual_groups(
    design: Design, solution: Solution, x: Array, sigma: float
) -> dict[str, list[dict[str, Any]]]:
    """Root mean squares of the readings' residuals by position, by probe and by axis, as plain
    data in metres and in standard uncertainties, which `sigma` multiplies.
    """
    readings, values, standardised = reading_residuals(design, solution, x)
    is_read = measured(design, readings)
    axis = np.broadcast_to(np.arange(design.dimension), values.shape)
    groups: tuple[tuple[str, Integers, Sequence[str]], ...] = (
        ("position", readings.position[:, None] + 0 * axis, design.positions.names),
        ("probe", readings.probe[:, None] + 0 * axis, design.probes.names),
        ("axis", axis, AXIS_NAMES),
    )
    found = {}
    for word, of_group, names in groups:
        found[f"by_{word}"] = [
            {
                "name": names[k],
                "count": int(own.sum()),
                "root_mean_square": float(np.sqrt((values[own] ** 2).mean())),
                "standardised": float(np.sqrt((standardised[own] ** 2).mean())) / sigma,
            }
            for k in np.unique(of_group).tolist()
            for own in [(of_group == k) & is_read]
            if own.any()
        ]
    return found
