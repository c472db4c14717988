"""Readings that two campaigns have in common, which hide changes."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.design import Flags
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Array
from ballplate.simulator.maps import InCommon
from ballplate.simulator.readings import ObservedReadings

# Readings no further apart than this (m) differ by rounding in the computer.
NOTHING = 1e-12
# Last digits are looked for down to 10 to the minus this, in metres, and values nearer than so much
# of one to a multiple are one.
FINEST, WHOLE = 12, 1e-3
# Readings that were rounded by more than this part of the repeatability are compared as they stand.
FINE = 0.51


def same_positions(first: ObservedReadings, second: ObservedReadings) -> tuple[str, ...]:
    """Positions of the second campaign most of whose readings are those of the first, or else of
    the first most of whose are those of the second.
    """
    shared, chance = _same(first, second)
    for campaign, is_shared in ((second, shared[1]), (first, shared[0])):
        position, names = campaign.design.readings.position, campaign.design.positions.names
        share = np.bincount(position, is_shared) / np.maximum(np.bincount(position), 1)
        if names_shared := tuple(
            names[k] for k in np.flatnonzero(_are_most(share, chance)).tolist()
        ):
            return names_shared
    return ()


def same_readings(first: ObservedReadings, second: ObservedReadings) -> InCommon:
    """Return the overlap of two campaigns: "same" if most readings of both are common, "some" if
    most of a position are.

    Single readings are compared, of a ball by a probe, regardless of names of positions and of
    missing readings, to the last digit of the more coarsely rounded table.
    """
    shared, chance = _same(first, second)
    if _are_most(np.array([is_shared.mean() for is_shared in shared]), chance).all():
        return "same"
    return "some" if same_positions(first, second) else "none"


def _are_most(share: Array, chance: float) -> Flags:
    """Flag shares of readings that are 1, or nearer to 1 than to the share of accidental matches.

    >>> _are_most(np.array([0.5, 0.6, 1.0]), 0.0).tolist()
    [False, True, True]
    """
    return (share > 0.5 * (1.0 + chance)) | (share == 1.0)


def _same(first: ObservedReadings, second: ObservedReadings) -> tuple[tuple[Flags, Flags], float]:
    """Return flags of the readings of each campaign that are in the other, and the probability of
    an accidental match.
    """
    from scipy.spatial import cKDTree
    from scipy.special import erf

    digits = [_last_digit(campaign.x) for campaign in (first, second)]
    s = np.asarray(first.design.machine.repeatability)
    apart = 0.5 * sum(digits) if digits[0] != digits[1] else 0.0
    # Digits as coarse as the scatter would make readings of their own alike.
    apart = apart if (apart <= FINE * s).all() else 0.0
    within = apart + NOTHING
    chance = float(np.prod(erf((2.0 * apart or min(digits)) / (2.0 * s))))
    named: dict[tuple[str, str], int] = {}
    points = [_places(campaign, named) for campaign in (first, second)]
    trees = [cKDTree(named_points) for named_points in points]
    is_repeated = [
        np.isfinite(tree.query(own_points, distance_upper_bound=within, p=np.inf)[0])
        for tree, own_points in zip(trees[::-1], points, strict=True)
    ]
    return (is_repeated[0], is_repeated[1]), chance


def _places(observed: ObservedReadings, named: dict[tuple[str, str], int]) -> Array:
    """Scale readings (n, d + 1) with a number for the ball and the probe, by their names."""
    design, readings = observed.design, observed.design.readings
    balls, probes = design.balls.names, design.probes.names
    pairs = zip(readings.ball.tolist(), readings.probe.tolist(), strict=True)
    numbers = [named.setdefault((balls[k], probes[p]), len(named)) for k, p in pairs]
    return np.column_stack([np.nan_to_num(observed.x), numbers])


def _last_digit(x: Array) -> float:
    """Return the largest power of ten, in metres, of which all scale readings are multiples.

    >>> _last_digit(np.array([0.1234567, -0.25]))
    1e-07
    """
    for power in range(3, FINEST):
        parts = np.nan_to_num(x) * 10.0**power
        if (np.abs(parts - np.rint(parts)) < WHOLE).all():
            return float(f"1e-{power}")
    return float(f"1e-{FINEST}")


def read_once_words(positions: tuple[str, ...]) -> str:
    """Return the caution for positions with readings common to two campaigns.

    >>> read_once_words(("low", "high")).partition(":")[0]
    'readings are the same in both campaigns in low, high'
    """
    return (
        f"readings are the same in both campaigns in {listing(positions)}: the campaigns are less"
        " different than two that are independent, and a change may be missed"
    )
