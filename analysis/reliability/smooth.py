"""What residuals look like when the error model lacks something, or when something drifts: smooth errors, not events."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.polynomial import legendre

from simulator.design import Design, Integers, State, probe_offsets
from simulator.estimation.observations import length_geometry, reading_weights, rotation_sensitivity
from simulator.estimation.parameters import AXIS_NAMES
from simulator.machines.protocol import Array

# Scale readings closer than this (m) count as the same place on a scale.
SAME_PLACE = 1e-3

# Places on a scale that each have a value of their own; of more, waves up to so many half periods.
MOST_PLACES, WAVES = 60, 20

# Degrees of polynomials along one axis with levers, of those that turn probes, and of those in all co-ordinates.
ALONG, OF_PROBES, TOGETHER = 7, 4, 4

# Half periods of a drift over all readings.
DRIFT = 6


@dataclass(frozen=True)
class Smooth:
    """Biases (rows, k) that together are one smooth error, and in words what it is."""

    words: str
    columns: Array


def smooth_errors(design: Design, state: State, x: Array) -> Iterator[Smooth]:
    """All smooth errors that are looked for."""
    t, d = _fractions(x), design.dimension
    letters = AXIS_NAMES[:d]
    units = np.eye(d)
    for axis, letter in enumerate(letters):
        values = _places(x[:, axis])
        for component, other in enumerate(letters):
            words = f"an error in {other} that depends on {letter}"
            yield Smooth(words, _rows(design, state, x, values[:, None, :] * units[component][:, None]))
    for axis, letter in enumerate(letters):
        along = legendre.legvander(t[:, axis], ALONG)
        levers = np.column_stack([np.ones(len(t)), np.delete(t, axis, axis=1)])
        values = (along[:, :, None] * levers[:, None, :]).reshape(len(t), -1)
        words = f"displacements and rotations that depend on {letter}"
        yield Smooth(words, _rows(design, state, x, _of_all_axes(values, d)))
    offsets = probe_offsets(design, state)[design.readings.probe]
    turned = rotation_sensitivity(offsets)
    for axis, letter in enumerate(letters):
        along = legendre.legvander(t[:, axis], OF_PROBES)
        for about in range(turned.shape[2]):
            words = f"a rotation of the probes about {letters[about] if d == 3 else 'z'} that depends on {letter}"
            yield Smooth(words, _rows(design, state, x, turned[:, :, [about]] * along[:, None, :]))
    by_axis = [legendre.legvander(t[:, axis], TOGETHER) for axis in range(d)]
    terms = [
        np.prod([one[:, power] for one, power in zip(by_axis, powers, strict=True)], axis=0)
        for powers in product(range(TOGETHER + 1), repeat=d)
        if 0 < sum(powers) <= TOGETHER
    ]
    words = "an error that depends on several co-ordinates together"
    yield Smooth(words, _rows(design, state, x, _of_all_axes(np.stack(terms, axis=1), d)))
    time = np.linspace(0.0, 1.0, len(x))
    values = np.cos(np.pi * np.arange(1, DRIFT + 1) * time[:, None])
    yield Smooth("a drift over all readings", _rows(design, state, x, _of_all_axes(time[:, None], d)))
    yield Smooth("a drift over all readings", _rows(design, state, x, _of_all_axes(values, d)))
    within = _time_within(design)
    yield Smooth("a drift within each position", _rows(design, state, x, _of_all_axes(within.sum(axis=1)[:, None], d)))
    yield Smooth("a drift within each position", _rows(design, state, x, _of_all_axes(within, d)))


def _fractions(x: Array) -> Array:
    """Scale readings (m, d) between -1 and 1."""
    low, extent = x.min(axis=0), np.ptp(x, axis=0)
    return np.asarray(2.0 * (x - low) / np.where(extent > 0.0, extent, 1.0) - 1.0)


def _places(x: Array) -> Array:
    """Functions (m, k) of one scale reading (m,), as general as the readings permit."""
    order = np.argsort(x, kind="stable")
    place = np.zeros(len(x), np.int64)
    place[order] = np.cumsum(np.append(0, np.diff(x[order]) > SAME_PLACE))
    if place.max(initial=0) < MOST_PLACES:
        return np.eye(int(place.max(initial=0)) + 1)[place]
    t = 0.5 * (_fractions(x[:, None])[:, 0] + 1.0)
    return np.asarray(np.cos(np.pi * np.arange(1, WAVES + 1) * t[:, None]))


def _time_within(design: Design) -> Array:
    """Time (readings, positions) in each position, between -1 and 1, by the order of the readings."""
    position = design.readings.position
    within = np.zeros((len(position), len(design.position_names)))
    for k in np.unique(position):
        rows = np.flatnonzero(position == k)
        within[rows, k] = np.linspace(-1.0, 1.0, len(rows)) if len(rows) > 1 else 0.0
    return within


def _of_all_axes(values: Array, d: int) -> Array:
    """Displacements (m, d, d k) along each axis by functions (m, k)."""
    found = np.zeros((len(values), d, d, values.shape[1]))
    for axis in range(d):
        found[:, axis, axis] = values
    return found.reshape(len(values), d, -1)


def _rows(design: Design, state: State, x: Array, displacement: Array) -> Array:
    """Biases (rows, k) of all observations by displacements (readings, d, k) of all readings."""
    chosen: Integers = design.plate_readings
    weight = reading_weights(design, design.readings.select(chosen))
    d, k = design.dimension, displacement.shape[2]
    of_plates = (weight[:, :, None] * displacement[chosen]).reshape(-1, k)
    given = design.lengths
    unit, white = length_geometry(design, state, x)
    second = np.where(given.to_pivot[:, None, None], 0.0, displacement[np.maximum(given.second, 0)])
    of_lengths = white.whitened(np.einsum("md,mdk->mk", unit, displacement[given.first] - second))
    others = len(design.priors) + len(design.coordinates) + len(design.distances)
    assert of_plates.shape[0] == d * len(chosen)
    return np.concatenate([of_plates, of_lengths, np.zeros((others, k))])
