"""Smooth errors: patterns of residuals for an incomplete error model or a drift."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from ballplate.simulator.design import Design, State, locations, rotation_sensitivity
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import Array
from numpy.polynomial import legendre

from .bias_patterns import LinearisedDesign
from .hat import row_count

# Scale readings closer than this (m) count as the same place on a scale.
SAME_PLACE = 1e-3

# Places on a scale that each have a value of their own; of more, waves up to so many half periods.
MOST_PLACES, WAVES = 60, 20

# Degrees of polynomials along one axis with levers, of those that turn probes, and of those in all
# co-ordinates.
ALONG, OF_PROBES, TOGETHER = 7, 4, 4

# Half periods of a drift over all readings.
DRIFT = 6


# In words what an error is, and its displacements (readings, d, k).
Displacements = Iterator[tuple[str, Array]]


@dataclass(frozen=True)
class Smooth:
    """Biases (rows, k) that together are one smooth error, and in words what it is."""

    words: str
    columns: Array


def smooth_errors(design: Design, state: State) -> Iterator[Smooth]:
    """All smooth errors that are looked for, at a state."""
    at = LinearisedDesign(design, state, None)
    # Not at the readings themselves: where these are at few places on a scale, functions of them
    # differ by their noise, and would explain it.
    drawn = replace(state, balls=design.balls.places)
    readings = design.readings
    scales = locations(design, drawn, readings) - state.probes[readings.probe]
    for build in (_on_scales, _along_axes, _of_probes, _in_space, _in_time):
        for words, displacement in build(design, state, scales):
            yield Smooth(words, _rows(at, displacement))


def _on_scales(design: Design, state: State, x: Array) -> Displacements:
    """Each component as any function of one scale reading."""
    letters = AXIS_NAMES[: design.dimension]
    for axis, letter in enumerate(letters):
        values = _places(x[:, axis])
        for component, other in enumerate(letters):
            displacement = values[:, None, :] * np.eye(design.dimension)[component][:, None]
            yield f"an error in {other} that depends on {letter}", displacement


def _along_axes(design: Design, state: State, x: Array) -> Displacements:
    """All components as polynomials of one scale reading, and of the others as levers of
    rotations.
    """
    t = _fractions(x)
    for axis, letter in enumerate(AXIS_NAMES[: design.dimension]):
        along = legendre.legvander(t[:, axis], ALONG)
        levers = np.column_stack([np.ones(len(t)), np.delete(t, axis, axis=1)])
        values = np.asarray((along[:, :, None] * levers[:, None, :]).reshape(len(t), -1), float)
        yield (
            f"displacements and rotations that depend on {letter}",
            _in_all_directions(values, design.dimension),
        )


def _of_probes(design: Design, state: State, x: Array) -> Displacements:
    """Rotations that act on the probes' offsets, as polynomials of one scale reading."""
    t, letters = _fractions(x), AXIS_NAMES[: design.dimension]
    turned = rotation_sensitivity(state.probes[design.readings.probe])
    for axis, letter in enumerate(letters):
        along = legendre.legvander(t[:, axis], OF_PROBES)
        for k in range(turned.shape[2]):
            about = letters[k] if design.dimension == 3 else "z"
            words = f"a rotation of the probes about {about} that depends on {letter}"
            yield words, turned[:, :, [k]] * along[:, None, :]


def _in_space(design: Design, state: State, x: Array) -> Displacements:
    """All components as polynomials of all co-ordinates."""
    t, d = _fractions(x), design.dimension
    by_axis = [legendre.legvander(t[:, axis], TOGETHER) for axis in range(d)]
    terms = []
    for powers in product(range(TOGETHER + 1), repeat=d):
        if 0 < sum(powers) <= TOGETHER:
            factors = [one[:, power] for one, power in zip(by_axis, powers, strict=True)]
            terms.append(np.prod(factors, axis=0))
    yield (
        "an error that depends on several co-ordinates together",
        _in_all_directions(np.stack(terms, axis=1), d),
    )


def _in_time(design: Design, state: State, x: Array) -> Displacements:
    """Drifts over all readings and, alike in all positions or not, within each."""
    time, within = np.linspace(0.0, 1.0, len(x)), _time_within(design)
    waves = np.cos(np.pi * np.arange(1, DRIFT + 1) * time[:, None])
    for values in (time[:, None], waves):
        yield "a drift over all readings", _in_all_directions(values, design.dimension)
    for values in (within.sum(axis=1)[:, None], within):
        yield "a drift within each position", _in_all_directions(values, design.dimension)


def _fractions(x: Array) -> Array:
    """Scale readings (m, d) between -1 and 1."""
    low, extent = x.min(axis=0), np.ptp(x, axis=0)
    return 2.0 * (x - low) / np.where(extent > 0.0, extent, 1.0) - 1.0


def _places(x: Array) -> Array:
    """Functions (m, k) of one scale reading (m,), as general as the readings permit."""
    order = np.argsort(x, kind="stable")
    place = np.zeros(len(x), np.int64)
    place[order] = np.cumsum(np.append(0, np.diff(x[order]) > SAME_PLACE))
    if place.max(initial=0) < MOST_PLACES:
        return np.eye(int(place.max(initial=0)) + 1)[place]
    t = 0.5 * (_fractions(x[:, None])[:, 0] + 1.0)
    return np.cos(np.pi * np.arange(1, WAVES + 1) * t[:, None])


def _time_within(design: Design) -> Array:
    """Time (readings, positions) in each position, between -1 and 1, by the order of the
    readings.
    """
    position = design.readings.position
    within = np.zeros((len(position), len(design.positions.names)))
    for k in np.unique(position):
        rows = np.flatnonzero(position == k)
        within[rows, k] = np.linspace(-1.0, 1.0, len(rows)) if len(rows) > 1 else 0.0
    return within


def _in_all_directions(values: Array, d: int) -> Array:
    """Displacements (m, d, d k) along each axis by functions (m, k)."""
    found = np.zeros((len(values), d, d, values.shape[1]))
    for axis in range(d):
        found[:, axis, axis] = values
    return found.reshape(len(values), d, -1)


def _rows(at: LinearisedDesign, displacement: Array) -> Array:
    """Biases (rows, k) of all observations by displacements (readings, d, k) of all readings."""
    k = displacement.shape[2]
    found = np.zeros((row_count(at.design), k))
    found[at.places["reading"]] = (at.weight[:, :, None] * displacement[at.chosen]).reshape(-1, k)
    found[at.places["length"]] = at.white.whitened(at.along_lengths(displacement))
    return found
