"""The uncertainties U1 to U6 of NPL Report CISE 15/98, section 6, and those of measuring tasks."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing.rounding import comparable
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.functions import (
    BallPlaces,
    Coordinates,
    Displacements,
    Distances,
    MeasuredPoints,
    Parameters,
    Places,
    coordinate_names,
    displacements,
)
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.inputs.quantities import LengthFunction, Target
from ballplate.simulator.machines.protocol import Array

from .pairs import PairSummary, PairTile, all_pairs, pairs_of
from .quantities import DESCRIPTIONS, QUANTITIES, evaluation_points


@dataclass(frozen=True)
class Quantity:
    """Standard uncertainties of one kind: the largest and the mean of those that are determined.

    `count` of them there are, `undetermined` of which the observations leave open; the maximum and
    the average are NaN when nothing is left, and `largest` then is empty, otherwise it names where
    the maximum stands. `within_target` is the share of distances whose uncertainty,
    `coverage_factor` times the standard one, is within the target uncertainty, those undetermined
    counted as not; None where no target is compared with. `places` tell where in the volume the
    evaluation points are that `largest` names.
    """

    symbol: str
    maximum: float
    average: float
    unit: str
    count: int
    undetermined: int = 0
    largest: str = ""
    within_target: float | None = None
    coverage_factor: float = 1.0
    places: tuple[str, ...] = ()

    @property
    def description(self) -> str:
        return DESCRIPTIONS[self.symbol]


@single_threaded
def uncertainties(
    at: Linearisation,
    sigma: float = 1.0,
    target: Target | None = None,
    symbols: Collection[str] | None = None,
) -> dict[str, Quantity]:
    """All quantities of a linearised design, or those of some `symbols`; those of several units
    also split by these.

    `sigma` multiplies all stated uncertainties: 1 for planning, the residuals' estimate after a
    fit. The distances between corrected points are compared with the `target` accuracy if there is
    one, measuring tasks with their own.
    """
    found: dict[str, Quantity] = {}
    made: dict[bytes, Displacements] = {}

    def displaced(places: Places) -> Displacements:
        if isinstance(places, BallPlaces):
            return displacements(at, places)
        # Co-ordinates and distances are of the same points.
        key = places.points.tobytes() + places.probes.tobytes()
        if key not in made:
            made[key] = displacements(at, places)
        return made[key]

    for symbol, kind in QUANTITIES.items():
        functions = (
            kind.functions(at.design, at.layout) if symbols is None or symbol in symbols else ()
        )
        if not functions:
            continue
        first = functions[0]
        if isinstance(first, Parameters):
            found |= _of_parameters(at, symbol, first, sigma)
        elif isinstance(first, Coordinates):
            found[symbol] = _of_coordinates(at, symbol, first.places, displaced, sigma)
        elif first.pairs is not None:
            found[symbol] = _of_named(
                symbol, first, pairs_of(displaced(first.places), first.pairs), sigma
            )
        else:
            groups = [
                (one.places, displaced(one.places))
                for one in functions
                if isinstance(one, Distances)
            ]
            lengths = _of_pairs(
                at.design, symbol, groups, sigma, target if kind.has_target else None
            )
            found |= {} if lengths is None else {symbol: lengths}
    return found


def _of_parameters(
    at: Linearisation, symbol: str, given: Parameters, sigma: float
) -> dict[str, Quantity]:
    values, kind = sigma * at.of_shared(given.rows), QUANTITIES[symbol]
    unit = kind.unit or ", ".join(unit for unit in ("m", "rad", "1") if unit in given.units)
    found = {symbol: summarise(symbol, values, unit, given.names)}
    for part, (word, _) in kind.parts.items():
        chosen = [i for i, unit in enumerate(given.units) if unit == part]
        if chosen:
            name = f"{symbol} {word}"
            found[name] = summarise(name, values[chosen], part, [given.names[i] for i in chosen])
    return found


def _of_coordinates(
    at: Linearisation,
    symbol: str,
    places: Places,
    displaced: Callable[[Places], Displacements],
    sigma: float,
) -> Quantity:
    if isinstance(places, BallPlaces):
        return summarise(
            symbol,
            sigma * at.of_balls()[places.index].ravel(),
            "m",
            coordinate_names(at.design, places),
        )
    names = coordinate_names(at.design, places)
    found = summarise(symbol, sigma * displaced(places).uncertainties.ravel(), "m", names)
    if not found.largest:
        return found
    return replace(
        found, places=(_point(places, names.index(found.largest) // at.design.dimension),)
    )


def _of_named(symbol: str, given: Distances, tile: PairTile, sigma: float) -> Quantity:
    """Distances that have names, each compared with its own target."""
    values = sigma * np.where(tile.is_open, np.nan, tile.uncertainties)
    found = summarise(symbol, values, "m", given.names)
    judged = [
        target.coverage_factor * value <= float(target.stated.at(length))
        for target, length, value in zip(given.targets, tile.lengths, values, strict=False)
        if target is not None
    ]
    if not judged:
        return found
    factor = 1.0 if given.targets[0] is None else given.targets[0].coverage_factor
    return replace(found, within_target=sum(judged) / len(judged), coverage_factor=factor)


def _of_pairs(
    design: Design,
    symbol: str,
    groups: list[tuple[Places, Displacements]],
    sigma: float,
    target: Target | None,
) -> Quantity | None:
    """Distances between all places of each group; None where all coincide."""
    # Compared before sigma multiplies the uncertainties, so that the limit is divided by it.
    limit = None if target is None else Target(target.standard, sigma).standard
    pairs = sum((all_pairs(moved, places.labels, limit) for places, moved in groups), PairSummary())
    if not pairs.count:
        return None
    determined = pairs.count - pairs.undetermined
    found = Quantity(symbol, np.nan, np.nan, "m", pairs.count, pairs.undetermined)
    places = groups[0][0]
    if determined:
        where = " to ".join(places.name(design, label) for label in pairs.where)
        average = sigma * pairs.total / determined
        found = replace(found, maximum=sigma * pairs.maximum, average=average, largest=where)
        if isinstance(places, MeasuredPoints):
            found = replace(found, places=tuple(_point(places, label) for label in pairs.where))
    if target is None:
        return found
    return replace(
        found, within_target=pairs.within / pairs.count, coverage_factor=target.coverage_factor
    )


def _point(places: MeasuredPoints, label: int) -> str:
    """A point by its number from 1, as in the file, and its place."""
    place = ", ".join(f"{round(1e3 * value, 1) + 0.0:.9g}" for value in places.points[label])
    return f"point {label + 1} at ({place}) mm"


def point_pairs(
    at: Linearisation, limit: LengthFunction | None = None
) -> tuple[Array, PairSummary]:
    """Uncertainties of the corrected evaluation points' co-ordinates (n, d), and of all distances
    between them.
    """
    places = evaluation_points(at.design)
    moved = displacements(at, places)
    return moved.uncertainties, all_pairs(moved, places.labels, limit)


def summarise(symbol: str, values: Array, unit: str, names: Sequence[str]) -> Quantity:
    """Maximum and average of the standard uncertainties `values` (m,) that are not NaN."""
    open_ = np.isnan(values)
    if open_.all():
        return Quantity(symbol, np.nan, np.nan, unit, len(values), len(values))
    top = int(np.nanargmax(comparable(values)))
    return Quantity(
        symbol,
        float(np.nanmax(values)),
        float(np.nanmean(values)),
        unit,
        len(values),
        int(open_.sum()),
        names[top],
    )
