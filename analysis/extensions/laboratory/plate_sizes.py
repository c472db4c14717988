"""Plates that are read larger or smaller than drawn, as where the pitch was stated as the size."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from ballplate.simulator.computing import lstsq
from ballplate.simulator.design import Design, Readings
from ballplate.simulator.geometry import AXIS_NAMES, fit_motion
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Array, Integers

from .length_ratios import IMPOSSIBLE

# Another size explains readings if it leaves no more than this share of their misfit, and if
# factors of all positions agree, and their axes are square, to this.
EXPLAINED = 0.1
AGREEMENT = 0.01

# What is read so many times too large.
UNITS = {
    25.4: "millimetres that are read as inches",
    1 / 25.4: "inches that are read as millimetres",
    10.0: "millimetres that are read as centimetres",
    0.1: "centimetres that are read as millimetres",
    1000.0: "a unit a thousand times smaller",
    0.001: "a unit a thousand times larger",
}


def words_of_size(design: Design, x: Array) -> str:
    """Return the factors by which a plate is larger than drawn in all positions, from scale
    readings x (readings, d), and what to do; empty if there is no such plate.
    """
    readings = design.readings
    for artefact in np.flatnonzero(design.artefacts.is_plate).tolist():
        balls = design.balls.places[design.balls.of(artefact)]
        axes = np.flatnonzero(np.ptp(balls, axis=0))
        factors = np.array(
            [
                factor
                for k, rows, nominal in read_in_positions(design, readings)
                if design.positions.artefact[k] == artefact
                for probe in np.unique(readings.probe[rows])
                for own in [readings.probe[rows] == probe]
                for factor in _factors(nominal[own], nominal[own][:, axes], x[rows[own]])
            ]
        )
        # Comparisons with NaN are false.
        if not len(factors) or not (abs(factors - factors[0]) < AGREEMENT * factors[0]).all():
            continue
        factor, name = np.median(factors, axis=0), design.artefacts.names[artefact]
        if (abs(factor - 1.0) < IMPOSSIBLE).all():
            continue
        parts = [f"{value:#.3g} times as large" for value in factor.tolist()]
        if np.ptp(factor) > AGREEMENT * factor.min():
            parts = [f"{text} in {AXIS_NAMES[k]}" for text, k in zip(parts, axes, strict=True)]
        else:
            del parts[1:]
        for ratio, unit in UNITS.items():
            if (abs(factor / ratio - 1.0) < AGREEMENT).all():
                return (
                    f"all positions fit a {name} {parts[0]}, as if lengths are in {unit}: correct"
                    f" the unit of the readings, or artefacts.{name}"
                )
        pitches = [len(np.unique(np.round(balls[:, k], 9))) - 1 for k in axes]
        is_pitch = (abs(factor / pitches - 1.0) < AGREEMENT).all()
        return (
            f"all positions fit a {name} {listing(parts)}:"
            f" is {'`size` the pitch' if is_pitch else 'its size right'}?"
            f" Correct artefacts.{name}, or the unit of the readings"
        )
    return ""


def _factors(nominal: Array, drawn: Array, places: Array) -> list[Array]:
    """Return the factors along axes of balls `drawn` (m, axes) and read at `places` (m, d): none if
    the readings do not determine them, NaN if no factors explain them.
    """
    drawn, seen = drawn - drawn.mean(axis=0), places - places.mean(axis=0)
    changed, _, rank, _ = lstsq(drawn, seen)
    if len(np.unique(drawn, axis=0)) <= drawn.shape[1] + 1 or rank < drawn.shape[1]:
        return []
    square = changed @ changed.T
    factor = np.sqrt(np.diag(square))
    rotation, origin = fit_motion(nominal, places)
    misfit, left = places - nominal @ rotation.T - origin, drawn @ changed - seen
    is_explained = (left**2).sum() < EXPLAINED**2 * (misfit**2).sum()
    is_square = (abs(square - np.diag(factor**2)) < AGREEMENT * np.outer(factor, factor)).all()
    return [np.where(is_explained and is_square, factor, np.nan)]


def read_in_positions(design: Design, readings: Readings) -> Iterator[tuple[int, Integers, Array]]:
    """Yield for each position with readings its index, the indices (m,) of its readings, and the
    locations (m, d) of their balls in the artefact's frame.
    """
    for k in np.unique(readings.position).tolist():
        rows = np.flatnonzero(readings.position == k)
        yield k, rows, design.balls.places[readings.ball[rows]]
