"""The uncertainties U1 to U6 of NPL Report CISE 15/98, section 6, and those of measuring tasks."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from ballplate.simulator.computing.rounding import first_largest
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
    coordinate_name,
    displacements,
)
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.inputs.quantities import LengthFunction, Target
from ballplate.simulator.machines.protocol import Array

from .kernel_quantities import evaluation_points
from .pairs import PairSummary, PairTile, all_pairs, pairs_of
from .quantities import DESCRIPTIONS, QUANTITIES, functions_of
from .tasks import TaskUncertainty, task_uncertainties


@dataclass(frozen=True)
class Quantity:
    """Standard uncertainties of one kind: the largest and the mean of those that are determined.

    `count` of them there are, `undetermined` of which the observations leave open; the maximum and
    the average are NaN when nothing is left, and `largest` then is empty, otherwise it names where
    the maximum stands. `within_target` is the share of distances whose uncertainty,
    `coverage_factor` times the standard one, is within the target uncertainty, those undetermined
    counted as not; None where no target is compared with. `places` tell where in the volume the
    evaluation points are that `largest` names. `named` are distances with names one by one,
    `parameters` names of parameters with their uncertainties, NaN where undetermined.
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
    named: tuple[TaskUncertainty, ...] = field(default=(), repr=False)
    parameters: tuple[tuple[str, float], ...] = field(default=(), repr=False)

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
            functions_of(symbol, at.design, at.layout)
            if symbols is None or symbol in symbols
            else ()
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


def tasks_of(quantities: Mapping[str, Quantity]) -> tuple[TaskUncertainty, ...]:
    """The measuring tasks one by one; none without any."""
    return quantities["tasks"].named if "tasks" in quantities else ()


def _of_parameters(
    at: Linearisation, symbol: str, given: Parameters, sigma: float
) -> dict[str, Quantity]:
    values, kind = sigma * at.of_shared(given.rows), QUANTITIES[symbol]
    unit = kind.unit or ", ".join(unit for unit in ("m", "rad", "1") if unit in given.units)
    whole = summarise(symbol, values, unit, given.names.__getitem__)
    if kind.one_by_one:
        whole = replace(whole, parameters=tuple(zip(given.names, values.tolist(), strict=True)))
    found = {symbol: whole}
    for part, (word, _) in kind.parts.items():
        chosen = [i for i, unit in enumerate(given.units) if unit == part]
        if chosen:
            name = f"{symbol} {word}"
            names = [given.names[i] for i in chosen]
            found[name] = summarise(name, values[chosen], part, names.__getitem__)
    return found


def _of_coordinates(
    at: Linearisation,
    symbol: str,
    places: Places,
    displaced: Callable[[Places], Displacements],
    sigma: float,
) -> Quantity:
    if isinstance(places, BallPlaces):
        values = sigma * at.of_balls()[places.index].ravel()
    else:
        values = sigma * displaced(places).uncertainties.ravel()
    found = summarise(symbol, values, "m", lambda index: coordinate_name(at.design, places, index))
    if isinstance(places, BallPlaces) or not found.largest:
        return found
    return replace(found, places=(_point(places, first_largest(values) // at.design.dimension),))


def _of_named(symbol: str, given: Distances, tile: PairTile, sigma: float) -> Quantity:
    """Distances that have names, each compared with its own target."""
    named = task_uncertainties(given, tile, sigma)
    values = np.array([one.standard_uncertainty for one in named])
    found = replace(summarise(symbol, values, "m", given.names.__getitem__), named=named)
    judged = [one.is_within for one in named if one.is_within is not None]
    if not judged:
        return found
    share = sum(judged) / len(judged)
    return replace(found, within_target=share, coverage_factor=named[0].coverage_factor)


def _of_pairs(
    design: Design,
    symbol: str,
    groups: list[tuple[Places, Displacements]],
    sigma: float,
    target: Target | None,
) -> Quantity | None:
    """Distances between all places of each group; None where all coincide."""
    limit = None if target is None else target.standard
    pairs = sum(
        (all_pairs(moved, places.labels, limit, sigma) for places, moved in groups), PairSummary()
    )
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


def summarise(symbol: str, values: Array, unit: str, name_of: Callable[[int], str]) -> Quantity:
    """Maximum and average of the standard uncertainties `values` (m,) that are not NaN."""
    open_ = np.isnan(values)
    if open_.all():
        return Quantity(symbol, np.nan, np.nan, unit, len(values), len(values))
    top = first_largest(values)
    return Quantity(
        symbol,
        float(np.nanmax(values)),
        float(np.nanmean(values)),
        unit,
        len(values),
        int(open_.sum()),
        name_of(top),
    )
