"""The order of positions in which a drift of the scales changes distances least."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.influences.drift import HOUR, Clock
from ballplate.simulator.design.influences.protocol import (
    DesignParts,
    Disturbed,
    Influence,
    InfluenceParameter,
    InfluenceSettings,
)
from ballplate.simulator.design.objects import Readings
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Candidate, ChangeTimes, Experiment, Position
from ballplate.simulator.experiment.pool import with_chosen
from ballplate.simulator.machines.protocol import Array, Integers

from .drift_in_orders import effects_on_distances, without_drift
from .orders import with_probes
from .schedule import first_readings

# Positions of which all orders are tried; of more, exchanges from so many random starts.
MOST_TRIED, STARTS = 6, 4

# An order is better from this share on.
GAIN = 1e-9


@dataclass(frozen=True)
class ScaleByBlock(Influence):
    """Scales that are wrong by a ratio of their own in each of the `blocks`, what is read in one
    position with one probe, and by the drift within blocks.
    """

    blocks: Blocks

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        """The ratios of blocks, then the drift within them."""
        names = [f"scale {k}" for k in range(len(self.blocks.weight))]
        return tuple(
            InfluenceParameter(name, "1", 0.0, 1e-6, 1.0) for name in (*names, "scale within")
        )

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """What the scales say too much, by block and within."""
        order = at.column("order").astype(np.int64)
        is_here = self.blocks.of_reading[order][:, None] == np.arange(len(self.blocks.weight))
        share = np.column_stack([is_here, self.blocks.within[order]])
        return np.zeros(at.x.shape), at.x[:, :, None] * share[:, None, :]


class ScaleByBlockSettings(InfluenceSettings):
    """Settings that no file has."""

    reading: tuple[float, ...]
    probe_change: float

    def influence(self, design: DesignParts) -> ScaleByBlock:
        """The scales of all blocks of a design."""
        count = len(design.positions.names)
        clock = Clock(0.0, self.probe_change, self.reading, (0.0,) * count)
        return ScaleByBlock(blocks(clock, design.readings))


@dataclass(frozen=True)
class Blocks:
    """Readings of a position with a probe: `of_reading` (m,) tells the block, `within` (m,) hours
    from its mean. By block (b,) are its `position` and `probe`, the number of readings in it as
    `weight`, the `middle` of it in hours from the first reading of the position on, as the file has
    the probes, and the `length` of what is read.
    """

    of_reading: Integers
    within: Array
    position: Integers
    probe: Integers
    weight: Array
    middle: Array
    length: Array

    def hours(self, k: int, probes: Sequence[str], names: Sequence[str], change: float) -> Array:
        """Hours of the middles of a position's blocks from its first reading on, where it is read
        with its probes in this order.
        """
        own = np.flatnonzero(self.position == k)
        order = np.argsort([list(probes).index(names[probe]) for probe in self.probe[own]])
        length, found = self.length[own][order], np.empty(len(own))
        found[order] = np.cumsum(length + change) - change - 0.5 * length
        return found


def blocks(clock: Clock, readings: Readings) -> Blocks:
    """The blocks of a design, each position of which begins at zero by its clock."""
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
) -> tuple[str, ...]:
    """Names of positions in the order in which the largest change of a distance by a drift of the
    scales is least, of equal ones the first that was tried.

    Up to `MOST_TRIED` positions all orders are tried; of more, two are exchanged as long as that
    helps.
    """
    own = [one for one in chosen if isinstance(one.item, Position)]
    settings = ScaleByBlockSettings(
        reading=tuple(one.reading_seconds for one in own), probe_change=changes.probe
    )
    plain = without_drift(experiment)
    by_block = replace(plain, influences=(*plain.influences, settings))
    design = lay_out(with_chosen(by_block, chosen))
    (scales,) = [one for one in design.influences if isinstance(one, ScaleByBlock)]
    told, names = scales.blocks, design.probes.names
    uncertainty, effects, _ = effects_on_distances(design, len(told.weight) + 1)
    effects = effects[np.isfinite(uncertainty)]

    def size(order: Sequence[int]) -> float:
        sequence = with_probes([own[k] for k in order], changes)
        times = np.append(told.middle, 1.0)
        starts = first_readings(sequence, changes)
        for k, start, (candidate, probes) in zip(order, starts, sequence, strict=True):
            here = np.flatnonzero(told.position == k)
            assert isinstance(candidate.item, Position)
            # Probes of several groups stay in the order of the groups.
            if len(candidate.item.readings) == 1:
                times[here] = told.hours(k, probes, names, changes.probe / HOUR)
            times[here] += start / HOUR
        times[:-1] -= np.average(times[:-1], weights=told.weight)
        return float(np.abs(effects @ times).max(initial=0.0))

    count = len(own)
    if count <= MOST_TRIED:
        return _names(
            own, _first_least({order: size(order) for order in permutations(range(count))})
        )
    generator = np.random.default_rng(np.random.SeedSequence(seed))
    starts = [tuple(range(count))]
    starts += [tuple(generator.permutation(count).tolist()) for _ in range(STARTS - 1)]
    found: dict[tuple[int, ...], float] = {}
    for order in starts:
        least = size(order)
        is_better = True
        while is_better:
            tried = {}
            for i, j in combinations(range(count), 2):
                other = list(order)
                other[i], other[j] = other[j], other[i]
                tried[tuple(other)] = size(other)
            best = _first_least(tried)
            is_better = tried[best] < least * (1.0 - GAIN)
            order, least = (best, tried[best]) if is_better else (order, least)
        found[order] = least
    return _names(own, _first_least(found))


def _first_least(sizes: dict[tuple[int, ...], float]) -> tuple[int, ...]:
    """The first order whose size is the least but for rounding."""
    least = min(sizes.values())
    return next(order for order, size in sizes.items() if size <= least * (1.0 + GAIN))


def _names(own: Sequence[Candidate], order: Sequence[int]) -> tuple[str, ...]:
    return tuple(own[k].name for k in order)
