"""Summaries of the uncertainties U1 to U6 (NPL Report CISE 15/98, section 6) and of measuring
tasks.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.computing.numerics import first_largest
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.functions import (
    BallPlaces,
    Combinations,
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
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantities import Target

from .pairs import PairSummary, all_pairs
from .quantities import DESCRIPTIONS, QUANTITIES, evaluation_points, functions_of

if TYPE_CHECKING:
    from .named_values import NamedUncertainty


@dataclass(frozen=True)
class Quantity:
    """Standard uncertainties of a quantity: maximum and average of all.

    `count` includes `undetermined` ones; with any, maximum and average are NaN and `largest`, the
    name of the maximum, is empty. `within_target` is the share of distances whose
    uncertainty, `coverage_factor` times the standard one, is within the target uncertainty
    (undetermined ones are not); None without target. `places` locate the evaluation points of
    `largest`, and `pair` are their indices if it is a distance. `named` are distances with names,
    `parameters` names of parameters with their uncertainties, NaN if undetermined.
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
    pair: tuple[int, int] | None = None
    named: tuple[NamedUncertainty, ...] = field(default=(), repr=False)
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
    """Return all quantities of a linearised design, or those of some `symbols`, also split by
    unit.

    `sigma` multiplies all stated uncertainties: 1 for planning, the residuals' estimate after a
    fit. The distances between corrected points are compared with the `target`, measuring tasks with
    their own.
    """
    quantities: dict[str, Quantity] = {}
    cache = {}

    def displaced(places: Places) -> Displacements:
        if isinstance(places, BallPlaces):
            return displacements(at, places)
        # Co-ordinates and distances of the same points share displacements.
        key = places.points.tobytes() + places.probes.tobytes()
        if key not in cache:
            cache[key] = displacements(at, places)
        return cache[key]

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
            quantities |= _of_parameters(at, symbol, first, sigma)
        elif isinstance(first, Coordinates):
            quantities[symbol] = _of_coordinates(at, symbol, first.places, displaced, sigma)
        elif isinstance(first, Combinations) or first.pairs is not None:
            from .named_values import named_values

            named = named_values(first, displaced(first.places), sigma)
            quantities[symbol] = _of_named(symbol, named)
        else:
            groups = [
                (group.places, displaced(group.places))
                for group in functions
                if isinstance(group, Distances)
            ]
            lengths = _of_pairs(
                at.design, symbol, groups, sigma, target if kind.has_target else None
            )
            quantities |= {} if lengths is None else {symbol: lengths}
    return quantities


def tasks_of(quantities: Mapping[str, Quantity]) -> tuple[NamedUncertainty, ...]:
    """Return the measuring tasks."""
    return quantities["tasks"].named if "tasks" in quantities else ()


def _of_parameters(
    at: Linearisation, symbol: str, parameters: Parameters, sigma: float
) -> dict[str, Quantity]:
    values, kind = sigma * at.of_shared(parameters.rows), QUANTITIES[symbol]
    unit = kind.unit or ", ".join(unit for unit in ("m", "rad", "1") if unit in parameters.units)
    whole = summarise(symbol, values, unit, parameters.names.__getitem__)
    if kind.one_by_one:
        whole = replace(
            whole, parameters=tuple(zip(parameters.names, values.tolist(), strict=True))
        )
    quantities = {symbol: whole}
    for part, (word, _) in kind.parts.items():
        chosen = [i for i, unit in enumerate(parameters.units) if unit == part]
        if chosen:
            name = f"{symbol} {word}"
            names = [parameters.names[i] for i in chosen]
            quantities[name] = summarise(name, values[chosen], part, names.__getitem__)
    return quantities


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
    quantity = summarise(
        symbol, values, "m", lambda index: coordinate_name(at.design, places, index)
    )
    if isinstance(places, BallPlaces) or not quantity.largest:
        return quantity
    return replace(quantity, places=(_point(places, first_largest(values) // at.design.dimension),))


def _of_named(symbol: str, named: tuple[NamedUncertainty, ...]) -> Quantity:
    """Return the quantity of values with names, each compared with its own target."""
    values = np.array([value.standard_uncertainty for value in named])
    units = ", ".join(dict.fromkeys(value.unit for value in named))
    quantity = summarise(symbol, values, units, lambda index: named[index].name)
    verdicts = [value.is_within for value in named if value.is_within is not None]
    share = sum(verdicts) / len(verdicts) if verdicts else None
    factor = named[0].coverage_factor if verdicts else 1.0
    return replace(quantity, named=named, within_target=share, coverage_factor=factor)


def _of_pairs(
    design: Design,
    symbol: str,
    groups: list[tuple[Places, Displacements]],
    sigma: float,
    target: Target | None,
) -> Quantity | None:
    """Return the quantity of distances between all points of each group; None if all coincide."""
    # Pairs have standard uncertainties, and are compared with the target for these.
    limit = None if target is None else target.standard
    pairs = sum(
        (all_pairs(moved, places.labels, limit, sigma) for places, moved in groups), PairSummary()
    )
    if not pairs.count:
        return None
    quantity = Quantity(symbol, np.nan, np.nan, "m", pairs.count, pairs.undetermined)
    places = groups[0][0]
    # With undetermined pairs maximum and average stay NaN: those of the rest would be of a part
    # that differs from design to design.
    if not pairs.undetermined:
        where = " to ".join(places.name(design, label) for label in pairs.where)
        average = sigma * pairs.total / pairs.count
        quantity = replace(quantity, maximum=sigma * pairs.maximum, average=average, largest=where)
        if isinstance(places, MeasuredPoints):
            ends = tuple(_point(places, label) for label in pairs.where)
            quantity = replace(quantity, places=ends, pair=pairs.where)
    if target is None:
        return quantity
    return replace(
        quantity, within_target=pairs.within / pairs.count, coverage_factor=target.coverage_factor
    )


def _point(places: MeasuredPoints, label: int) -> str:
    """Return a point's number from 1, as in the file, and its co-ordinates."""
    coordinates = ", ".join(f"{round(1e3 * value, 1) + 0.0:.9g}" for value in places.points[label])
    return f"point {label + 1} at ({coordinates}) mm"


def point_pairs(at: Linearisation) -> tuple[Array, PairSummary]:
    """Return uncertainties of the corrected evaluation points' co-ordinates (n, d), and of all
    distances between them.
    """
    places = evaluation_points(at.design)
    moved = displacements(at, places)
    return moved.uncertainties, all_pairs(moved, places.labels)


def summarise(symbol: str, values: Array, unit: str, name_of: Callable[[int], str]) -> Quantity:
    """Return maximum and average of the standard uncertainties `values` (m,), NaN with any NaN."""
    undetermined = int(np.isnan(values).sum())
    # What is determined is a part that differs from design to design: an average over it is none.
    if undetermined or not len(values):
        return Quantity(symbol, np.nan, np.nan, unit, len(values), undetermined)
    largest = name_of(first_largest(values))
    return Quantity(
        symbol, float(values.max()), float(values.mean()), unit, len(values), largest=largest
    )
