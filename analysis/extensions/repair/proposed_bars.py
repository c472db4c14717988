"""Smallest sets of natural bars, or locations of a Bryan gauge, that determine the undetermined
strains.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, combinations_with_replacement

import numpy as np
from ballplate.simulator.design import Design, Lengths
from ballplate.simulator.geometry import directions
from ballplate.simulator.inputs import listed
from ballplate.simulator.machines import Array

# Singular values below this fraction of the largest: what readings tell of a direction through
# their own scatter only.
MISSING = 1e-3
# What is added is to tell more than that.
SINGULAR_VALUE_TOLERANCE = 1e-2

# Elevations that a gauge on a table can reach come first, and those all round are easier read than
# upright planes.
ELEVATIONS = (60, 30, 45, 15, 75)
AZIMUTHS = (0, 90, 45, 135)


def products(u: Array) -> Array:
    """Products of direction cosines, so that u' S u is their product with a strain."""
    return np.array([u[i] * u[j] for i, j in combinations_with_replacement(range(len(u)), 2)])


def bars_to_add(design: Design, strains: Array, overall: Array | None) -> str:
    """Return text for bars that would determine the strains (products, k) except the `overall`
    one; empty without a simple set.

    Every proposal is verified by the rank of all lengths together in strains, pivots and unknown
    lengths.
    """
    lengths = design.of(Lengths)
    gauge_only = bool(lengths.to_pivot.all())
    if gauge_only and design.dimension != 3:
        return ""
    like = int(np.flatnonzero(lengths.to_pivot == gauge_only)[0])
    pool = list(_places() if gauge_only else bar_directions(design.dimension))
    rows = _rows(design, lengths.direction, np.arange(len(lengths)))
    # Strains are open also where these lengths tell too little of them, which is not to count.
    rows[:, : len(strains)] -= _what_is_told(rows, strains) @ strains.T
    more = [_rows(design, u, np.full(len(u), like)) for _, _, u in pool]
    wanted = strains.shape[1] - (overall is not None)
    for size in range(1 if gauge_only else wanted, (3 if gauge_only else wanted) + 1):
        for chosen in combinations(range(len(pool)), size):
            if (
                _leave_open(np.concatenate([rows, *(more[k] for k in chosen)]), strains)
                == strains.shape[1] - wanted
            ):
                return _in_words([pool[k][:2] for k in chosen], gauge_only)
    return ""


def _rows(design: Design, u: Array, like: np.ndarray) -> Array:
    """Derivatives (m, products + pivots + lengths) of lengths in directions u (m, d) that are
    otherwise as others.
    """
    lengths_of_design, d = design.of(Lengths), design.dimension
    position = design.readings.position[lengths_of_design.first[like]]
    pivots = np.zeros((len(u), len(design.positions.names), d))
    pivoted = np.flatnonzero(lengths_of_design.to_pivot[like])
    pivots[pivoted, position[pivoted]] = -u[pivoted]
    lengths = np.zeros((len(u), len(design.unknown_lengths.names)))
    if lengths_of_design.free is not None:
        free = np.flatnonzero(lengths_of_design.free[like] >= 0)
        lengths[free, lengths_of_design.free[like][free]] = -1.0
    product_rows = np.array([products(direction) for direction in u])
    return np.concatenate([product_rows, pivots.reshape(len(u), -1), lengths], axis=1)


def _leave_open(rows: Array, strains: Array) -> int:
    """Return the number of strains that remain undetermined."""
    values = np.linalg.svd(_what_is_told(rows, strains), compute_uv=False)
    return strains.shape[1] - int((values > SINGULAR_VALUE_TOLERANCE).sum())


def _what_is_told(rows: Array, strains: Array) -> Array:
    """Return the strain content of rows (m, k) after elimination of pivots and lengths."""
    size = len(strains)
    u, values, _ = np.linalg.svd(rows[:, size:], full_matrices=False)
    determined = u[:, values > SINGULAR_VALUE_TOLERANCE * max(values.max(initial=0.0), 1.0)]
    strain_effects = rows[:, :size] @ strains
    return strain_effects - determined @ (determined.T @ strain_effects)


def bar_directions(d: int) -> Iterator[tuple[str, str, Array]]:
    """Kind, words and directions (1, d): along axes, diagonals of planes, diagonals of space."""
    axes = np.eye(d)
    for k in range(d):
        yield "along", "xyz"[k], axes[k : k + 1]
    for sign, angle in ((1, "45"), (-1, "-45")):
        for i, j in combinations(range(d), 2):
            plane = f"in the {'xyz'[i]}{'xyz'[j]} plane at {angle} deg"
            yield "", plane, (axes[i : i + 1] + sign * axes[j : j + 1]) / np.sqrt(2.0)
    for signs in ((1, 1), (-1, 1), (1, -1), (-1, -1)) if d == 3 else ():
        yield (
            "",
            f"along the diagonal ({signs[0]}, {signs[1]}, 1)",
            np.array([[*signs, 1.0]]) / np.sqrt(3.0),
        )


def _places() -> Iterator[tuple[str, str, Array]]:
    """Kind, words and directions (m, 3): rings around the pivot, and upright half circles through
    the top.
    """
    for up in ELEVATIONS:
        yield (
            "elevation",
            f"{up}",
            directions(tuple((np.radians(30.0 * k), np.radians(up)) for k in range(12))),
        )
    for azimuth in AZIMUTHS:
        sides = [
            (np.radians(azimuth + side), np.radians(up))
            for side in (0, 180)
            for up in (15, 30, 45, 60, 75)
        ]
        yield "azimuth", f"{azimuth} and {azimuth + 180}", directions(tuple(sides))


def _in_words(chosen: list[tuple[str, str]], gauge_only: bool) -> str:
    if not gauge_only:
        words = [f"{kind} {description}".strip() for kind, description in chosen]
        return "add for example " + listed(
            [f"{'one' if k else 'a bar'} {word}" for k, word in enumerate(words)]
        )
    rings = [description for kind, description in chosen if kind == "elevation"]
    sides = [description for kind, description in chosen if kind == "azimuth"]
    height = "an elevation" if len(rings) == 1 else "elevations"
    parts = [f"all round at {height} of {listed(rings)} deg"] if rings else []
    parts += [f"at several elevations at azimuths of {listed(sides)} deg"] if sides else []
    return f"read the ball for example {' and '.join(parts)} as well"
