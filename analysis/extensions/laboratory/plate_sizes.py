"""Plates that are read larger or smaller than drawn, as where the pitch was stated as the size."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.design import Design, read_in_positions
from ballplate.simulator.geometry import AXIS_NAMES, fit_motion
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Array

from .gross_errors import FLAT

# Another size explains readings if it leaves no more than this share of their misfit, and if
# factors of all positions agree, and their axes are square, to this.
EXPLAINED = 0.1
AGREEMENT = 0.01


def words_of_size(design: Design, x: Array) -> str:
    """Return the factors by which a plate is larger than drawn in all positions, from scale
    readings x (readings, d), and what to do; empty if there is no such plate.
    """
    places = x + design.probes.offsets[design.readings.probe]
    factors_of: dict[int, list[Array]] = {}
    for k, rows, nominal in read_in_positions(design, design.readings):
        artefact = int(design.positions.artefact[k])
        if design.artefacts.is_plate[artefact]:
            factors_of.setdefault(artefact, []).extend(_factors(nominal, places[rows]))
    for artefact, factors in factors_of.items():
        balls = design.balls.places[design.balls.of(artefact)]
        axes = _extended(balls)
        same_axes = [of_position for of_position in factors if len(of_position) == len(axes)]
        if not same_axes or len(same_axes) < len(factors):
            continue
        factor = np.median(same_axes, axis=0)
        if not (abs(np.array(same_axes) / factor - 1.0) < AGREEMENT).all():
            continue
        parts = [f"{value:#.3g} times as large" for value in factor.tolist()]
        if np.ptp(factor) < AGREEMENT * factor.min():
            parts = parts[:1]
        else:
            parts = [f"{text} in {AXIS_NAMES[k]}" for text, k in zip(parts, axes, strict=True)]
        pitches = [len(np.unique(np.round(balls[:, k], 9))) - 1 for k in axes]
        is_pitch = (abs(factor / pitches - 1.0) < AGREEMENT).all()
        name = design.artefacts.names[artefact]
        question = "is `size` the pitch?" if is_pitch else "is its size right?"
        return (
            f"all positions fit a {name} {listing(parts)}: {question} Correct artefacts.{name}, or"
            " the unit of the readings"
        )
    return ""


def _extended(balls: Array) -> list[int]:
    """Return the axes along which balls (m, d) are at different places."""
    extent = np.ptp(balls, axis=0)
    return np.flatnonzero(extent > FLAT * extent.max()).tolist()


def _factors(nominal: Array, places: Array) -> list[Array]:
    """Return the factors along the axes of balls (m, d) read at `places` (m, d): none if the
    readings do not determine them, an empty array if no factors explain them.
    """
    axes = _extended(nominal)
    drawn, seen = nominal[:, axes] - nominal[:, axes].mean(axis=0), places - places.mean(axis=0)
    changed, _, rank, _ = np.linalg.lstsq(drawn, seen, rcond=FLAT)
    if rank < len(axes) or len(np.unique(nominal, axis=0)) <= len(axes) + 1:
        return []
    square = changed @ changed.T
    factor = np.sqrt(np.diag(square))
    rotation, origin = fit_motion(nominal, places)
    misfit = places - nominal @ rotation.T - origin
    left = drawn @ changed - seen
    is_explained = (left**2).sum() < EXPLAINED**2 * (misfit**2).sum()
    is_square = (abs(square / np.outer(factor, factor) - np.eye(len(axes))) < AGREEMENT).all()
    return [factor if is_explained and is_square else np.zeros(0)]
