"""The order of positions in which a drift of the scales changes distances least."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations, product
from math import factorial, prod

import numpy as np
from ballplate.planning import first_readings, with_probes, without_drift
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import (
    HOUR,
    Clock,
    DesignParts,
    Disturbed,
    Flags,
    Influence,
    InfluenceParameter,
    InfluenceSettings,
    Readings,
)
from ballplate.simulator.experiment import (
    Candidate,
    ChangeTimes,
    Experiment,
    Position,
    lay_out,
    with_chosen,
)
from ballplate.simulator.machines import Array, Integers

from .drift_in_orders import effects_on_distances

# Orders, of positions and of the probes within them, up to which all are tried; of more, exchanges
# from so many random starts.
MOST_TRIED, STARTS = 100_000, 30

# An order is better from this share on.
GAIN = 1e-9


@dataclass(frozen=True)
class ScaleByBlock(Influence):
    """Scale errors by a ratio in each of the `blocks` (readings in one position with one probe),
    and by the drift within blocks.
    """

    blocks: Blocks

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        """The ratios of blocks, then the drift within them."""
        names = [f"scale {k}" for k in range(len(self.blocks.weight))]
        return tuple(
            InfluenceParameter(name, "1", 0.0, 1e-6, 1.0) for name in (*names, "scale within")
        )

    def shifts(self, disturbed: Disturbed) -> tuple[Array, Array]:
        """Return the scale errors, by block and within."""
        order = disturbed.column("order").astype(np.int64)
        is_here = self.blocks.of_reading[order][:, None] == np.arange(len(self.blocks.weight))
        share = np.column_stack([is_here, self.blocks.within[order]])
        return np.zeros(disturbed.x.shape), disturbed.x[:, :, None] * share[:, None, :]


class ScaleByBlockSettings(InfluenceSettings):
    """Settings without a file."""

    reading: tuple[float, ...]
    probe_change: float

    def influence(self, design: DesignParts) -> ScaleByBlock:
        """The scales of all blocks of a design."""
        count = len(design.positions.names)
        clock = Clock(0.0, self.probe_change, self.reading, (0.0,) * count)
        return ScaleByBlock(blocks(clock, design.readings))


@dataclass(frozen=True)
class Blocks:
    """Readings of a position with a probe: `of_reading` (m,) is the block, `within` (m,) hours from
    its mean.

    By block (b,): its `position` and `probe`, the number of readings as `weight`, its `middle` in
    hours from the first reading of the position, in the file's order of probes, and its `length`.
    """

    of_reading: Integers
    within: Array
    position: Integers
    probe: Integers
    weight: Array
    middle: Array
    length: Array

    def hours(self, k: int, probes: Sequence[str], names: Sequence[str], change: float) -> Array:
        """Return hours of the middles of a position's blocks from its first reading, for this order
        of probes.
        """
        indices = np.flatnonzero(self.position == k)
        order = np.argsort([list(probes).index(names[probe]) for probe in self.probe[indices]])
        length, middles = self.length[indices][order], np.empty(len(indices))
        middles[order] = np.cumsum(length + change) - change - 0.5 * length
        return middles


def blocks(clock: Clock, readings: Readings) -> Blocks:
    """Return the blocks of a design; each position begins at zero by its clock."""
    pairs, inverse = np.unique(
        np.stack([readings.position, readings.probe], axis=1), axis=0, return_inverse=True
    )
    inverse = inverse.ravel()
    hours = clock.seconds(readings) / HOUR
    weight = np.bincount(inverse, readings.repeats).astype(float)
    middle = np.bincount(inverse, hours * readings.repeats) / weight
    position, probe = pairs.T
    length = np.array(clock.reading)[position] * weight / HOUR
    return Blocks(inverse, hours - middle[inverse], position, probe, weight, middle, length)


@single_threaded
def least_drift(
    experiment: Experiment, chosen: Sequence[Candidate], changes: ChangeTimes, seed: int
) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Names of positions, each with its probes in order, in the order in which the largest change
    of a distance by a drift of the scales is least; of equal ones that with the least change-over.

    Up to `MOST_TRIED` all orders of positions and of probes within them are tried. Of more, two
    positions are exchanged, or the probes of one are read in another order, as long as that helps.
    """
    positions = [item for item in chosen if isinstance(item.item, Position)]
    settings = ScaleByBlockSettings(
        reading=tuple(position.reading_seconds for position in positions),
        probe_change=changes.probe,
    )
    plain = without_drift(experiment)
    by_block = replace(plain, influences=(*plain.influences, settings))
    design = lay_out(with_chosen(by_block, chosen))
    (scales,) = [
        influence for influence in design.influences if isinstance(influence, ScaleByBlock)
    ]
    uncertainty, effects, _ = effects_on_distances(design, len(scales.blocks.weight) + 1)
    ways = _ways(positions, scales.blocks, design.probes.names, changes)
    drift = _Drift(ways, scales.blocks.weight, effects[np.isfinite(uncertainty)])
    options = [
        [way for way, (position, _) in enumerate(ways.each) if position == k]
        for k in range(len(positions))
    ]
    if factorial(len(positions)) * prod(map(len, options)) <= MOST_TRIED:
        every = np.array(list(product(*options)), np.int64)
        mixed = np.array(list(permutations(range(len(positions)))), np.int64)
        best, _ = drift.least(every[:, mixed].reshape(-1, len(positions)))
    else:
        generator = np.random.default_rng(np.random.SeedSequence(seed))
        orders = [
            np.arange(len(positions)),
            *(generator.permutation(len(positions)) for _ in range(STARTS - 1)),
        ]
        starts = [with_probes([positions[k] for k in order], changes) for order in orders]
        improved = [
            drift.improved(
                [ways.each.index((k, probes)) for k, (_, probes) in zip(order, start, strict=True)],
                options,
            )
            for order, start in zip(orders, starts, strict=True)
        ]
        best, _ = drift.least(np.array(improved))
    return tuple((positions[k].name, probes) for k, probes in (ways.each[way] for way in best))


