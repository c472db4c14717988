"""The uncertainties U1 to U6 of NPL Report CISE 15/98, section 6."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulator.design import Design, Integers, State
from simulator.estimation.covariance import Covariance, blank
from simulator.estimation.parameters import SharedLayout
from simulator.geometry.motions import without_rigid_motion
from simulator.machines.protocol import Array

# Balls or points on a side of the tiles in which pairs are worked through: their products stay in cache.
TILE = 256

DESCRIPTIONS = {
    "U1": "ball co-ordinates",
    "U2": "pose parameters",
    "U2 lengths": "pose parameters: origins",
    "U2 angles": "pose parameters: rotations",
    "U3": "model parameters",
    "U3 lengths": "model parameters: positional errors",
    "U3 angles": "model parameters: rotational errors",
    "U3 ratios": "model parameters: ratios",
    "U4": "error function at the evaluation points",
    "U5": "distances between balls",
    "U6": "distances between corrected points",
}


@dataclass(frozen=True)
class Quantity:
    """Standard uncertainties of one kind: the largest and the mean of those that are determined.

    `count` of them there are, `undetermined` of which the observations leave open; the maximum and the
    average are NaN when nothing is left, and `largest` then is empty, otherwise it names where the maximum stands.
    """

    symbol: str
    maximum: float
    average: float
    unit: str
    count: int
    undetermined: int = 0
    largest: str = ""

    @property
    def description(self) -> str:
        return DESCRIPTIONS[self.symbol]


def uncertainties(
    design: Design, layout: SharedLayout, state: State, found: Covariance, sigma: float = 1.0
) -> dict[str, Quantity]:
    """U1 to U6 for a design at `state`, with U2 and U3 also split into lengths and angles.

    `sigma` multiplies all stated uncertainties: 1 for planning, the residuals' estimate after a fit. U3 is quoted for
    the model's reported parameters, monomials on [0, 1] for a kinematic model. U5 runs over all pairs of balls
    of an artefact, U6 over all pairs of evaluation points.
    """
    result: dict[str, Quantity] = {}

    def add(symbol: str, values: Array, unit: str, names: list[str] | tuple[str, ...]) -> None:
        if len(values):
            result[symbol] = summarise(symbol, sigma * values, unit, names)

    balls = design.plate_balls
    axes = ("x", "y", "z")[: design.dimension]
    of_balls = found.of_balls()[balls]
    labels = [f"ball {design.ball_label(b)} {axis}" for b in balls for axis in axes]
    add("U1", of_balls.ravel(), "m", labels)

    poses = layout.poses
    names = [p.name for p in layout.parameters[poses]]
    of_poses = found.of_shared(np.eye(len(layout))[poses])
    angle = layout.is_angle[poses]
    add("U2", of_poses, "m, rad", names)
    add("U2 lengths", of_poses[~angle], "m", [n for n, a in zip(names, angle, strict=True) if not a])
    add("U2 angles", of_poses[angle], "rad", [n for n, a in zip(names, angle, strict=True) if a])

    reported = design.model.reported()
    matrix = np.zeros((len(reported.names), len(layout)))
    matrix[:, layout.model] = reported.matrix
    of_model = found.of_shared(matrix)
    units = np.array(reported.units)
    present = [u for u in ("m", "rad", "1") if (units == u).any()]
    add("U3", of_model, ", ".join(present), reported.names)
    for unit, word in (("m", "lengths"), ("rad", "angles"), ("1", "ratios")):
        chosen = np.flatnonzero(units == unit)
        add(f"U3 {word}", of_model[chosen], unit, [reported.names[i] for i in chosen])

    pairs = ball_pairs(design, state, found)
    if pairs.count:
        result["U5"] = pairs.quantity("U5", sigma, lambda i: f"ball {design.ball_label(i)}")

    if len(design.points):
        of_points, points = point_pairs(design, layout, state, found)
        point_names = [f"point {i + 1} {axis}" for i in range(len(design.points)) for axis in axes]
        add("U4", of_points.ravel(), "m", point_names)
        if points.count:
            result["U6"] = points.quantity("U6", sigma, lambda i: f"point {i + 1}")
    order = list(DESCRIPTIONS)
    return dict(sorted(result.items(), key=lambda item: order.index(item[0])))


def summarise(symbol: str, values: Array, unit: str, names: list[str] | tuple[str, ...]) -> Quantity:
    """Maximum and average of the standard uncertainties `values` (m,) that are not NaN."""
    open_ = np.isnan(values)
    if open_.all():
        return Quantity(symbol, np.nan, np.nan, unit, len(values), len(values))
    top = int(np.nanargmax(values))
    return Quantity(
        symbol, float(values[top]), float(np.nanmean(values)), unit, len(values), int(open_.sum()), names[top]
    )


@dataclass(frozen=True)
class PairSummary:
    """Running result over pairs: how many, how many open, sum and maximum of the others and where."""

    count: int = 0
    undetermined: int = 0
    total: float = 0.0
    maximum: float = 0.0
    where: tuple[int, int] = (-1, -1)

    def __add__(self, other: PairSummary) -> PairSummary:
        top = self if self.maximum >= other.maximum else other
        return PairSummary(
            self.count + other.count,
            self.undetermined + other.undetermined,
            self.total + other.total,
            top.maximum,
            top.where,
        )

    def quantity(self, symbol, sigma, name) -> Quantity:  # type: ignore[no-untyped-def]
        """As a quantity, with `name(index)` for the two ends of the longest bar of uncertainty."""
        determined = self.count - self.undetermined
        if not determined:
            return Quantity(symbol, np.nan, np.nan, "m", self.count, self.undetermined)
        where = f"{name(self.where[0])} to {name(self.where[1])}"
        return Quantity(
            symbol, sigma * self.maximum, sigma * self.total / determined, "m", self.count, self.undetermined, where
        )


def ball_pairs(design: Design, state: State, found: Covariance) -> PairSummary:
    """U5: distances between all pairs of balls of each artefact, in tiles of bounded size."""
    summary = PairSummary()
    for artefact in np.flatnonzero(design.is_plate):
        balls = np.flatnonzero(design.ball_artefact == artefact)
        summary = summary + all_pairs(
            state.balls[balls], found.ball[balls], found.ball_own[balls], found.ball_null[balls], balls
        )
    return summary


def point_pairs(design: Design, layout: SharedLayout, state: State, found: Covariance) -> tuple[Array, PairSummary]:
    """U4 (points, d) and U6 at the design's evaluation points."""
    offsets = np.broadcast_to(design.probes[design.point_probe], design.points.shape)
    jacobian = design.model.jacobian(design.points, state.a, offsets)
    of_shared = np.zeros((*jacobian.shape[:2], len(layout)))
    of_shared[:, :, layout.model] = jacobian
    spread, null = of_shared @ found.shared, of_shared @ found.shared_null
    values = np.sqrt((spread**2).sum(axis=2))
    size = np.sqrt(((of_shared * found.scale) ** 2).sum(axis=2))
    corrected = design.points + design.model.error(design.points, state.a, offsets)
    n, d = design.points.shape
    pairs = all_pairs(corrected, spread, np.zeros((n, d, d)), null, np.arange(n))
    return blank(values, null, size), pairs


