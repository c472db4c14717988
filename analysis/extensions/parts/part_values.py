"""Dimensions of a part as combinations of its touched points."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.computing import eigh, first_largest, svd
from ballplate.simulator.design import Design
from ballplate.simulator.estimation import Combinations, MeasuredPoints
from ballplate.simulator.inputs import Array, LengthFunction, Target
from ballplate.uncertainty import combined_uncertainties

from .datums import sensed
from .fitting import least_largest
from .outside_sources import outside_root
from .part import FORMS, Dimension, Place, Workpiece
from .touched import ProbingMachine, TouchedPoints, of_design, touched
from .values import combine, weights

if TYPE_CHECKING:
    from scipy.sparse import csr_array

COVERAGE = 2.0
# Largest displacement of a smooth deviation beside its value.
MOST_BENT = 10.0
# Draws of a minimum zone, each a linear programme, and those that are solved as one.
ZONES, ZONES_AT_ONCE = 500, 50


@dataclass(frozen=True, eq=False)
class LaidDimension:
    """A dimension in a place, with the rows of its `members` among all.

    `bow` (n,) is a form deviation of its feature, see `bow`, and `bow_members` (k,) are the members
    that it makes.
    """

    dimension: Dimension
    place: Place
    members: slice
    bow: Array
    bow_members: Array


@dataclass(frozen=True, eq=False)
class LaidPart:
    """A part on a machine: its touched `points`, and its dimensions in all places as
    `combinations`. `outside` (n, q) is the root of the covariance of displacements along normals
    beside the map.
    """

    part: Workpiece
    machine: ProbingMachine
    points: TouchedPoints
    dimensions: tuple[LaidDimension, ...]
    outside: csr_array
    combinations: Combinations


def laid_in_design(design: Design) -> LaidPart:
    """Return the part of a design's experiment on its machine.

    :raises ValueError: as `lay_out_part`.
    """
    return lay_out_part(design.sections["part"], of_design(design))


def lay_out_part(part: Workpiece, machine: ProbingMachine) -> LaidPart:
    """Return a part on a machine.

    :raises ValueError: as `touched`.
    """
    from scipy.sparse import csr_array, lil_array

    points = touched(part, machine)
    by_dimension = [(dimension, _weights(part, dimension)) for dimension in part.dimensions]
    counts = [len(next(iter(by_feature.values()))) for _, by_feature in by_dimension]
    n, start, laid = len(points.normals), 0, list[LaidDimension]()
    by_normal = lil_array((sum(counts) * len(part.places), n))
    for (dimension, by_feature), count in zip(by_dimension, counts, strict=True):
        shape = bow(part, dimension, by_feature)
        made = by_feature[dimension.features[0]] @ shape
        for place in part.places:
            rows, start = slice(start, start + count), start + count
            laid.append(LaidDimension(dimension, place, rows, shape, made))
            for feature, matrix in by_feature.items():
                by_normal[rows, points.rows[place.name, feature]] = matrix
    by_normal = csr_array(by_normal)
    along = csr_array((points.normals.ravel(), np.arange(3 * n), 3 * np.arange(n + 1)), (n, 3 * n))
    outside = outside_root(part, points, machine)
    widths = [widest(one.dimension) for one in laid]
    combinations = Combinations(
        MeasuredPoints(points.readings, points.probes),
        by_normal @ along,
        by_normal @ outside,
        np.array([0, *(one.members.stop for one in laid)]),
        tuple(_errors(one, by_normal[one.members], points) for one in laid),
        tuple(name_in(part, one) for one in laid),
        tuple(one.dimension.unit for one in laid),
        np.array([one.dimension.nominal for one in laid]),
        tuple(
            None
            if width is None
            else Target(LengthFunction(part.share_of_tolerance * width), COVERAGE)
            for width in widths
        ),
        np.full(start, np.nan),
    )
    return LaidPart(part, machine, points, tuple(laid), outside, _with_allowed(combinations))


def _weights(part: Workpiece, dimension: Dimension) -> dict[str, Array]:
    """Return derivatives (k, n) by feature, NaN of one that its points or datums leave open."""
    if dimension.name not in part.undetermined:
        return weights(part, dimension)
    (name, *_) = dimension.features
    return {name: np.full((1, len(part.features[name].points)), np.nan)}


def name_in(part: Workpiece, laid: LaidDimension) -> str:
    """Return the name of a dimension, with that of its place if there are several."""
    name = laid.dimension.name
    return name if len(part.places) == 1 else f"{name} ({laid.place.name})"


def tolerance_width(dimension: Dimension) -> float | None:
    """Return the width of a tolerance, that of a form or zone from zero; None without one."""
    lower, upper = dimension.tolerance or (None, None)
    if dimension.components is not None:
        return upper
    return None if lower is None or upper is None else upper - lower


def widest(dimension: Dimension) -> float | None:
    """Return the expanded uncertainty that takes the whole tolerance, of two limits the half of it;
    None without one.
    """
    width = tolerance_width(dimension)
    if width is None or dimension.components is not None:
        return width
    return width / 2.0


def _errors(
    laid: LaidDimension, matrix: csr_array, points: TouchedPoints
) -> Callable[[Array], Array] | None:
    """Return errors (b, c) of a value from those of its members (b, k): at the deviation that the
    part is expected to have, and at the tolerance in the shapes in which a part at this limit seems
    smallest and largest; None of a linear value.
    """
    dimension = laid.dimension
    if dimension.components is None:
        return None
    width = tolerance_width(dimension) or 0.0
    is_open = bool(np.isnan(matrix.data).any())
    zone = _zone(matrix, points, laid) if dimension.zone and not is_open else None

    def errors(members: Array) -> Array:
        some = members if zone is None else members[:ZONES]
        expected = dimension.form * laid.bow_members
        value = zone or (lambda those: combine(dimension, those))
        found = [value(expected + some) - value(expected[None])]
        for deviation in _extremes(members, dimension):
            found.append(combine(dimension, width * deviation + some) - width)
        return np.stack(found, axis=1)

    return errors


def _extremes(members: Array, dimension: Dimension) -> tuple[Array, Array]:
    """Return two deviations (k,) of size one by the scatter of members (b, k): one at which a part
    seems smallest, with a range between the two points that scatter most against each other, or one
    vector alone along its main direction; and one at which it seems largest, with half of the
    points at each end, or all vectors.
    """
    covariance = np.cov(members, rowvar=False).reshape(members.shape[1], -1)
    least = np.zeros(len(covariance))
    if not dimension.components:
        variances = np.diagonal(covariance)
        of_pairs = variances[:, None] + variances - 2.0 * covariance
        least[list(divmod(first_largest(of_pairs.ravel()), len(least)))] = 0.5, -0.5
        return least, np.where(np.arange(len(least)) % 2, 0.5, -0.5)
    count, most = dimension.components, np.zeros(len(covariance))
    blocks = [slice(k, k + count) for k in range(0, len(least), count)]
    for block in blocks:
        most[block] = eigh(covariance[block, block])[1][:, -1]
    most /= combine(dimension, most[None])[0]
    largest = first_largest(np.array([np.trace(covariance[b, b]) for b in blocks]))
    least[blocks[largest]] = most[blocks[largest]]
    return least, most


def bow(part: Workpiece, dimension: Dimension, by_feature: Mapping[str, Array]) -> Array:
    """Return displacements (n,) of the points of a dimension's feature along its normals by a
    smooth deviation whose value is one: of a form a bow, of an orientation a tilt, of a position a
    shift. It is the first of a few that the value senses.
    """
    feature = part.features[dimension.features[0]]
    away = feature.points - feature.points.mean(axis=0)
    one, other, _ = (away @ svd(away)[2].T).T
    shapes = [one**2, other**2, one * other] if dimension.kind in FORMS else [one, other]
    if dimension.components:
        to = feature.normals @ sensed(feature.nominal).T
        depth = 1.0 if dimension.kind == "position" else away @ feature.nominal.direction
        shapes = [column * depth for column in to.T]
    made = [
        shape / (combine(dimension, (by_feature[feature.name] @ shape)[None])[0] or 1.0)
        for shape in (each / (np.abs(each).max() or 1.0) for each in shapes)
    ]
    return next((shape for shape in made if np.abs(shape).max() < MOST_BENT), made[0])


def _zone(
    matrix: csr_array, points: TouchedPoints, laid: LaidDimension
) -> Callable[[Array], Array]:
    """Return minimum zones (b,) of least-squares residuals (b, k): the smallest range after any
    change of the element, to which they are perpendicular.
    """
    square = matrix[:, points.rows[laid.place.name, laid.dimension.features[0]]].toarray()
    vectors, sizes, _ = svd(square)
    # All elements with a form can move all points alike: the zone reaches as far to both sides.
    free = vectors[:, sizes < 0.5]

    def zones(members: Array) -> Array:
        found = []
        for start in range(0, len(members), ZONES_AT_ONCE):
            some = members[start : start + ZONES_AT_ONCE]
            found.append(
                2.0 * least_largest(np.broadcast_to(free, (len(some), *free.shape)), some)[1]
            )
        return np.concatenate(found)

    return zones


def _with_allowed(combinations: Combinations) -> Combinations:
    """Return combinations with the standard uncertainty by the map that each member may have: of a
    value that is not linear, in the proportion that it has without a map.
    """
    allowed = np.full(combinations.weights.shape[0], np.nan)
    outside = np.sqrt(combinations.outside_variances)
    without_map = combined_uncertainties(combinations, np.zeros((len(outside), 1)))
    for i, value in enumerate(without_map):
        if value.target is None or math.isnan(value.standard_uncertainty):
            continue
        members = combinations.members(i)
        largest = float(outside[members].max())
        # Of a form of three points both are zero, but for rounding.
        factor = value.expanded_uncertainty / (largest or 1.0) or COVERAGE
        left = (value.target / factor) ** 2 - largest**2
        allowed[members] = np.sqrt(max(left, 0.0))
    return replace(combinations, allowed=allowed)