@dataclass(frozen=True, eq=False)
class _Ways:
    """Ways to read single positions, `each` a position's index and its probes in order.

    Hours: the `middles` (w, b) of its blocks from its beginning, its duration `takes` (w,), and the
    `change` (w, w) between ways; `is_own` (w, b) flags its own blocks.
    """

    each: tuple[tuple[int, tuple[str, ...]], ...]
    middles: Array
    is_own: Flags
    takes: Array
    change: Array

    def hours(self, sequences: Integers) -> tuple[Array, Array]:
        """When the middles of blocks are (n, b), and the change-over (n,), of sequences (n, p) of
        ways.
        """
        change = self.change[sequences[:, :-1], sequences[:, 1:]]
        spent = self.takes[sequences[:, :-1]] + change
        starts = np.cumsum(np.pad(spent, ((0, 0), (1, 0))), axis=1)
        hours = np.zeros((len(sequences), self.middles.shape[1]))
        for way, start in zip(sequences.T, starts.T, strict=True):
            hours += self.middles[way] + start[:, None] * self.is_own[way]
        return hours, change.sum(axis=1)


def _ways(
    candidates: Sequence[Candidate], blocks: Blocks, names: Sequence[str], changes: ChangeTimes
) -> _Ways:
    """All ways to read the positions that blocks are of."""
    items = [candidate.item for candidate in candidates if isinstance(candidate.item, Position)]
    choices = [(k, probes) for k, item in enumerate(items) for probes in permutations(item.probes)]
    middles = np.zeros((len(choices), len(blocks.weight)))
    is_own = blocks.position == np.array([k for k, _ in choices])[:, None]
    for row, (k, probes) in enumerate(choices):
        (first,) = first_readings(((candidates[k], probes),), changes)
        # Probes of several groups stay in the order of the groups.
        middle = blocks.middle[blocks.position == k]
        if len(items[k].readings) == 1:
            middle = blocks.hours(k, probes, names, changes.probe / HOUR)
        middles[row, is_own[row]] = first / HOUR + middle
    begun, ended = (np.array([probes[end] for _, probes in choices]) for end in (0, -1))
    place = np.unique(
        [(candidate.item.artefact, candidate.plane) for candidate in candidates],
        axis=0,
        return_inverse=True,
    )
    planes = place[1].ravel()[[k for k, _ in choices]]
    change = changes.plane * (planes[:, None] != planes) + changes.probe * (ended[:, None] != begun)
    takes, change = np.array([candidates[k].seconds for k, _ in choices]) / HOUR, change / HOUR
    return _Ways(tuple(choices), middles, is_own, takes, change)


@dataclass(frozen=True, eq=False)
class _Drift:
    """Effects (d, b + 1) on distances of drifts in blocks of this `weight` (b,) and, in the last
    column, within them.
    """

    ways: _Ways
    weight: Array
    effects: Array

    def least(self, sequences: Integers) -> tuple[list[int], float]:
        """Return the sequence of ways, of (n, p), with the smallest largest effect, and its size;
        ties by least change-over, then the first.
        """
        hours, change = self.ways.hours(sequences)
        hours -= np.average(hours, axis=1, weights=self.weight)[:, None]
        times = np.column_stack([hours, np.ones(len(hours))])
        # The effect on some distances is a lower bound of that on all. The sequence with the
        # smallest bound is evaluated in full; its worst distance joins the others until none
        # changes more.
        bounds = np.zeros(len(times))
        while True:
            k = int(bounds.argmin())
            effect = np.append(np.abs(self.effects @ times[k]), 0.0)
            largest = int(effect.argmax())
            most = float(effect[largest]) * (1.0 + GAIN)
            if effect[largest] <= bounds[k] * (1.0 + GAIN):
                break
            bounds = np.maximum(bounds, np.abs(times @ self.effects[largest]))
        equal = np.flatnonzero(bounds <= most)
        for k in equal[np.argsort(change[equal], kind="stable")]:
            if np.abs(self.effects @ times[k]).max(initial=0.0) <= most:
                break
        return sequences[k].tolist(), most

    def improved(self, best: list[int], options: Sequence[Sequence[int]]) -> list[int]:
        """Return the best sequence by exchanges of two positions and by other orders of the probes
        of one.
        """
        least = np.inf
        while True:
            near = [best]
            for i, j in combinations(range(len(best)), 2):
                trial = [*best]
                trial[i], trial[j] = trial[j], trial[i]
                near.append(trial)
            for i, way in enumerate(best):
                alternatives = options[self.ways.each[way][0]]
                near += [[*best[:i], alternative, *best[i + 1 :]] for alternative in alternatives]
            best_near, size = self.least(np.array(near))
            if size >= least * (1.0 - GAIN):
                return best
            best, least = best_near, size