def all_pairs(places: Array, common: Array, own: Array, null: Array, labels: Integers) -> PairSummary:
    """Standard uncertainty of the distances between all pairs of `places` (n, d).

    The places' errors are `common` (n, d, r) times r shared standard normal variables plus `own` (n, d, d) times
    their own; `null` (n, d, k) moves them along undetermined directions. Memory is that of a tile of pairs.
    """
    places = places - places.mean(axis=0) if len(places) else places
    common = without_rigid_motion(places, common)
    null = without_rigid_motion(places, null)
    single = common @ common.transpose(0, 2, 1) + own @ own.transpose(0, 2, 1)
    return sum(
        (_tile(places, common, single, null, labels, rows, columns) for rows, columns in _tiles(len(places))),
        PairSummary(),
    )


def _tiles(n: int) -> Iterator[tuple[slice, slice]]:
    edges = [slice(start, min(start + TILE, n)) for start in range(0, n, TILE)]
    for i, rows in enumerate(edges):
        for columns in edges[i:]:
            yield rows, columns


def _tile(
    places: Array, common: Array, single: Array, null: Array, labels: Integers, rows: slice, columns: slice
) -> PairSummary:
    diagonal = rows.start == columns.start
    n, m, d = rows.stop - rows.start, columns.stop - columns.start, places.shape[1]
    difference = [places[rows, None, axis] - places[None, columns, axis] for axis in range(d)]
    # A plate lies in a plane of its own frame, so that one component of all its distances is zero.
    used = [axis for axis in range(d) if difference[axis].any()]
    squared = sum((difference[axis] ** 2 for axis in used), np.zeros((n, m)))
    chosen: NDArray[np.bool_] = np.triu(squared > 0, 1) if diagonal else squared > 0
    weighted = np.zeros((n, m))
    for i in used:
        for j in used[used.index(i) :]:
            product = common[rows, i] @ common[columns, j].T
            product += product if i == j else common[rows, j] @ common[columns, i].T
            np.subtract(single[rows, None, i, j] + single[None, columns, i, j], product, out=product)
            product *= difference[i]
            product *= difference[j]
            weighted += product if i == j else 2.0 * product
    squared[~chosen] = 1.0
    values = np.sqrt(np.maximum(weighted / squared, 0.0))[chosen]
    open_ = np.zeros(len(values), bool)
    if null.shape[2]:
        change = sum(difference[i][:, :, None] * (null[rows, None, i, :] - null[None, columns, i, :]) for i in range(d))
        size = np.sqrt((np.asarray(change) ** 2).sum(axis=2) / squared)
        open_ = size[chosen] > _open_above(null)
    count = int(chosen.sum())
    if not (~open_).any():
        return PairSummary(count, int(open_.sum()))
    determined = np.where(open_, -1.0, values)
    top = int(determined.argmax())
    row, column = (int(k[top]) for k in np.nonzero(chosen))
    where = (int(labels[rows.start + row]), int(labels[columns.start + column]))
    return PairSummary(count, int(open_.sum()), float(values[~open_].sum()), float(determined[top]), where)


def _open_above(null: Array) -> float:
    """What a null direction must change a distance by to leave it open: well above rounding."""
    return 1e-7 * float(np.sqrt((null**2).sum(axis=2)).max(initial=0.0)) + 1e-13
