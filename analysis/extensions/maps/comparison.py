"""Comparison of two maps: lengths, errors at points, error functions, and balls of plates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from ballplate.simulator.computing import pinv, single_threaded
from ballplate.simulator.design import Volume
from ballplate.simulator.geometry import AXIS_NAMES, even_grid
from ballplate.simulator.machines import Array, ErrorModel, HasLines, Integers

from .campaign_tests import JointDifference, orthonormal
from .compared_maps import MOTIONS, ComparedMap, NotComparableError, motions
from .normalised_errors import FigureGroup, ValueDifference
from .plates import plate_differences

# Places along an axis at which error functions are compared, by fractions of it.
PLACES = np.linspace(0.1, 1.0, 10)
# Points of the volume at random, at the least, for the test of the map as a whole.
LEAST_POINTS = 150
# Where a corner differs from another in so many axes, their length is one of these.
OF_CORNERS = {1: "edges", 2: "face diagonals", 3: "body diagonals"}
# What makes error functions of two models the same ones.
SAME = ("arrangement", "lower", "upper", "origin", "full_rotations", "spatial", "z", "chain")


@dataclass(frozen=True, eq=False)
class FrameMotion:
    """The free motion between the frames of two maps, with `names` and units: what has to be added
    to the errors of the first so that they come nearest to those of the second.
    """

    names: tuple[str, ...]
    values: Array
    standard_uncertainties: Array


@dataclass(frozen=True, eq=False)
class MapComparison:
    """All that is compared: `lengths` in groups, errors at points after the `motion` was taken
    out, error functions, plates, and the test of the map as a whole.
    """

    probe: str
    motion: FrameMotion
    lengths: tuple[FigureGroup, ...]
    places: FigureGroup
    functions: tuple[FigureGroup, ...]
    why_no_functions: str
    plates: tuple[FigureGroup, ...]
    test: JointDifference | None

    @property
    def groups(self) -> tuple[FigureGroup, ...]:
        """All groups of values, in printed order."""
        return *self.lengths, self.places, *self.functions, *self.plates


@single_threaded
def compared(
    first: ComparedMap,
    second: ComparedMap,
    coverage_factor: float = 2.0,
    grid: int = 4,
    probe: str | None = None,
) -> MapComparison:
    """Compare two maps at `grid` points along each axis, with a probe, by default theirs.

    :raises NotComparableError: machines of other dimensions or volumes, or no common probe.
    """
    if first.dimension != second.dimension:
        axes = f"{first.dimension} and {second.dimension}"
        raise NotComparableError(f"the machines have {axes} axes; compare maps of the same machine")
    first, second = _linearised_alike(first, second)
    volume = _common_volume(first, second)
    probe, offsets = _offsets(first, second, probe)
    scatters = first.scatter, second.scatter
    k = coverage_factor

    def difference_at(points: Array, offset: Array) -> ValueDifference:
        mapped_first, mapped_second = (
            side.displacements(points, offset) for side in (first, second)
        )
        return ValueDifference(mapped_first, mapped_second, scatters)

    points = even_grid(volume.lower, volume.upper, [grid] * len(volume.lower))
    difference, offset = difference_at(points, offsets[probe]), offsets[probe]
    middle = points.mean(axis=0)
    moving = motions(points - middle).reshape(points.size, -1)
    motion = difference.by(np.asarray(pinv(moving)))
    remainder = difference.without(orthonormal(moving))
    names = tuple(
        f"{axis} at {place}" for place in map(_place, points) for axis in AXIS_NAMES[: len(middle)]
    )
    corners = even_grid(volume.lower, volume.upper, [2] * len(volume.lower))
    of_corners = difference_at(corners, offset)
    lengths = [
        _lengths(of_corners, corners, kind, pairs, (first, second), k)
        for kind, pairs in _of_corners(corners)
    ]
    pairs = np.array(list(combinations(range(len(points)), 2)))
    through = "lengths through the volume"
    lengths.append(_lengths(difference, points, through, pairs, (first, second), k))
    functions, why = _functions(first, second, k)
    count = max(LEAST_POINTS, *(len(side.values) for side in (first, second)))
    return MapComparison(
        probe,
        FrameMotion(MOTIONS[len(middle)], motion.values, motion.standard_uncertainties()),
        tuple(lengths),
        remainder.group("errors at points of the volume", "m", names, k),
        functions,
        why,
        plate_differences(first, second, k),
        _whole(difference_at, volume, offsets, count),
    )


def _linearised_alike(first: ComparedMap, second: ComparedMap) -> tuple[ComparedMap, ComparedMap]:
    """Return both maps, with derivatives at the same parameters if they share a model."""
    effects = [[(p.name, p.effect) for p in side.model.parameters] for side in (first, second)]
    if type(first.model) is not type(second.model) or effects[0] != effects[1]:
        return first, second
    about = 0.5 * (first.values + second.values)
    return replace(first, about=about), replace(second, about=about)


def _common_volume(first: ComparedMap, second: ComparedMap) -> Volume:
    lower = np.maximum(first.volume.lower, second.volume.lower)
    upper = np.minimum(first.volume.upper, second.volume.upper)
    if (upper <= lower).any():
        raise NotComparableError("the volumes of the two maps do not overlap; check their axes")
    return Volume(lower, upper)


def _offsets(
    first: ComparedMap, second: ComparedMap, probe: str | None
) -> tuple[str, dict[str, Array]]:
    """Return the probe for the comparison and offsets (d,) of all common probes."""
    has = [side for side in (first, second) if not side.is_expected]
    if not has:
        # Two described machines: the reference point itself.
        return "", {"": np.zeros(first.dimension)}
    offsets = {
        name: offset
        # The first map's offset serves for both: requalified probes shift it by a negligible
        # amount.
        for name, offset in has[0].offsets.items()
        if all(name in side.offsets for side in has)
    }
    if probe is None:
        ranked = [side.probe for side in has if side.probe in offsets] or list(offsets)
        if not ranked:
            text = ", ".join(f"{side.label} has {', '.join(side.offsets)}" for side in has)
            raise NotComparableError(f"the maps have no probe of the same name: {text}")
        probe = ranked[0]
    if probe not in offsets:
        names = ", ".join(offsets) or "none"
        raise NotComparableError(f'no probe "{probe}" in both maps; in both: {names}')
    return probe, offsets


def _place(point: Array) -> str:
    return f"({', '.join(f'{1e3 * value:.6g}' for value in point)}) mm"


def _of_corners(corners: Array) -> Iterator[tuple[str, Integers]]:
    """Yield pairs of corners by type of length, the longest first."""
    d = corners.shape[1]
    for apart in range(d, 0, -1):
        pairs = [
            pair
            for pair in combinations(range(len(corners)), 2)
            if int((corners[pair[0]] != corners[pair[1]]).sum()) == apart
        ]
        yield "diagonals" if d == apart == 2 else OF_CORNERS[apart], np.array(pairs)


def _lengths(
    difference: ValueDifference,
    points: Array,
    kind: str,
    pairs: Integers,
    maps: tuple[ComparedMap, ComparedMap],
    coverage_factor: float,
) -> FigureGroup:
    """Lengths between pairs (m, 2) of points for the same scale readings: no motion of a frame
    changes them.
    """
    n, d = points.shape
    apart = points[pairs[:, 1]] - points[pairs[:, 0]]
    length = np.linalg.norm(apart, axis=1)
    matrix = np.zeros((len(pairs), n, d))
    rows = np.arange(len(pairs))
    matrix[rows, pairs[:, 1]] = apart / length[:, None]
    matrix[rows, pairs[:, 0]] = -apart / length[:, None]
    names = tuple(f"{_place(points[i])} to {_place(points[j])}" for i, j in pairs.tolist())
    first, second = (
        0.0 if side.stated is None else np.square(side.stated.at(length)) for side in maps
    )
    return difference.by(matrix.reshape(len(pairs), -1)).group(
        kind, "m", names, coverage_factor, (first, second)
    )


def _functions(
    first: ComparedMap, second: ComparedMap, coverage_factor: float
) -> tuple[tuple[FigureGroup, ...], str]:
    """Error functions that both maps have, or why they are not compared."""
    names = [
        list(dict.fromkeys(p.function for p in side.model.parameters)) for side in (first, second)
    ]
    if not all(isinstance(side.model, HasLines) for side in (first, second)):
        return (), "a model without error functions of one variable"
    if not _have_same_functions(first.model, second.model) or set(names[0]) != set(names[1]):
        return (), "the models, or the conditions of their frames, differ"
    differences = []
    scatters = first.scatter, second.scatter
    dense = np.linspace(0.0, 1.0, 4 * max(len(first.values), 8))
    for name in names[0]:
        parameter = next(p for p in first.model.parameters if p.function == name)
        is_number = sum(p.function == name for p in first.model.parameters) == 1
        first_dense, second_dense = (side.line(name, dense) for side in (first, second))
        # Along the whole axis: a straightness is zero at both ends.
        constant = is_number and all(
            line is not None and float(np.ptp(line.values)) == 0.0
            for line in (first_dense, second_dense)
        )
        t = np.array([1.0]) if constant else PLACES
        first_line, second_line = (side.line(name, t) for side in (first, second))
        if first_line is None or second_line is None or first_dense is None or second_dense is None:
            continue
        words = (name,) if constant else tuple(f"{name} at {100 * place:.0f} %" for place in t)
        figures = ValueDifference(first_line, second_line, scatters).group(
            name, parameter.unit, words, coverage_factor
        )
        test = ValueDifference(first_dense, second_dense, scatters).joint_test(name)
        differences.append(replace(figures, meaning=parameter.meaning, test=test))
    why = "" if differences else "the models have no error functions of one variable"
    return tuple(differences), why


def _have_same_functions(model: ErrorModel, other_model: ErrorModel) -> bool:
    """Compare error functions by frame and volume, regardless of their numbers of coefficients."""
    if type(model) is not type(other_model):
        return False
    for name in SAME:
        ours, theirs = getattr(model, name, None), getattr(other_model, name, None)
        is_same = ours == theirs
        if isinstance(ours, ErrorModel) and isinstance(theirs, ErrorModel):
            is_same = _have_same_functions(ours, theirs)
        if not is_same:
            return False
    return True


def _whole(
    difference_at: Any, volume: Volume, offsets: dict[str, Array], count: int
) -> JointDifference | None:
    """Return the joint test of errors through the volume with all common probes, independent of the
    frame and of probe offsets.
    """
    d = len(volume.lower)
    generator = np.random.default_rng(np.random.SeedSequence(1))
    points = generator.uniform(volume.lower, volume.upper, (count, d))
    parts = [difference_at(points, offset) for offset in offsets.values()]
    moving = motions(points - points.mean(axis=0)).reshape(points.size, -1)
    free = np.zeros((len(parts), points.size, moving.shape[1] + d * (len(parts) - 1)))
    free[:, :, : moving.shape[1]] = moving
    for k in range(1, len(parts)):
        start = moving.shape[1] + d * (k - 1)
        free[k, :, start : start + d] = np.tile(np.eye(d), (count, 1))
    basis = orthonormal(free.reshape(-1, free.shape[2]))
    joined = [
        type(values)(
            *(
                np.concatenate([getattr(getattr(part, side), name) for part in parts])
                for name in ("values", "root", "null", "size", "shared")
            )
        )
        for side, values in (("first", parts[0].first), ("second", parts[0].second))
    ]
    joined_difference = ValueDifference(joined[0], joined[1], parts[0].scatters)
    return joined_difference.without(basis).joint_test("errors through the volume")
