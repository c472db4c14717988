"""Lengths throughout the volume against a target: by place, by length and by direction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import comb

import numpy as np
from ballplate.simulator.computing.rounding import above, comparable
from ballplate.simulator.computing.steps import Report, unreported
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.layout import lay_out
from ballplate.simulator.estimation.functions import MeasuredPoints, displacements
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.quantities import LengthFunction
from ballplate.simulator.machines.protocol import Array, Integers
from numpy.typing import NDArray

from ..uncertainty.pairs import PairTile, pair_tiles

# Points of a grid: twelve million lengths.
MOST_POINTS = 5000
# Classes of length at most.
MOST_CLASSES = 20
# Parts of the volume's edges by which directions differ that count as the same.
PARALLEL = 1e-6
# Undetermined lengths that are named.
NAMED = 3


@dataclass(frozen=True)
class LengthMapSettings:
    """What lengths are looked at: `grid` points along each axis, with a probe, and how they are
    compared.

    `with_repeatability`: whether the scatter of the two readings along the length adds to its
    uncertainty. The `target` is meant for `target_factor` times the standard uncertainty.
    """

    grid: tuple[int, ...]
    probe: str
    target: LengthFunction
    coverage_factor: float = 2.0
    with_repeatability: bool = False
    target_factor: float = 1.0


@dataclass(frozen=True, eq=False)
class LengthGroups:
    """Lengths in g groups; all arrays (g,), uncertainties in metres, NaN where no length is
    determined.

    `count` of them there are, `undetermined` of these are open; `average` and `maximum` are
    standard uncertainties, `average_ratio` and `maximum_ratio` those to the target; `within` and
    `within_expanded` count the lengths whose standard and expanded uncertainties are no larger than
    the target, `within_target` those with the uncertainty that the target is meant for.
    """

    count: Integers
    undetermined: Integers
    average: Array
    maximum: Array
    average_ratio: Array
    maximum_ratio: Array
    within: Integers
    within_expanded: Integers
    within_target: Integers

    def share(self, expanded: bool = False) -> Array:
        """Shares of lengths within the target (g,), undetermined ones counted as not; NaN of an
        empty group.
        """
        within = self.within_expanded if expanded else self.within
        return np.asarray(np.where(self.count > 0, within / np.maximum(self.count, 1), np.nan))


@dataclass(frozen=True, eq=False)
class LengthMap:
    """Lengths between all points of a grid, grouped.

    `points` (n, d) are scale readings, metres, the last axis changing fastest. `by_point` has a
    group for each point, of the lengths that start or end there; `by_length` those between
    neighbouring `edges` (c + 1,); `by_direction` those of `directions`; `whole` a single one.
    `worst` are the indices of the length with the largest ratio, and `open_pairs` (up to three, 2)
    of some that are undetermined.
    """

    design: Design
    deficiency: int
    settings: LengthMapSettings
    points: Array
    edges: Array
    directions: tuple[str, ...]
    by_point: LengthGroups
    by_length: LengthGroups
    by_direction: LengthGroups
    whole: LengthGroups
    worst: tuple[int, int] | None
    open_pairs: tuple[tuple[int, int], ...]

    @property
    def is_met(self) -> bool:
        """Whether all lengths are within the target, by the uncertainty that it is meant for."""
        return bool(self.whole.within_target[0] == self.whole.count[0])


@single_threaded
def length_map(
    experiment: Experiment, settings: LengthMapSettings, report: Report = unreported
) -> LengthMap:
    """Uncertainties of all lengths between points of a grid over the volume, at zero machine error.

    `report` is told the number of lengths done.
    """
    design = lay_out(experiment)
    points = grid_points(design, settings.grid)
    edges = class_edges(float(np.linalg.norm(design.machine.volume.size)))
    names = direction_names(design.dimension)
    deficiency, tiles = _tiles(design, points, settings)
    factors = (1.0, settings.coverage_factor, settings.target_factor)
    by_point, by_length = _Tally(len(points), factors), _Tally(len(edges) - 1, factors)
    by_direction, whole = _Tally(len(names), factors), _Tally(1, factors)
    worst, largest = None, -1.0
    named: list[tuple[int, int]] = []
    done, count = 0, comb(len(points), 2)
    report("lengths", done, count)
    for tile in tiles:
        target = settings.target.at(tile.lengths)
        ratio = np.where(tile.is_open, np.nan, tile.uncertainties / target)
        values = np.where(tile.is_open, np.nan, tile.uncertainties)
        by_point.add(tile.first, values, ratio)
        by_point.add(tile.second, values, ratio)
        by_length.add(length_classes(tile.lengths, edges), values, ratio)
        apart = (points[tile.second] - points[tile.first]) / design.machine.volume.size
        by_direction.add(direction_classes(apart), values, ratio)
        whole.add(np.zeros(len(values), np.int64), values, ratio)
        if (
            not tile.is_open.all()
            and (top := int(np.nanargmax(comparable(ratio)))) >= 0
            and above(ratio[top], largest)
        ):
            worst, largest = (int(tile.first[top]), int(tile.second[top])), float(ratio[top])
        for k in np.flatnonzero(tile.is_open)[: NAMED - len(named)]:
            named.append((int(tile.first[k]), int(tile.second[k])))
        done += len(tile.lengths)
        report("lengths", done, count)
    return LengthMap(
        design,
        deficiency,
        settings,
        points,
        edges,
        names,
        by_point.groups(),
        by_length.groups(),
        by_direction.groups(),
        whole.groups(),
        worst,
        tuple(named),
    )


@single_threaded
def length_pairs(
    experiment: Experiment, settings: LengthMapSettings
) -> tuple[Array, list[PairTile]]:
    """Points (n, d) of the grid, and all lengths between them in tiles."""
    design = lay_out(experiment)
    points = grid_points(design, settings.grid)
    return points, list(_tiles(design, points, settings)[1])


def _tiles(
    design: Design, points: Array, settings: LengthMapSettings
) -> tuple[int, Iterator[PairTile]]:
    """Rank deficiency, and the tiles of all pairs of points."""
    at = linearise(design)
    probes = np.full(len(points), design.probes.names.index(settings.probe))
    moved = displacements(at, MeasuredPoints(points, probes))
    if settings.with_repeatability:
        moved.own[:] = np.diag(design.machine.repeatability)
    return at.deficiency, pair_tiles(moved)


def grid_points(design: Design, counts: tuple[int, ...]) -> Array:
    """Points (n, d) of a grid over the whole volume, the last axis changing fastest."""
    ends = zip(*design.machine.volume.corners, counts, strict=True)
    sides = [np.linspace(*one) for one in ends]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, design.dimension)


def class_edges(longest: float) -> Array:
    """Edges of classes of length of a round width, 20 classes at most, up to the longest.

    >>> class_edges(0.45).tolist()
    [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45]
    """
    power = 10.0 ** np.floor(np.log10(longest / MOST_CLASSES))
    width = next(
        step * power
        for step in (1.0, 2.0, 5.0, 10.0)
        if longest <= MOST_CLASSES * step * power * (1 + 1e-9)
    )
    count = int(np.ceil(longest / width * (1 - 1e-9)))
    return np.round(width * np.arange(count + 1), 12)


def length_classes(lengths: Array, edges: Array) -> Integers:
    """Class of each length (m,); a length on an edge belongs below it."""
    return np.clip(np.searchsorted(edges, lengths * (1 - 1e-9)) - 1, 0, len(edges) - 2)


def direction_names(dimension: int) -> tuple[str, ...]:
    """Groups of directions in two or three dimensions."""
    if dimension == 2:
        return ("along x", "along y", "diagonals", "other directions")
    faces = tuple(f"face diagonals {plane}" for plane in ("yz", "xz", "xy"))
    return ("along x", "along y", "along z", *faces, "body diagonals", "other directions")


def direction_classes(apart: Array) -> Integers:
    """Group of each difference (m, d), in units of the volume's edges, as an index into
    `direction_names`.

    A diagonal is parallel to one of the volume.

    >>> apart = [[0.2, 0, 0], [0, 0.1, -0.1], [0.3, 0.3, 0.3], [0.1, 0.2, 0]]
    >>> direction_classes(np.array(apart)).tolist()
    [0, 3, 6, 7]
    """
    d = apart.shape[1]
    size = np.abs(apart)
    largest = size.max(axis=1)
    moves = size > PARALLEL * largest[:, None]
    count = moves.sum(axis=1)
    is_equal = (~moves | (np.abs(size - largest[:, None]) <= PARALLEL * largest[:, None])).all(
        axis=1
    )
    found = np.full(len(apart), len(direction_names(d)) - 1)
    found = np.where(count == 1, moves.argmax(axis=1), found)
    if d == 3:
        found = np.where((count == 2) & is_equal, 3 + moves.argmin(axis=1), found)
    return np.where((count == d) & is_equal, 6 if d == 3 else 2, found)


class _Tally:
    """Running sums of groups of lengths, counted where their uncertainty times each of `factors` is
    in the target.
    """

    def __init__(self, size: int, factors: tuple[float, ...]) -> None:
        self.factors = factors
        self.counts = np.zeros((2 + len(factors), size), np.int64)
        self.sums = np.zeros((2, size))
        self.tops = np.full((2, size), -np.inf)

    def add(self, group: Integers, values: Array, ratio: Array) -> None:
        """Count standard uncertainties (m,) and their ratios to the target, NaN where
        undetermined.
        """
        is_open = np.isnan(values)
        size = self.counts.shape[1]
        with np.errstate(invalid="ignore"):
            within = [factor * ratio <= 1.0 for factor in self.factors]
        kinds: tuple[NDArray[np.bool_], ...] = (~is_open | is_open, is_open, *within)
        for k, chosen in enumerate(kinds):
            self.counts[k] += np.bincount(group[chosen], minlength=size)
        known = ~is_open
        for k, one in enumerate((values, ratio)):
            self.sums[k] += np.bincount(group[known], one[known], minlength=size)
            np.maximum.at(self.tops[k], group[known], one[known])

    def groups(self) -> LengthGroups:
        count, open_, *within = self.counts
        known = count - open_
        with np.errstate(invalid="ignore"):
            average = np.where(known > 0, self.sums / np.maximum(known, 1), np.nan)
            top = np.where(known > 0, self.tops, np.nan)
        return LengthGroups(count, open_, average[0], top[0], average[1], top[1], *within)
