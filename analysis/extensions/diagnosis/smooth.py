"""Smooth errors: patterns of residuals for an incomplete error model or a drift."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from ballplate.simulator.design import Design, State, locations, rotation_sensitivity
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import Array
from numpy.polynomial import legendre

# Scale readings closer than this (m) are at the same location.
SAME_PLACE = 1e-3

# Largest number of locations with values of their own; of more, half periods of waves.
MOST_PLACES, WAVES = 60, 20

# Degrees of polynomials along one axis with levers, of those that turn probes, and of those in all
# co-ordinates.
ALONG, OF_PROBES, TOGETHER = 7, 4, 4

# Half periods of a drift over all readings.
DRIFT = 6


# Descriptions of errors with their displacements (readings, d, k).
Displacements = Iterator[tuple[str, Array]]


def smooth_errors(design: Design, state: State) -> Iterator[tuple[str, Array, bool]]:
    """Return all smooth errors to search, at a state: a description, displacements (readings, d, k)
    of all readings, and whether they are those of a drift.
    """
    # Not at the readings themselves: if they are at few locations on a scale, functions of their
    # noise would explain it.
    drawn = replace(state, balls=design.balls.places)
    readings = design.readings
    scales = locations(design, drawn, readings) - state.probes[readings.probe]
    for build in (_on_scales, _along_axes, _of_probes, _in_space, _in_time):
        for words, displacement in build(design, state, scales):
            yield words, displacement, build is _in_time


def _on_scales(design: Design, state: State, x: Array) -> Displacements:
    """Each component as any function of one scale reading."""
    letters = AXIS_NAMES[: design.dimension]
    for axis, letter in enumerate(letters):
        values = _location_functions(x[:, axis])
        for component, component_letter in enumerate(letters):
            displacement = values[:, None, :] * np.eye(design.dimension)[component][:, None]
            yield f"an error in {component_letter} that depends on {letter}", displacement


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
            factors = [
                polynomials[:, power] for polynomials, power in zip(by_axis, powers, strict=True)
            ]
            terms.append(np.prod(factors, axis=0))
    yield (
        "an error that depends on several co-ordinates together",
        _in_all_directions(np.stack(terms, axis=1), d),
    )


def _in_time(design: Design, state: State, x: Array) -> Displacements:
    """Drifts over all readings, and within each position, common to all positions or not."""
    time, within = np.linspace(0.0, 1.0, len(x)), _time_within(design)
    waves = np.cos(np.pi * np.arange(1, DRIFT + 1) * time[:, None])
    for values in (time[:, None], waves):
        yield "a drift over all readings", _in_all_directions(values, design.dimension)
    for values in (within.sum(axis=1)[:, None], within):
        yield "a drift within each position", _in_all_directions(values, design.dimension)


def _fractions(x: Array) -> Array:
    """Return scale readings (m, d) scaled to -1 to 1."""
    low, extent = x.min(axis=0), np.ptp(x, axis=0)
    return 2.0 * (x - low) / np.where(extent > 0.0, extent, 1.0) - 1.0


def _location_functions(x: Array) -> Array:
    """Return functions (m, k) of one scale reading (m,), as general as the readings permit."""
    order = np.argsort(x, kind="stable")
    location = np.zeros(len(x), np.int64)
    location[order] = np.cumsum(np.append(0, np.diff(x[order]) > SAME_PLACE))
    if location.max() < MOST_PLACES:
        return np.eye(int(location.max()) + 1)[location]
    t = 0.5 * (_fractions(x[:, None])[:, 0] + 1.0)
    return np.cos(np.pi * np.arange(1, WAVES + 1) * t[:, None])


def _time_within(design: Design) -> Array:
    """Return time (readings, positions) in each position, from -1 to 1, in the order of the
    readings.
    """
    position = design.readings.position
    within = np.zeros((len(position), len(design.positions.names)))
    for k in np.unique(position):
        rows = np.flatnonzero(position == k)
        within[rows, k] = np.linspace(-1.0, 1.0, len(rows)) if len(rows) > 1 else 0.0
    return within


def _in_all_directions(values: Array, d: int) -> Array:
    """Return displacements (m, d, d k) along each axis by functions (m, k)."""
    displacements = np.zeros((len(values), d, d, values.shape[1]))
    for axis in range(d):
        displacements[:, axis, axis] = values
    return displacements.reshape(len(values), d, -1)
