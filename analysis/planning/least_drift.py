"""The order of positions in which a drift of the scales changes distances least."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.influences.protocol import (
    DesignParts,
    Disturbed,
    Influence,
    InfluenceParameter,
    InfluenceSettings,
)
from ballplate.simulator.experiment.model import Candidate, ChangeTimes, Experiment, Position
from ballplate.simulator.experiment.pool import with_chosen
from ballplate.simulator.machines.protocol import Array

from .drift_in_orders import effects_on_distances, without_drift
from .orders import with_probes
from .schedule import reading_times

# Positions of which all orders are tried; of more, exchanges from so many random starts.
MOST_TRIED, STARTS = 6, 4

# An order is better from this share on.
GAIN = 1e-9


@dataclass(frozen=True)
class ScaleByPosition(Influence):
    """Scales that are wrong by a ratio of their own in each of `count` positions."""

    count: int

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        return tuple(
            InfluenceParameter(f"scale {k}", "1", 0.0, 1e-6, 1.0, k) for k in range(self.count)
        )

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """What the scales say too much, by position."""
        is_here = at.position[:, None] == np.arange(self.count)
        return np.zeros(at.x.shape), at.x[:, :, None] * is_here[:, None, :]


class ScaleByPositionSettings(InfluenceSettings):
    """Settings that no file has, of all positions there are."""

    def influence(self, design: DesignParts) -> ScaleByPosition:
        """The scales of all positions of a design."""
        return ScaleByPosition(len(design.positions.names))


@single_threaded
def least_drift(
    experiment: Experiment, chosen: Sequence[Candidate], changes: ChangeTimes, seed: int
) -> tuple[str, ...]:
    """Names of positions in the order in which the largest change of a distance by a drift of the
    scales is least, of equal ones the shortest found first.

    What the drift does within positions, which hardly depends on their order, is left out. Up to
    `MOST_TRIED` positions all orders are tried; of more, two are exchanged as long as that helps.
    """
    own = [one for one in chosen if isinstance(one.item, Position)]
    plain = without_drift(experiment)
    by_position = replace(plain, influences=(*plain.influences, ScaleByPositionSettings()))
    uncertainty, effects, _ = effects_on_distances(with_chosen(by_position, chosen), len(own))
    effects = effects[np.isfinite(uncertainty)]
    readings = np.array([candidate.readings for candidate in own], float)

    def size(order: Sequence[int]) -> float:
        sequence = with_probes([own[k] for k in order], changes)
        times = np.empty(len(own))
        times[list(order)] = reading_times(sequence, changes)
        times -= np.average(times, weights=readings)
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
