"""Columns of a frame that tables and plots show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ballplate.presentation import shown_unit
from ballplate.uncertainty import DESCRIPTIONS

from ..store_columns import MORE, symbol_column
from .results import ReportedSweep

STATISTICS = ("maximum", "average")


@dataclass(frozen=True)
class Measure:
    """Column `figure` of the frame times `factor` in `unit`, with the column of any standard
    error.
    """

    symbol: str
    statistic: str
    unit: str
    figure: str
    factor: float = 1e6
    error: str = ""
    is_count: bool = False

    @property
    def name(self) -> str:
        return f"{self.symbol} {self.statistic}"

    @property
    def title(self) -> str:
        return f"{self.name}, {self.unit}" if self.unit else self.name


def uncertainty_measures(results: ReportedSweep, of_parts: bool = True) -> list[Measure]:
    """Return maximum and average of all recorded uncertainties, with shares within the target.

    `of_parts` includes lengths and angles of U2 and U3, and numbers of undetermined values.
    """
    measures = []
    for symbol in DESCRIPTIONS:
        if " " in symbol and not of_parts:
            continue
        name = symbol_column(symbol)
        for statistic in STATISTICS:
            measures += [
                Measure(symbol, statistic, unit, column)
                for column, unit in _columns(results, f"{name}_{statistic}_")
            ]
        open_, share = f"{name}_undetermined", f"{name}_within_target"
        if of_parts and (results.figure(open_) > 0).any():
            measures.append(Measure(symbol, "undetermined", "", open_, 1.0, is_count=True))
        if share in results.frame:
            measures.append(Measure(symbol, "within target", "%", share, 100.0))
    return measures


def rank_measures(results: ReportedSweep) -> list[Measure]:
    """Return the rank deficiency, unless all cells have full rank."""
    column = "rank_deficiency"
    if not (results.figure(column) > 0).any():
        return []
    return [Measure("rank", "deficiency", "", column, 1.0, is_count=True)]


def trial_measures(results: ReportedSweep, of_parts: bool = True) -> list[Measure]:
    """Return the measures of Monte Carlo; an empty list without trials."""
    measures = []
    for symbol in trial_symbols(results):
        if " " in symbol and not of_parts:
            continue
        name = symbol_column(symbol)
        measures += [
            Measure(symbol, "actual average", unit, column)
            for column, unit in _columns(results, f"{name}_actual_average_")
        ]
        for statistic, column, unit, factor in (
            ("spread / U", "spread_ratio", "", 1.0),
            ("bias / U", "bias_ratio", "", 1.0),
            ("covered", "coverage_sigma_given", "%", 100.0),
        ):
            figure = f"{name}_{column}"
            measures.append(
                Measure(symbol, statistic, unit, figure, factor, f"{figure}_standard_error")
            )
    return measures


def trial_symbols(results: ReportedSweep) -> list[str]:
    """Return quantities with Monte Carlo results; dashes mark those of further artefacts."""
    symbols = []
    for symbol in DESCRIPTIONS:
        while f"{symbol_column(symbol)}_spread_ratio" in results.frame:
            symbols.append(symbol)
            symbol += MORE
    return symbols


def descriptions(measures: Sequence[Measure]) -> list[str]:
    """Return descriptions of the quantities of measures, one line each."""
    return [
        f"{symbol}: {DESCRIPTIONS[symbol.rstrip(MORE)]}"
        + (" of a further artefact" if symbol.endswith(MORE) else "")
        for symbol in dict.fromkeys(measure.symbol for measure in measures)
        if symbol.rstrip(MORE) in DESCRIPTIONS
    ]


def _columns(results: ReportedSweep, start: str) -> list[tuple[str, str]]:
    """Return columns with a prefix, and their printed unit."""
    return [
        (column, _printed_unit(column.removeprefix(start)))
        for column in results.frame.columns
        if column.startswith(start)
    ]


def column_unit(column: str) -> str:
    """Return the printed unit of a column of averages.

    >>> column_unit("U6_average_m"), column_unit("U3_average_m_or_rad")
    ('µm', 'µm or µrad')
    """
    return _printed_unit(column.partition("_average_")[2])


def _printed_unit(suffix: str) -> str:
    unit = suffix.replace("_or_", ", ").replace("ratio", "1")
    return shown_unit(unit).replace(", ", " or ")
