"""The order of positions in which a drift of the scales changes distances least."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations
from typing import Any

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
from ballplate.simulator.machines.protocol import Array

from .drift_in_orders import effects_on_distances, without_drift
from .orders import with_probes
from .schedule import first_readings

# Positions of which all orders are tried; of more, exchanges from so many random starts.
MOST_TRIED, STARTS = 6, 4

# Where hours within positions stand beside readings.
WITHIN = "hours within positions"

# An order is better from this share on.
GAIN = 1e-9


@dataclass(frozen=True)
class ScaleByPosition(Influence):
    """Scales that are wrong by a ratio of their own in each position, and drift within all of them
    by the `clock`.
    """

    clock: Clock

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        """The ratios by position, then the drift within positions."""
        names = [f"scale {k}" for k in range(len(self.clock.starts))]
        return tuple(
            InfluenceParameter(name, "1", 0.0, 1e-6, 1.0) for name in (*names, "scale within")
        )

    def in_sequence(self, readings: Readings) -> Mapping[str, Array]:
        """Hours from the first reading of a position on."""
        return {WITHIN: within_positions(self.clock, readings)}

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """What the scales say too much, by position and within."""
        is_here = at.position[:, None] == np.arange(len(self.clock.starts))
        share = np.column_stack([is_here, at.column(WITHIN)])
        return np.zeros(at.x.shape), at.x[:, :, None] * share[:, None, :]


def within_positions(clock: Clock, readings: Readings) -> Array:
    """Hours (m,) of readings from the beginning of the first in their position."""
    found = clock.hours(readings)
    for k in np.unique(readings.position):
        here = np.flatnonzero(readings.position == k)
        found[here] -= found[here[0]] - 0.5 * clock.reading[k] * readings.repeats[here[0]] / HOUR
    return found


class ScaleByPositionSettings(InfluenceSettings):
    """Settings that no file has, of all positions there are."""

    clock: Any

    def influence(self, design: DesignParts) -> ScaleByPosition:
        """The scales of all positions of a design."""
        return ScaleByPosition(self.clock)


@single_threaded
def least_drift(
    experiment: Experiment, chosen: Sequence[Candidate], changes: ChangeTimes, seed: int
) -> tuple[str, ...]:
    """Names of positions in the order in which the largest change of a distance by a drift of the
    scales is least, of equal ones the shortest found first.

    Up to `MOST_TRIED` positions all orders are tried; of more, two are exchanged as long as that
    helps.
    """
    own = [one for one in chosen if isinstance(one.item, Position)]
    taken = tuple(candidate.reading_seconds for candidate in own)
    clock = Clock(0.0, changes.probe, taken, (np.nan,) * len(own))
    plain, own_scales = without_drift(experiment), ScaleByPositionSettings(clock=clock)
    by_position = replace(plain, influences=(*plain.influences, own_scales))
    alone = with_chosen(by_position, chosen)
    uncertainty, effects, _ = effects_on_distances(alone, len(own) + 1)
    effects = effects[np.isfinite(uncertainty)]
    readings = lay_out(alone).readings
    weights = np.bincount(readings.position, readings.repeats, len(own))
    hours = within_positions(clock, readings) * readings.repeats
    middle = np.bincount(readings.position, hours, len(own)) / weights

    def size(order: Sequence[int]) -> float:
        sequence = with_probes([own[k] for k in order], changes)
        times = np.ones(len(own) + 1)
        times[list(order)] = np.array(first_readings(sequence, changes)) / HOUR
        times[:-1] -= np.average(times[:-1] + middle, weights=weights)
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
