"""The figures that tables and plots show, found among a frame's columns."""

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
    """A figure: column `figure` of the frame times `factor` in `unit`, with the column of its
    standard error if any.
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
    def stands_for_all(self) -> bool:
        """Whether the figure is told of all values of the quantity, those undetermined left out."""
        return self.statistic in (*STATISTICS, "actual average")

    @property
    def is_share(self) -> bool:
        """Whether the figure is a share within a target."""
        return self.statistic == "within target"

    @property
    def title(self) -> str:
        return f"{self.name}, {self.unit}" if self.unit else self.name


def uncertainty_measures(results: ReportedSweep, of_parts: bool = True) -> list[Measure]:
    """Maximum and average of all recorded uncertainties, what is open, and shares within the target
    accuracy.

    Without `of_parts` the lengths and angles of U2 and U3 are left out, and how much is open.
    """
    found: list[Measure] = []
    for symbol in DESCRIPTIONS:
        if " " in symbol and not of_parts:
            continue
        name = symbol_column(symbol)
        for statistic in STATISTICS:
            found += [
                Measure(symbol, statistic, unit, column)
                for column, unit in _columns(results, f"{name}_{statistic}_")
            ]
        for statistic, unit, factor in (("undetermined", "", 1.0), ("within_target", "%", 100.0)):
            column = f"{name}_{statistic}"
            if column not in results.frame:
                continue
            if statistic == "undetermined" and not (
                of_parts and (results.figure(column) > 0).any()
            ):
                continue
            found.append(
                Measure(
                    symbol,
                    statistic.replace("_", " "),
                    unit,
                    column,
                    factor,
                    is_count=statistic == "undetermined",
                )
            )
    return found


def rank_measures(results: ReportedSweep) -> list[Measure]:
    """The rank deficiency, where a cell has any."""
    column = "rank_deficiency"
    if column not in results.frame or not (results.figure(column) > 0).any():
        return []
    return [Measure("rank", "deficiency", "", column, 1.0, is_count=True)]


def trial_measures(results: ReportedSweep, of_parts: bool = True) -> list[Measure]:
    """Figures of Monte Carlo; none where no trials were made."""
    found: list[Measure] = []
    for symbol in trial_symbols(results):
        if " " in symbol and not of_parts:
            continue
        name = symbol_column(symbol)
        found += [
            Measure(symbol, "actual average", unit, column)
            for column, unit in _columns(results, f"{name}_actual_average_")
        ]
        for statistic, column, unit, factor in (
            ("spread / U", "spread_ratio", "", 1.0),
            ("bias / U", "bias_ratio", "", 1.0),
            ("covered", "coverage_sigma_given", "%", 100.0),
        ):
            figure = f"{name}_{column}"
            found.append(
                Measure(symbol, statistic, unit, figure, factor, f"{figure}_standard_error")
            )
    return found


def trial_symbols(results: ReportedSweep) -> list[str]:
    """Quantities with Monte Carlo figures, those of further artefacts marked by dashes."""
    found = []
    for symbol in DESCRIPTIONS:
        while f"{symbol_column(symbol)}_spread_ratio" in results.frame:
            found.append(symbol)
            symbol += MORE
    return found


def descriptions(measures: Sequence[Measure]) -> list[str]:
    """What the quantities are the uncertainties of, each in a line."""
    found = []
    for symbol in dict.fromkeys(measure.symbol for measure in measures):
        known = DESCRIPTIONS.get(symbol.rstrip(MORE))
        if known is not None:
            found.append(
                f"{symbol}: {known}" + (" of a further artefact" if symbol.endswith(MORE) else "")
            )
    return found


def _columns(results: ReportedSweep, start: str) -> list[tuple[str, str]]:
    """Columns that begin so, with the unit in which they are shown."""
    found = []
    for column in results.frame.columns:
        if column.startswith(start):
            found.append((column, _shown(column.removeprefix(start))))
    return found


def column_unit(column: str) -> str:
    """Unit in which a column of averages is shown.

    >>> column_unit("U6_average_m"), column_unit("U3_average_m_or_rad")
    ('µm', 'µm or µrad')
    """
    return _shown(column.partition("_average_")[2])


def _shown(suffix: str) -> str:
    unit = suffix.replace("_or_", ", ").replace("ratio", "1")
    return shown_unit(unit).replace(", ", " or ")
