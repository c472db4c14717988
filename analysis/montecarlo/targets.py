"""Quantities compared between replicates and the truth: those behind U1 to U6, one vector each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from ballplate.montecarlo.reference import Reference
from ballplate.montecarlo.replicates import Deviations
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.estimation.functions import (
    BallPlaces,
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
from ballplate.simulator.machines.protocol import Array, Integers

from ..uncertainty.pairs import pairs_of
from ..uncertainty.quantities import QUANTITIES, functions_of

# Distances that are followed through all replicates; a sample of the pairs where there are more.
MOST_PAIRS = 1000

# Changes of distances that are computed at once.
ENTRIES_AT_ONCE = 16_384

# An uncertainty below this fraction of the largest in its unit is that of a value which the model
# leaves alone: a length of a metre is rounded by a billionth of a tenth of a micrometre.
UNCHANGED = 1e-8


@dataclass(frozen=True)
class MonteCarloQuantity:
    """A vector of q quantities.

    `base` (q,) is its error in the estimate from readings without noise, `uncertainty` (q,) the
    linearised standard uncertainties, `change` its change (b, q) in replicates, `units` (q,)
    metres, radians or 1. `sampled` tells that q is a sample of all pairs.
    """

    symbol: str
    base: Array
    uncertainty: Array
    units: tuple[str, ...]
    change: Callable[[Deviations], Array]
    sampled: bool = False

    @cached_property
    def typical(self) -> Array:
        """Mean square uncertainty (q,) of those in the same unit."""
        found, units = np.empty_like(self.uncertainty), np.array(self.units)
        for unit in np.unique(units):
            found[units == unit] = (self.uncertainty[units == unit] ** 2).mean()
        return found


@single_threaded
def targets(shared: Reference) -> tuple[MonteCarloQuantity, ...]:
    """The quantities that a design has; those of the model only where the true machine is one of
    the fitted model's.
    """
    at = shared.linearisation
    displaced = _displaced(shared, at)
    found: list[MonteCarloQuantity] = []
    for symbol, kind in QUANTITIES.items():
        for functions in functions_of(symbol, at.design, at.layout) if kind.in_replicates else ():
            if isinstance(functions, Parameters):
                is_known = (
                    shared.truth.model == at.design.model
                    or not functions.rows[:, at.layout.model].any()
                )
                found += [_parameters(symbol, shared, at, functions)] if is_known else []
            elif isinstance(functions, Coordinates):
                found.append(_coordinates(symbol, displaced(functions.places)))
            else:
                found.append(_distances(symbol, functions, displaced(functions.places)))
    return tuple(uncertain for target in found if (uncertain := _uncertain(target)) is not None)


@dataclass(frozen=True)
class Displaced:
    """Places at the reference, with their displacements, where they `truly` are (n, d), and their
    change (b, d, n).
    """

    moved: Displacements
    truly: Array
    change: Callable[[Deviations], Array]


def _displaced(shared: Reference, at: Linearisation) -> Callable[[Places], Displaced]:
    """A function from places to what becomes of them, which remembers the points that it has been
    asked for.
    """
    made: dict[bytes, Displaced] = {}

    def displaced(places: Places) -> Displaced:
        if isinstance(places, BallPlaces):
            truly = places.at(at.design, shared.truth.state)
            return Displaced(
                displacements(at, places), truly, lambda found: found.balls[:, :, places.index]
            )
        key = places.points.tobytes() + places.probes.tobytes()
        if key not in made:
            true = replace(at.design, model=shared.truth.model)
            truly = places.at(true, shared.truth.state)
            made[key] = Displaced(displacements(at, places), truly, _change(shared, places))
        return made[key]

    return displaced


def _change(shared: Reference, places: MeasuredPoints) -> Callable[[Deviations], Array]:
    """The change (b, d, n) of corrected points in replicates."""
    model = shared.local_model(places.points, places.probes)
    n, d = places.points.shape
    are_free = bool((shared.factor.layout.offset_columns[places.probes] >= 0).any())
    # Co-ordinates and distances of the same points are asked for one after the other.
    last: list[tuple[Deviations, Array]] = []

    def change(replicates: Deviations) -> Array:
        if not (last and last[0][0] is replicates):
            last[:] = [(replicates, changed(replicates))]
        return last[0][1]

    def changed(replicates: Deviations) -> Array:
        none = np.zeros((len(replicates.a), d, n))
        offsets = replicates.offsets[:, places.probes].swapaxes(1, 2) if are_free else None
        return model.change(none, replicates.a, offsets)

    return change


def _uncertain(target: MonteCarloQuantity) -> MonteCarloQuantity | None:
    """A target without the members that the design leaves undetermined, and without those that no
    observation could change, whose uncertainties are rounding beside the others in their unit; None
    where nothing is left.
    """
    kept, units = np.zeros(len(target.uncertainty), bool), np.array(target.units)
    for unit in set(target.units):
        size = np.nan_to_num(target.uncertainty[units == unit])
        kept[units == unit] = size > UNCHANGED * size.max(initial=0.0)
    if not kept.any():
        return None
    if kept.all():
        return target

    def change(replicates: Deviations) -> Array:
        return target.change(replicates)[:, kept]

    return MonteCarloQuantity(
        target.symbol,
        target.base[kept],
        target.uncertainty[kept],
        tuple(units[kept].tolist()),
        change,
        target.sampled,
    )


def _parameters(
    symbol: str, shared: Reference, at: Linearisation, functions: Parameters
) -> MonteCarloQuantity:
    design, layout, start, real = at.design, at.layout, shared.start, shared.truth.state
    used = functions.rows.any(axis=0)
    rows = functions.rows[:, used]
    turned = vector_from_rotation(start.rotations @ real.rotations.transpose(0, 2, 1))
    # Parameters of another true model are no errors of these, which then have no part in the
    # functions.
    a = start.a - real.a if shared.truth.model == design.model else start.a
    offsets = start.probes - real.probes
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
    """Changes (b, s) of the shared parameters; those of rotations are not the sums of their
    steps.
    """
    changed = deviations.shared.copy()
    position, place = np.nonzero(layout.pose_columns >= 0)
    poses = np.concatenate([deviations.origins, deviations.rotations], axis=2)
    changed[:, layout.pose_columns[position, place]] = poses[:, position, place]
    changed[:, layout.model] = deviations.a
    probe, axis = np.nonzero(layout.offset_columns >= 0)
    changed[:, layout.offset_columns[probe, axis]] = deviations.offsets[:, probe, axis]
    return changed


def _coordinates(symbol: str, of: Displaced) -> MonteCarloQuantity:
    base, moved = (of.moved.places - of.truly).ravel(), of.change

    def change(replicates: Deviations) -> Array:
        return moved(replicates).swapaxes(1, 2).reshape(-1, len(base))

    return MonteCarloQuantity(
        symbol, base, of.moved.uncertainties.ravel(), ("m",) * len(base), change
    )


def _distances(symbol: str, functions: Distances, of: Displaced) -> MonteCarloQuantity:
    """Distances between all places, or a sample of them, or between some."""
    places, moved = of.moved.places, of.change
    if functions.pairs is None:
        *ends, sampled = sample_of_pairs(len(places), MOST_PAIRS)
    else:
        ends, sampled = list(functions.pairs.T), False
    first, second = ends
    between = places[first] - places[second]
    length = np.linalg.norm(between, axis=1)
    true_length = np.linalg.norm(of.truly[first] - of.truly[second], axis=1)
    pairs = pairs_of(of.moved, np.stack(ends, axis=1))
    uncertainty = np.where(pairs.is_open, np.nan, pairs.uncertainties)

    squared, double = length**2, 2.0 * between

    def change(replicates: Deviations) -> Array:
        displaced = moved(replicates)
        # The square of the new length less that of the old, without the loss of digits that
        # subtracting would bring.
        gained = np.zeros((len(displaced), len(first)))
        # So many replicates at a time that all stays in cache.
        rows = max(ENTRIES_AT_ONCE // len(first), 1)
        work = np.empty((2, rows, len(first)))
        for start in range(0, len(gained), rows):
            part, of_axis = gained[start : start + rows], displaced[start : start + rows]
            difference, other = work[:, : len(part)]
            for axis in range(displaced.shape[1]):
                np.take(of_axis[:, axis], first, axis=1, out=difference, mode="clip")
                difference -= np.take(of_axis[:, axis], second, axis=1, out=other, mode="clip")
                np.add(difference, double[:, axis], out=other)
                other *= difference
                part += other
            root = np.sqrt(np.add(squared, part, out=other), out=other)
            root += length
            part /= root
        return gained

    return MonteCarloQuantity(
        symbol, length - true_length, uncertainty, ("m",) * len(first), change, sampled
    )


def sample_of_pairs(n: int, most: int) -> tuple[Integers, Integers, bool]:
    """All pairs of n places, or `most` of them, always the same; and whether it is a sample.

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
