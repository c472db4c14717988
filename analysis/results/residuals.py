"""Residuals: differences of the readings from the estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.simulator.computing.numerics import comparable
from ballplate.simulator.design.arrays import Design, Readings, measured, reading_noise
from ballplate.simulator.design.observations.lengths import Lengths, length_deviations
from ballplate.simulator.design.observations.readings import reading_blocks
from ballplate.simulator.estimation.gauss_newton import Solution
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.machines.protocol import Array, Integers

# Residuals that a fit reports.
LARGEST = 10


@dataclass(frozen=True)
class Residual:
    """The difference of a plate's reading from the estimate along one axis, in metres and in its
    uncertainties.

    Of a length standard, the excess of a length, named by `axis`; its uncertainty includes the
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
    """Return readings of plates, with residuals (m, d) in metres and in standard uncertainties."""
    chosen = design.plate_readings
    readings = design.readings.select(chosen)
    standardised = reading_blocks(design, solution.state, readings, x[chosen]).residual
    return readings, standardised * reading_noise(design, readings), standardised


def largest_residuals(design: Design, solution: Solution, x: Array) -> tuple[Residual, ...]:
    """Return the largest residuals of readings and of lengths, largest first."""
    chosen = design.plate_readings
    _, apart, residual = reading_residuals(design, solution, x)
    off, uncertainty = length_deviations(design, solution.state, x)
    standardised = np.concatenate([residual.ravel(), off / uncertainty])
    value = np.concatenate([apart.ravel(), off])
    residuals = []
    for index in np.argsort(-comparable(np.abs(standardised)), kind="stable")[:LARGEST].tolist():
        i, axis = divmod(index, design.dimension)
        k = index - residual.size
        reading = int(chosen[i] if k < 0 else design.of(Lengths).first[k])
        ball, words = design.ball_label(design.readings.ball[reading]), "xyz"[axis]
        if k >= 0:
            words, second = "radius", design.of(Lengths).second[k]
            if second >= 0:
                second_ball = design.balls.names[design.readings.ball[second]]
                ball, words = f"{ball}-{second_ball}", "length"
        residuals.append(
            Residual(
                design.positions.names[design.readings.position[reading]],
                ball,
                design.probes.names[design.readings.probe[reading]],
                words,
                float(value[index]),
                float(standardised[index]),
            )
        )
    return tuple(residuals)


def residual_groups(
    design: Design, solution: Solution, x: Array, sigma: float
) -> dict[str, list[dict[str, Any]]]:
    """Return root mean squares of the readings' residuals by position, probe and axis, as plain
    data in metres and in standard uncertainties times `sigma`.
    """
    readings, values, standardised = reading_residuals(design, solution, x)
    is_read = measured(design, readings)
    axis = np.broadcast_to(np.arange(design.dimension), values.shape)
    groups: tuple[tuple[str, Integers, Sequence[str]], ...] = (
        ("position", readings.position[:, None] + 0 * axis, design.positions.names),
        ("probe", readings.probe[:, None] + 0 * axis, design.probes.names),
        ("axis", axis, AXIS_NAMES),
    )
    groups_data = {}
    for word, of_group, names in groups:
        groups_data[f"by_{word}"] = [
            {
                "name": names[k],
                "count": int(members.sum()),
                "root_mean_square": float(np.sqrt((values[members] ** 2).mean())),
                "standardised": float(np.sqrt((standardised[members] ** 2).mean())) / sigma,
            }
            for k in np.unique(of_group).tolist()
            for members in [(of_group == k) & is_read]
            if members.any()
        ]
    return groups_data
