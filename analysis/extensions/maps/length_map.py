"""Lengths throughout the volume against a target: by location, length and direction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import comb, prod

import numpy as np
from ballplate.simulator.computing import (
    ProgressStep,
    Report,
    above,
    comparable,
    single_threaded,
    unreported,
)
from ballplate.simulator.design import Design, Flags
from ballplate.simulator.estimation import Linearisation, MeasuredPoints, displacements, linearise
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.simulator.geometry import even_grid
from ballplate.simulator.inputs import QuantityError, hint, parse_length_function
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import PairTile, expansion, pair_tiles

from .length_groups import LengthGroups, LengthMapSettings
from .length_tables import LengthMap

# Points of a grid: twelve million lengths.
MOST_POINTS = 5000
# Classes of length at most.
MOST_CLASSES = 20
# Parts of the volume's edges by which directions differ that count as the same.
PARALLEL = 1e-6
# Undetermined lengths that are named.
NAMED = 3


def length_settings(
    experiment: Experiment,
    target: str | None = None,
    grid: Sequence[int] = (6,),
    probe: str | None = None,
    coverage_factor: float | None = None,
    with_repeatability: bool = False,
) -> LengthMapSettings:
    """Return settings with defaults of the experiment; `grid` has one number of points, or one per
    axis.

    :raises ValueError: a target, grid, probe or coverage factor that the experiment cannot have.
    """
    try:
        stated_target = (
            None if experiment.target_uncertainty is None else experiment.target_uncertainty.stated
        )
        chosen = stated_target if target is None else parse_length_function(target)
    except QuantityError as error:
        raise ValueError(f"target: {error}") from None
    if chosen is None:
        raise ValueError(
            'the file states no target_uncertainty; add it, or give a target, such as "0.5 um +'
            ' L/1000000"'
        )
    d = experiment.dimension
    counts = tuple(grid) * d if len(grid) == 1 else tuple(grid)
    if len(counts) != d:
        raise ValueError(
            f"the grid has {len(counts)} numbers, but the experiment has {d} dimensions; give one,"
            f" or {d}"
        )
    if min(counts) < 2:
        raise ValueError(f"the grid has {min(counts)} points along an axis; give 2 at least")
    if prod(counts) > MOST_POINTS:
        raise ValueError(
            f"a grid of {prod(counts)} points is too fine; at most {MOST_POINTS} are possible"
        )
    used = probe or experiment.evaluation.probe
    if used not in experiment.probes:
        raise ValueError(f'unknown probe "{used}"; {hint(used, experiment.probes)}')
    factor = experiment.coverage_factor
    expanded = coverage_factor or expansion(factor)
    return LengthMapSettings(counts, used, chosen, expanded, with_repeatability, factor)


@single_threaded
def length_map(
    experiment: Experiment,
    settings: LengthMapSettings,
    report: Report = unreported,
    at: Linearisation | None = None,
) -> LengthMap:
    """Return uncertainties of all lengths between points of a grid over the volume, at zero machine
    error.

    `report` gets the number of finished lengths; `at` is the linearised design, if known.
    """
    at = at or linearise(lay_out(experiment))
    design = at.design
    points = grid_points(design, settings.grid)
    edges = class_edges(float(np.linalg.norm(design.machine.volume.size)))
    names = direction_names(design.dimension)
    tiles = _tiles(at, points, settings)
    factors = (1.0, settings.coverage_factor, settings.target_factor)
    by_point, by_length = _Tally(len(points), factors), _Tally(len(edges) - 1, factors)
    by_direction, whole = _Tally(len(names), factors), _Tally(1, factors)
    worst, largest = None, -1.0
    named: list[tuple[int, int]] = []
    finished, count = 0, comb(len(points), 2)
    report(ProgressStep("lengths", finished, count))
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
        finished += len(tile.lengths)
        report(ProgressStep("lengths", finished, count))
    return LengthMap(
        experiment.label,
        experiment.title,
        design,
        at.deficiency,
        experiment.expected_rank_deficiency,
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


def _tiles(at: Linearisation, points: Array, settings: LengthMapSettings) -> Iterator[PairTile]:
    """Return the tiles of all pairs of points."""
    probes = np.full(len(points), at.design.probes.names.index(settings.probe))
    moved = displacements(at, MeasuredPoints(points, probes))
    if settings.with_repeatability:
        moved.own[:] = np.diag(at.design.machine.repeatability)
    return pair_tiles(moved)


def grid_points(design: Design, counts: tuple[int, ...]) -> Array:
    """Points (n, d) of a grid over the whole volume, the last axis changing fastest."""
    return even_grid(*design.machine.volume.corners, counts)


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
    classes = np.full(len(apart), len(direction_names(d)) - 1)
    classes = np.where(count == 1, moves.argmax(axis=1), classes)
    if d == 3:
        classes = np.where((count == 2) & is_equal, 3 + moves.argmin(axis=1), classes)
    return np.where((count == d) & is_equal, 6 if d == 3 else 2, classes)


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
        kinds: tuple[Flags, ...] = (~is_open | is_open, is_open, *within)
        for k, chosen in enumerate(kinds):
            self.counts[k] += np.bincount(group[chosen], minlength=size)
        is_determined = ~is_open
        for k, column in enumerate((values, ratio)):
            self.sums[k] += np.bincount(group[is_determined], column[is_determined], minlength=size)
            np.maximum.at(self.tops[k], group[is_determined], column[is_determined])

    def groups(self) -> LengthGroups:
        count, open_, *within = self.counts
        determined = count - open_
        with np.errstate(invalid="ignore"):
            average = np.where(determined > 0, self.sums / np.maximum(determined, 1), np.nan)
            top = np.where(determined > 0, self.tops, np.nan)
        return LengthGroups(count, open_, average[0], top[0], average[1], top[1], *within)
