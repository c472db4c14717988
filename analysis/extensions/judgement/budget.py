"""The uncertainty budget of a design or a fit: what each source contributes to uncertainties."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np
from ballplate.presentation import Data, MainTable, Result, aligned, number, picked
from ballplate.results import Fit, few_degrees_of_freedom
from ballplate.simulator.computing import comparable, evenly_spread, single_threaded
from ballplate.simulator.estimation import (
    Combinations,
    Coordinates,
    Distances,
    LinearFunctions,
    Linearisation,
    MeasuredPoints,
    Parameters,
    linear_functions,
    linearise,
)
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.uncertainty import QUANTITIES, expansion, functions_of

from .observation_groups import Grouping
from .source_sums import SourceSums, source_sums, sources_of

# Evaluation points of which all distances are looked at; of more, some are chosen evenly.
MOST_PLACES = 200

# Distances of which the derivatives are in memory.
PAIRS_AT_ONCE = 1000

# What contributes to dimensions of parts and is no source of the estimate.
OUTSIDE = "probing and part"
MEMBERS = "a dimension, or of a form or zone the root mean square of what it consists of"

# Figures side by side in a table of text.
SIDE_BY_SIDE = 6


@dataclass(frozen=True)
class BudgetFigure:
    """An uncertainty with the `contributions` of all sources to it, which add in squares; metres.

    Of several functions, such as the distances of U6, it is the root mean square of the determined
    ones; `undetermined` of the `count` are not. NaN if all are undetermined. `outside` is what
    comes from no source of the estimate.
    """

    name: str
    description: str
    standard_uncertainty: float
    contributions: tuple[float, ...]
    count: int = 1
    undetermined: int = 0
    outside: float = 0.0
    unit: str = "m"


@dataclass(frozen=True, repr=False)
class UncertaintyBudget(Result):
    """Contributions of the `sources` of uncertainty to `figures`, standard uncertainties in
    metres, sorted by the contribution to U6, largest first.

    `sigma` has multiplied all stated uncertainties; `coverage_factor` is that of expanded ones.
    `of_fit` is true for a fit, false for a design.
    """

    label: str
    title: str
    sources: tuple[str, ...]
    figures: tuple[BudgetFigure, ...]
    coverage_factor: float
    sigma: float = 1.0
    of_fit: bool = False
    caution: str = ""

    def headline(self) -> str:
        chosen = _ranking(self.figures)
        if chosen is None:
            return f"{len(self.sources)} sources, no quantity is determined"
        return f"{self.sources[0]} {_share(chosen, 0)} of the variance of {chosen.name}"

    def lines(self) -> list[str]:
        subject = "the fit" if self.of_fit else "the design, at zero machine error"
        chosen = _ranking(self.figures)
        order = f"; sources by their part of {chosen.name}, the largest first" if chosen else ""
        lines = [self.heading, f"uncertainty budget of {subject}{order}", ""]
        for start in range(0, len(self.figures), SIDE_BY_SIDE):
            lines += [*self._table(self.figures[start : start + SIDE_BY_SIDE]), ""]
        lines += [f"{figure.name}: {_words(figure)}" for figure in self.figures]
        return lines

    def _table(self, figures: Sequence[BudgetFigure]) -> list[str]:
        rows = [["standard uncertainty, µm", *(figure.name for figure in figures)]]
        for k, source in enumerate(self.sources):
            rows.append([source, *(_cell(figure, k) for figure in figures)])
        rows.append(["together, in squares", *(_micrometres(figure, 1.0) for figure in figures)])
        expanded = f"expanded, k = {self.coverage_factor:g}"
        rows.append([expanded, *(_micrometres(figure, self.coverage_factor) for figure in figures)])
        return aligned(rows, [False, *[True] * len(figures)])

    def columns(self) -> MainTable:
        """Columns with one row per source and uncertainty."""
        count = len(self.sources)
        pairs = [(figure, k) for figure in self.figures for k in range(count)]
        columns = {
            "figure": [figure.name for figure, _ in pairs],
            "source": list(self.sources) * len(self.figures),
            "standard uncertainty, µm": [figure.contributions[k] for figure, k in pairs],
            "share of variance": [_ratio(*pair) for pair in pairs],
            "unit": [figure.unit for figure, _ in pairs],
        }
        return columns, ()

    def data(self) -> Data:
        return {
            **self.named,
            "of": "fit" if self.of_fit else "design",
            **picked(self, "sigma", "coverage_factor"),
            "figures": [
                {
                    "figure": figure.name,
                    **picked(figure, "description", "standard_uncertainty"),
                    "expanded_uncertainty": self.coverage_factor * figure.standard_uncertainty,
                    **picked(figure, "unit", "count", "undetermined"),
                    "contributions": [
                        {
                            "source": source,
                            "standard_uncertainty": figure.contributions[k],
                            "share_of_variance": _ratio(figure, k),
                        }
                        for k, source in enumerate(self.sources)
                    ],
                }
                for figure in self.figures
            ],
            "warnings": self.warnings,
        }

    @property
    def warnings(self) -> tuple[str, ...]:
        return (self.caution,) if self.caution else ()


def _ratio(figure: BudgetFigure, k: int) -> float:
    """Return the share of a source in the variance, NaN without a variance."""
    if not figure.standard_uncertainty > 0.0:
        return float("nan")
    return (figure.contributions[k] / figure.standard_uncertainty) ** 2


def _share(figure: BudgetFigure, k: int) -> str:
    percentage = 100.0 * _ratio(figure, k)
    return f"{percentage:.0f} %" if percentage >= 0.95 else f"{percentage:.1g} %"


def _cell(figure: BudgetFigure, k: int) -> str:
    if not figure.standard_uncertainty > 0.0:
        return "undetermined" if np.isnan(figure.standard_uncertainty) else "0"
    return f"{number(1e6 * figure.contributions[k], 3)} ({_share(figure, k)})"


def _micrometres(figure: BudgetFigure, factor: float) -> str:
    u = factor * figure.standard_uncertainty
    return "undetermined" if np.isnan(u) else number(1e6 * u)


def _words(figure: BudgetFigure) -> str:
    if not figure.undetermined or figure.count == figure.undetermined:
        return figure.description
    undetermined = f"{figure.undetermined} of {figure.count} are undetermined and left out"
    return f"{figure.description}; {undetermined}"


@single_threaded
def budget(
    experiment: Experiment, fit: Fit | None = None, by: Grouping = "calibration"
) -> UncertaintyBudget:
    """Return the uncertainty budget of an experiment's design or of its `fit`.

    `by` groups the readings, by default as one source.

    :raises ValueError: the fit has not converged.
    """
    linearisation, x = (
        (linearise(lay_out(experiment)), None)
        if fit is None
        else (fit.functions.at, fit.observed.x)
    )
    sigma = 1.0 if fit is None else fit.sigma
    sums = source_sums(linearisation, x, sources_of(linearisation.design, experiment, by))
    caution = ""
    if fit is not None and fit.sigma_is_estimated:
        remedy = "--sigma given takes the uncertainties as stated"
        caution = few_degrees_of_freedom(fit.degrees_of_freedom, "sigma", remedy)
    names, computed = sums.names, tuple(_figures(linearisation, sums, sigma))
    if any(figure.outside for figure in computed):
        names, computed = (*names, OUTSIDE), tuple(map(_with_outside, computed))
    names, figures = _largest_first(names, computed)
    return UncertaintyBudget(
        experiment.label,
        experiment.title,
        names,
        figures,
        expansion(experiment.coverage_factor),
        sigma,
        fit is not None,
        caution,
    )


def _with_outside(figure: BudgetFigure) -> BudgetFigure:
    return replace(
        figure,
        standard_uncertainty=float(np.hypot(figure.standard_uncertainty, figure.outside)),
        contributions=(*figure.contributions, figure.outside),
    )


def _ranking(figures: Sequence[BudgetFigure]) -> BudgetFigure | None:
    """Return the uncertainty that ranks sources: U6, or the first determined one."""
    positive = [figure for figure in figures if figure.standard_uncertainty > 0.0]
    return next(
        (figure for figure in positive if figure.name == "U6"), positive[0] if positive else None
    )


def _largest_first(
    sources: tuple[str, ...], figures: tuple[BudgetFigure, ...]
) -> tuple[tuple[str, ...], tuple[BudgetFigure, ...]]:
    """Return sources and contributions in the order of their contribution to the ranking
    uncertainty; a stable sort of values that are equal except rounding.
    """
    chosen = _ranking(figures)
    if chosen is None:
        return sources, figures
    order = np.argsort(-comparable(chosen.contributions), kind="stable").tolist()
    ordered = (
        replace(figure, contributions=tuple(figure.contributions[k] for k in order))
        for figure in figures
    )
    return tuple(sources[k] for k in order), tuple(ordered)


def _figures(
    linearisation: Linearisation, sums: SourceSums, sigma: float
) -> Iterator[BudgetFigure]:
    """Yield the diagonals and all quantities of points of the volume.

    Uncertainties of balls and of single parameters are not split by source.
    """
    design = linearisation.design
    for symbol, kind in QUANTITIES.items():
        groups = functions_of(symbol, design, linearisation.layout)
        functions = [group for group in groups if not isinstance(group, Parameters)]
        places = functions[0].places if functions else None
        if not isinstance(places, MeasuredPoints):
            continue
        if isinstance(functions[0], Coordinates):
            of_points: Iterable[LinearFunctions] = [linear_functions(linearisation, functions[0])]
            words = f"{kind.description}, root mean square of its co-ordinates"
        elif isinstance(functions[0], Combinations):
            yield from _members(linearisation, sums, functions[0], sigma)
            continue
        elif functions[0].names:
            prefix = "" if symbol == "tasks" else f"{symbol} "
            words = f"{kind.description}:"
            yield from _each(prefix, words, linearisation, sums, functions[0], sigma)
            continue
        else:
            of_points = chain.from_iterable(
                _distances(linearisation, _some(group.places)) for group in functions
            )
            words = f"{kind.description}, root mean square"
            if len(places.points) > MOST_PLACES:
                words += f"; between {MOST_PLACES} of the {len(places.points)} evaluation points"
        yield _mean_square(symbol, words, linearisation, sums, of_points, sigma)
    starts, ends = design.machine.volume.diagonals
    names = tuple(f"diagonal {k + 1}" for k in range(len(starts)))
    points = np.stack([starts, ends], axis=1).reshape(-1, design.dimension)
    probes = np.full(len(points), design.evaluation.probe)
    pairs = np.arange(len(points)).reshape(-1, 2)
    diagonals = Distances(MeasuredPoints(points, probes), pairs, names)
    words = "length of the body diagonal" if design.dimension == 3 else "length of the diagonal"
    yield from _each("", words, linearisation, sums, diagonals, sigma)


def _members(
    linearisation: Linearisation, sums: SourceSums, combinations: Combinations, sigma: float
) -> Iterator[BudgetFigure]:
    """Yield the uncertainties of combinations; of a function of several, the root mean square of
    these.
    """
    functions = linear_functions(linearisation, combinations)
    outside = combinations.outside_variances
    for i, name in enumerate(combinations.names):
        members = combinations.members(i)
        unit = combinations.units[i]
        title = name if unit == "m" else f"{name}, µ{unit}"
        some = [LinearFunctions(functions.shared[members])]
        figure = _mean_square(title, MEMBERS, linearisation, sums, some, sigma)
        yield replace(
            figure, unit=unit, outside=float(np.sqrt(outside[members].mean())), undetermined=0
        )


def _some(places: Any) -> MeasuredPoints:
    """Return evenly chosen places, at most `MOST_PLACES`."""
    chosen = evenly_spread(len(places.points), MOST_PLACES)
    return MeasuredPoints(places.points[chosen], places.probes[chosen])


def _ends(distances: Distances, k: int) -> str:
    assert distances.pairs is not None and isinstance(distances.places, MeasuredPoints)
    ends = 1e3 * distances.places.points[distances.pairs[k]]
    return "from {} to {} mm".format(*(f"({', '.join(f'{v:.6g}' for v in end)})" for end in ends))


def _distances(linearisation: Linearisation, places: MeasuredPoints) -> Iterator[LinearFunctions]:
    """Yield distances between all separate points, some at a time."""
    drawn = places.at(linearisation.design, linearisation.as_drawn.state)
    pairs = np.stack(np.triu_indices(len(drawn), 1), axis=1)
    pairs = pairs[(drawn[pairs[:, 0]] != drawn[pairs[:, 1]]).any(axis=1)]
    for start in range(0, len(pairs), PAIRS_AT_ONCE):
        some = pairs[start : start + PAIRS_AT_ONCE]
        yield linear_functions(linearisation, Distances(places, some, ("",) * len(some)))


def _mean_square(
    name: str,
    description: str,
    linearisation: Linearisation,
    sums: SourceSums,
    functions: Iterable[LinearFunctions],
    sigma: float,
) -> BudgetFigure:
    """The root mean square of the uncertainties of many functions that are determined."""
    squares, total, count, undetermined = (
        np.zeros((linearisation.rank, linearisation.rank)),
        0.0,
        0,
        0,
    )
    for some in functions:
        values = linearisation.uncertainty(some)
        is_known = ~np.isnan(values)
        roots = some.shared[is_known] @ linearisation.shared
        squares += roots.T @ roots
        total += float((values[is_known] ** 2).sum())
        count, undetermined = count + len(values), undetermined + int((~is_known).sum())
    number_of = count - undetermined
    shares = sums.of_sum(squares) if number_of else np.full(len(sums.names), np.nan)
    scale = sigma / np.sqrt(max(number_of, 1))
    return BudgetFigure(
        name,
        description,
        scale * np.sqrt(total) if number_of else float("nan"),
        tuple((scale * np.sqrt(np.maximum(shares, 0.0))).tolist()),
        count,
        undetermined,
    )


def _each(
    prefix: str,
    words: str,
    linearisation: Linearisation,
    sums: SourceSums,
    distances: Distances,
    sigma: float,
) -> Iterator[BudgetFigure]:
    """Yield the uncertainties of single distances."""
    functions = linear_functions(linearisation, distances)
    values = linearisation.uncertainty(functions)
    shares = sums.variances(functions.shared @ linearisation.shared)
    shares[:, np.isnan(values)] = np.nan
    contributions = sigma * np.sqrt(np.maximum(shares, 0.0)).T
    for k, (value, parts) in enumerate(
        zip((sigma * values).tolist(), contributions.tolist(), strict=True)
    ):
        name, description = prefix + distances.names[k], f"{words} {_ends(distances, k)}"
        yield BudgetFigure(name, description, value, tuple(parts), 1, int(np.isnan(value)))
