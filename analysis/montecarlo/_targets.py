"""Quantities of U1 to U6 that are compared between replicates and the truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.estimation.functions import (
    BallPlaces,
    Combinations,
    Coordinates,
    Displacements,
    Distances,
    MeasuredPoints,
    Parameters,
    Places,
    displacements,
)
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.geometry.motions import vector_from_rotation
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.uncertainty.named_values import member_root
from ballplate.uncertainty.pairs import pairs_of
from ballplate.uncertainty.quantities import QUANTITIES, functions_of

from ._reference import Reference
from ._replicates import Deviations

# Distances followed through all replicates; more are sampled.
MOST_PAIRS = 1000

# Displacements of points at the reference, their true co-ordinates (n, d), and their change (b, d,
# n).
Displaced = tuple[Displacements, Array, Callable[[Deviations], Array]]

# Fraction of the largest uncertainty in a unit below which a value is unchanged but for rounding.
UNCHANGED = 1e-8


@dataclass(frozen=True)
class MonteCarloQuantity:
    """A vector of q quantities.

    `base` (q,) is its error in the estimate from readings without noise, `uncertainty` (q,) the
    linearised standard uncertainties, `change` its change (b, q) in replicates, `units` (q,)
    metres, radians or 1. `sampled` marks a sample of all pairs, `is_partial` that some members are
    undetermined and left out.
    """

    symbol: str
    base: Array
    uncertainty: Array
    units: tuple[str, ...]
    change: Callable[[Deviations], Array]
    sampled: bool = False
    is_partial: bool = False

    @cached_property
    def typical(self) -> Array:
        """Mean square uncertainty (q,) of the members in the same unit."""
        mean_squares, units = np.empty_like(self.uncertainty), np.array(self.units)
        for unit in np.unique(units):
            mean_squares[units == unit] = (self.uncertainty[units == unit] ** 2).mean()
        return mean_squares


@single_threaded
def targets(shared: Reference) -> tuple[MonteCarloQuantity, ...]:
    """Return the quantities of a design; those of the model only if the true machine has the fitted
    model.
    """
    at = shared.linearisation
    displaced = _displaced(shared, at)
    quantities = []
    for symbol, kind in QUANTITIES.items():
        for functions in functions_of(symbol, at.design, at.layout) if kind.in_replicates else ():
            if isinstance(functions, Parameters):
                # A true machine of another model has no values of these parameters.
                has_truth = (
                    shared.truth.model == at.design.model
                    or not functions.rows[:, at.layout.model].any()
                )
                quantities += [_parameters(symbol, shared, at, functions)] if has_truth else []
            elif isinstance(functions, Coordinates):
                quantities.append(_coordinates(symbol, displaced(functions.places)))
            elif isinstance(functions, Combinations):
                quantities.append(_combinations(symbol, functions, displaced(functions.places)))
            else:
                quantities.append(_distances(symbol, functions, displaced(functions.places)))
    return tuple(
        uncertain for target in quantities if (uncertain := _uncertain(target)) is not None
    )


def _displaced(shared: Reference, at: Linearisation) -> Callable[[Places], Displaced]:
    """Return a function from places to `Displaced`, with a cache of points."""
    cache = {}

    def displaced(places: Places) -> Displaced:
        if isinstance(places, BallPlaces):
            truly = places.at(at.design, shared.truth.state)
            return displacements(at, places), truly, lambda change: change.balls[:, :, places.index]
        key = places.points.tobytes() + places.probes.tobytes()
        if key not in cache:
            true = replace(at.design, model=shared.truth.model)
            truly = places.at(true, shared.truth.state)
            cache[key] = displacements(at, places), truly, _change(shared, places)
        return cache[key]

    return displaced


def _change(shared: Reference, places: MeasuredPoints) -> Callable[[Deviations], Array]:
    """Return the change (b, d, n) of corrected points in replicates."""
    model = shared.local_model(places.points, places.probes)
    n, d = places.points.shape
    are_free = bool((shared.factor.layout.offset_columns[places.probes] >= 0).any())

    def change(replicates: Deviations) -> Array:
        unmoved = np.zeros((len(replicates.a), d, n))
        offsets = replicates.offsets[:, places.probes].swapaxes(1, 2) if are_free else None
        return model.change(unmoved, replicates.a, offsets)

    return change


def _uncertain(target: MonteCarloQuantity) -> MonteCarloQuantity | None:
    """Return a target without undetermined and unchanged members, whose uncertainties are rounding;
    None without any member.
    """
    chosen, units = np.zeros(len(target.uncertainty), bool), np.array(target.units)
    for unit in set(target.units):
        size = np.nan_to_num(target.uncertainty[units == unit])
        chosen[units == unit] = size > UNCHANGED * size.max(initial=0.0)
    if not chosen.any():
        return None
    if chosen.all():
        return target

    def change(replicates: Deviations) -> Array:
        return target.change(replicates)[:, chosen]

    return MonteCarloQuantity(
        target.symbol,
        target.base[chosen],
        target.uncertainty[chosen],
        tuple(units[chosen].tolist()),
        change,
        target.sampled,
        bool(np.isnan(target.uncertainty).any()),
    )


def _parameters(
    symbol: str, shared: Reference, at: Linearisation, functions: Parameters
) -> MonteCarloQuantity:
    design, layout, start, real = at.design, at.layout, shared.start, shared.truth.state
    used = functions.rows.any(axis=0)
    rows = functions.rows[:, used]
    turned = vector_from_rotation(start.rotations @ real.rotations.transpose(0, 2, 1))
    # Parameters of another true model are not comparable; the functions then exclude the model's.
    a = start.a - real.a if shared.truth.model == design.model else start.a
    offsets = start.probes - real.probes
    # The error of the estimate without noise is written as if it were a replicate's deviation, so
    # that one function serves both.
    steps = np.zeros((1, len(layout)))
    steps[:, layout.lengths] = start.lengths - real.lengths
    steps[:, layout.influences] = start.influences - real.influences
    origins, balls = start.origins - real.origins, np.zeros((1, 0, 0))
    error = Deviations(balls, turned[None], origins[None], a[None], offsets[None], steps)

    def change(replicates: Deviations) -> Array:
        return _shared(layout, replicates)[:, used] @ rows.T

    return MonteCarloQuantity(
        symbol, change(error)[0], at.of_shared(functions.rows), functions.units, change
    )


def _shared(layout: SharedLayout, deviations: Deviations) -> Array:
    """Return changes (b, s) of the shared parameters; rotations are not the sums of their steps."""
    changed = deviations.shared.copy()
    position, parameter = np.nonzero(layout.pose_columns >= 0)
    poses = np.concatenate([deviations.origins, deviations.rotations], axis=2)
    changed[:, layout.pose_columns[position, parameter]] = poses[:, position, parameter]
    changed[:, layout.model] = deviations.a
    probe, axis = np.nonzero(layout.offset_columns >= 0)
    changed[:, layout.offset_columns[probe, axis]] = deviations.offsets[:, probe, axis]
    return changed


def _coordinates(symbol: str, displaced: Displaced) -> MonteCarloQuantity:
    points, truly, moved = displaced
    base = (points.places - truly).ravel()

    def change(replicates: Deviations) -> Array:
        return moved(replicates).swapaxes(1, 2).reshape(-1, len(base))

    return MonteCarloQuantity(
        symbol, base, points.uncertainties.ravel(), ("m",) * len(base), change
    )


def _combinations(symbol: str, functions: Combinations, displaced: Displaced) -> MonteCarloQuantity:
    """Return the members of all values, which are linear."""
    points, truly, moved = displaced
    weights, units = functions.weights, np.repeat(functions.units, np.diff(functions.starts))
    uncertainty = np.sqrt((member_root(functions, points) ** 2).sum(axis=1))

    def change_of(replicates: Deviations) -> Array:
        return np.asarray(
            (weights @ moved(replicates).swapaxes(1, 2).reshape(-1, points.places.size).T).T
        )

    base = weights @ (points.places - truly).ravel()
    return MonteCarloQuantity(symbol, base, uncertainty, tuple(units.tolist()), change_of)


def _distances(symbol: str, functions: Distances, displaced: Displaced) -> MonteCarloQuantity:
    """Return distances between all points, a sample of them, or given pairs."""
    points, truly, moved = displaced
    places = points.places
    if functions.pairs is None:
        *ends, sampled = sample_of_pairs(len(places), MOST_PAIRS)
    else:
        ends, sampled = list(functions.pairs.T), False
    first, second = ends
    between = places[first] - places[second]
    length = np.linalg.norm(between, axis=1)
    true_length = np.linalg.norm(truly[first] - truly[second], axis=1)
    pairs = pairs_of(points, np.stack(ends, axis=1))
    uncertainty = np.where(pairs.is_open, np.nan, pairs.uncertainties)

    def change(replicates: Deviations) -> Array:
        change = moved(replicates)
        difference = change[:, :, first] - change[:, :, second]
        # The difference of squared lengths from that of co-ordinates keeps all digits.
        gained = (difference * (difference + 2.0 * between.T)).sum(axis=1)
        return gained / (np.sqrt(length**2 + gained) + length)

    return MonteCarloQuantity(
        symbol, length - true_length, uncertainty, ("m",) * len(first), change, sampled
    )


def sample_of_pairs(n: int, most: int) -> tuple[Integers, Integers, bool]:
    """Return all pairs of n places, or `most` of them, always the same; and whether they are a
    sample.

    >>> sample_of_pairs(3, 10)
    (array([0, 0, 1]), array([1, 2, 2]), False)
    """
    count = n * (n - 1) // 2
    if count <= most:
        first, second = np.triu_indices(n, 1)
        return first, second, False
    generator = np.random.default_rng(np.random.SeedSequence(0))
    chosen = np.sort(generator.choice(count, most, replace=False))
    # Pair number of (i, j) with i < j counts the rows above: i (2 n - i - 1) / 2.
    rows = np.arange(n)
    starts = rows * (2 * n - rows - 1) // 2
    first = np.searchsorted(starts, chosen, side="right") - 1
    return first, first + 1 + chosen - starts[first], True
