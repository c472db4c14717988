"""A document's statements compared with the shipped designs, each with a verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from ballplate.estimators import (
    EstimatorComparison,
    compare_estimators,
)
from ballplate.simulator.computing import Report, unreported
from ballplate.uncertainty import Quantity

from .published import (
    REPEATABILITY,
    SUM_OF_SQUARES,
    SYMBOLS,
    Difference,
    Document,
    Erratum,
    Illegible,
    OneSided,
    PublishedColumn,
    PublishedIterations,
    RankStatement,
    Remark,
    Reservation,
    Statistic,
    section_of,
)
from .shipped import (
    Shipped,
    fitted_exactly,
    planned,
    shipped_experiment,
    sums_of_squares,
    tabulated,
    variants,
)


@dataclass(frozen=True)
class ComparedFigure:
    """A published value and ballplate's, in metres or radians.

    `ratio` is `published` over `ours`, `adjusted` the ratio after the column's common factor, which
    must be `within` limits; `rests_on` are keys of assumptions.
    """

    quantity: str
    unit: str
    published: float
    ours: float
    ratio: float
    adjusted: float
    within: tuple[float, float]
    exception: Reservation | None
    rests_on: str

    @property
    def agrees(self) -> bool:
        return self.within[0] <= self.adjusted <= self.within[1]


@dataclass(frozen=True)
class ComparedColumn:
    """A column of a table with its common factor, which must be `within` limits."""

    column: PublishedColumn
    factor: float
    within: tuple[float, float]
    figures: tuple[ComparedFigure, ...]

    @property
    def factor_agrees(self) -> bool:
        return self.within[0] <= self.factor <= self.within[1]

    @property
    def agrees(self) -> bool:
        return self.factor_agrees and all(figure.agrees for figure in self.figures)


@dataclass(frozen=True)
class ComparedRank:
    """A statement on rank, with the deficiency of one of its designs and the gap that decides
    it.
    """

    design: str
    published: int | Literal["some"]
    ours: int
    gap: float

    @property
    def agrees(self) -> bool:
        return self.ours > 0 if self.published == "some" else self.ours == self.published


@dataclass(frozen=True)
class ComparedRemark:
    """A remark on averages, with the least and the largest of its ratios."""

    remark: Remark
    least: float
    largest: float

    @property
    def agrees(self) -> bool:
        low, high = self.remark.at_least, self.remark.at_most
        return (low is None or self.least >= low) and (high is None or self.largest <= high)


@dataclass(frozen=True)
class ErratumLine:
    """Ratios of the published values of a column to those of the design in the heading, and the
    meant one.

    The deviations are the largest from the common factor.
    """

    statistic: Statistic
    headed: str
    meant: str
    ratios_as_headed: dict[str, float]
    ratios_as_meant: dict[str, float]
    deviation_as_headed: float
    deviation_as_meant: float


@dataclass(frozen=True)
class ComparedErratum:
    """A block under an incorrect heading; `limit` is the largest deviation of a column that
    agrees.
    """

    erratum: Erratum
    lines: tuple[ErratumLine, ...]
    limit: float

    @property
    def agrees(self) -> bool:
        """Return whether the values are those of the designs meant, and not those in the
        heading.
        """
        meant = all(line.deviation_as_meant <= self.limit for line in self.lines)
        return meant and any(line.deviation_as_headed > self.limit for line in self.lines)


Rule = Literal["within", "most", "shown"]


@dataclass(frozen=True)
class ProgressLine:
    """One value of an iteration: a step, or a sum of squares in square metres; `limit` is a factor.

    A published value agrees `within` that factor, is an upper limit for `most`, or is `shown` only;
    NaN if illegible.
    """

    quantity: str
    published: float
    ours: float
    rule: Rule
    limit: float

    @property
    def agrees(self) -> bool:
        if self.rule == "shown":
            return True
        at_most = self.ours <= self.limit * self.published
        return at_most and (self.rule == "most" or self.ours >= self.published / self.limit)


@dataclass(frozen=True)
class ComparedProgress:
    """Iterations of one fit; whether it settled within the published number."""

    progress: PublishedIterations
    settled: bool
    iterations: int
    lines: tuple[ProgressLine, ...]

    @property
    def agrees(self) -> bool:
        return self.progress.settles in (None, self.settled) and all(
            line.agrees for line in self.lines
        )


@dataclass(frozen=True)
class ComparedDifference:
    """Two estimators over synthetic data sets, and the published differences of one; `limit` is
    a factor.
    """

    difference: Difference
    comparison: EstimatorComparison
    limit: float

    @property
    def parts(self) -> tuple[PlacedFigure, ...]:
        named_values = (("rms", self.comparison.rms), ("maximum", self.comparison.maximum))
        return tuple(
            PlacedFigure(
                name, getattr(self.difference, name), tuple(map(float, values)), self.limit
            )
            for name, values in named_values
        )

    @property
    def agrees(self) -> bool:
        return not self.comparison.failed and all(part.agrees for part in self.parts)


@dataclass(frozen=True)
class PlacedFigure:
    """A published value, in metres, among the values of synthetic data sets."""

    quantity: str
    published: float
    values: tuple[float, ...]
    limit: float

    @property
    def median(self) -> float:
        return float(np.median(self.values))

    @property
    def below(self) -> float:
        """Share of the values below the published one."""
        return float((np.array(self.values) < self.published).mean())

    @property
    def agrees(self) -> bool:
        inside = min(self.values) < self.published < max(self.values)
        return inside and 1.0 / self.limit < self.published / self.median < self.limit


@dataclass(frozen=True)
class Section:
    """All comparisons of one section; `skipped` names those skipped to save time."""

    name: str
    title: str
    rests_on: str
    ranks: tuple[ComparedRank, ...] = ()
    columns: tuple[ComparedColumn, ...] = ()
    remarks: tuple[ComparedRemark, ...] = ()
    errata: tuple[ComparedErratum, ...] = ()
    progress: tuple[ComparedProgress, ...] = ()
    differences: tuple[ComparedDifference, ...] = ()
    illegible: tuple[Illegible, ...] = ()
    skipped: str = ""

    @property
    def agrees(self) -> bool:
        compared: tuple[Any, ...] = (
            *(*self.ranks, *self.columns, *self.remarks),
            *(*self.errata, *self.progress, *self.differences),
        )
        return all(statement.agrees for statement in compared)


@dataclass(frozen=True)
class Side:
    """Adjusted ratios of the published values of a one-sided quantity."""

    stated: OneSided
    ratios: tuple[float, ...]

    @property
    def above(self) -> int:
        """Number of published values above ballplate's."""
        return sum(ratio > 1.0 for ratio in self.ratios)


@dataclass(frozen=True)
class Reproduction:
    """A document's sections, compared."""

    document: Document
    sections: tuple[Section, ...]

    @property
    def sides(self) -> tuple[Side, ...]:
        """The one-sided quantities of the compared columns."""
        one_sided_quantities = []
        for stated in self.document.statements.one_sided:
            ratios = [
                figure.adjusted
                for section in self.sections
                for compared in section.columns
                for figure in compared.figures
                if (figure.quantity, compared.column.statistic)
                == (stated.quantity, stated.statistic)
            ]
            one_sided_quantities += [Side(stated, tuple(ratios))] if ratios else []
        return tuple(one_sided_quantities)

    @property
    def agrees(self) -> bool:
        return all(section.agrees for section in self.sections)


def reproduce(
    document: Document,
    shipped: Shipped,
    sections: Iterable[str] = (),
    trials: int | None = 100,
    report: Report = unreported,
) -> Reproduction:
    """Compute the experiments of a document's sections, by default all.

    `trials` is the number of synthetic data sets for the comparison of estimators; None skips it.
    `report` receives progress.

    :raises ExperimentError: a shipped design is missing or has errors.
    """
    wanted = tuple(sections) or document.statements.sections
    return Reproduction(
        document,
        tuple(
            _section(document, shipped, name, trials, report)
            for name in document.statements.sections
            if name in wanted
        ),
    )


def _section(
    document: Document, shipped: Shipped, name: str, trials: int | None, report: Report
) -> Section:
    statements = document.statements
    illegible = tuple(block for block in statements.illegible if block.section == name)
    differences = [
        difference for difference in statements.differences if section_of(difference.design) == name
    ]
    skipped = (
        "the comparison of estimators over synthetic data sets"
        if differences and trials is None
        else ""
    )
    return Section(
        name,
        next(iter(variants(shipped, name).values())).title,
        rests_on(document, name),
        tuple(
            compare_rank(shipped, statement, design)
            for statement in statements.ranks
            for design in statement.designs
            if statement.section == name
        ),
        tuple(
            compare_column(document, shipped, column)
            for column in document.columns
            if column.section == name
        ),
        tuple(
            compare_remark(shipped, remark)
            for remark in statements.remarks
            if remark.section == name
        ),
        tuple(
            compare_erratum(document, shipped, erratum)
            for erratum in statements.errata
            if section_of(erratum.headed[0]) == name
        ),
        tuple(
            compare_progress(document, shipped, progress)
            for progress in statements.convergence
            if section_of(progress.design) == name
        ),
        tuple(
            compare_difference(document, shipped, difference, trials, report)
            for difference in differences
            if trials is not None
        ),
        illegible,
        skipped,
    )


def rests_on(document: Document, section: str, quantity: str | None = None) -> str:
    """Return the keys of the assumptions of a section, or of one quantity in it, as one string."""
    chosen = SYMBOLS if quantity is None else (quantity,)
    return "".join(
        assumption.key
        for assumption in document.statements.assumptions
        if any(assumption.concerns(section, symbol) for symbol in chosen)
    )


def common_factor(ratios: Iterable[float]) -> float:
    """Return the median of ratios, which a few outliers do not move; NaN without any.

    >>> common_factor([0.9, 1.0, 1.6])
    1.0
    """
    values = list(ratios)
    return float(np.median(values)) if values else math.nan


def compare_column(document: Document, shipped: Shipped, column: PublishedColumn) -> ComparedColumn:
    """Compare the values of one column after its common factor, which exceptions do not
    influence.
    """
    statements = document.statements
    quantities = tabulated(shipped, column.design)
    ratios = _ratios(column, quantities)
    exceptions = {
        symbol: next(
            (
                reservation
                for reservation in statements.exceptions
                if reservation.concerns(column, symbol)
            ),
            None,
        )
        for symbol in ratios
    }
    factor = common_factor(ratio for symbol, ratio in ratios.items() if exceptions[symbol] is None)
    usual = (1.0 - statements.limits.figure, 1.0 + statements.limits.figure)
    figures = []
    for symbol, ratio in ratios.items():
        exception = exceptions[symbol]
        figures.append(
            ComparedFigure(
                symbol,
                quantities[symbol].unit,
                column.figures[symbol],
                getattr(quantities[symbol], column.statistic),
                ratio,
                ratio / factor,
                exception.within if exception else usual,
                exception,
                rests_on(document, column.section, symbol),
            )
        )
    of_factor = (1.0 - statements.limits.factor, 1.0 + statements.limits.factor)
    return ComparedColumn(column, factor, of_factor, tuple(figures))


def _ratios(column: PublishedColumn, quantities: dict[str, Quantity]) -> dict[str, float]:
    return {
        symbol: value / getattr(quantities[symbol], column.statistic)
        for symbol, value in column.figures.items()
    }


def compare_rank(shipped: Shipped, statement: RankStatement, design: str) -> ComparedRank:
    """Compare a stated rank deficiency with that of one design."""
    verdict = planned(shipped, design).verdict
    return ComparedRank(design, statement.deficiency, verdict.deficiency, verdict.gap)


def compare_remark(shipped: Shipped, remark: Remark) -> ComparedRemark:
    """Compute the ratios of a remark."""
    ratios = []
    for design, reference in remark.pairs:
        if remark.quantities == (SUM_OF_SQUARES,):
            last, compared = (
                sums_of_squares(fitted_exactly(shipped_experiment(shipped, name)))[-1]
                for name in (design, reference)
            )
            ratios.append(last / compared)
            continue
        plan = planned(shipped, design)
        for symbol in remark.quantities:
            if reference == REPEATABILITY:
                compared_with = float(plan.design.machine.repeatability[0])
            else:
                compared_with = planned(shipped, reference).quantities[symbol].average
            ratios.append(plan.quantities[symbol].average / compared_with)
    return ComparedRemark(remark, float(np.min(ratios)), float(np.max(ratios)))


def compare_erratum(document: Document, shipped: Shipped, erratum: Erratum) -> ComparedErratum:
    """Compare values with the designs in their heading, and with those meant."""
    statements = document.statements
    lines = []
    for headed, meant in zip(erratum.headed, erratum.meant, strict=True):
        for column in document.columns:
            table = erratum.figures_of or erratum.table
            if (column.table, column.design) != (
                table,
                meant,
            ) or column.statistic not in erratum.statistics:
                continue
            ratios_of_designs = [
                _ratios(column, tabulated(shipped, design)) for design in (headed, meant)
            ]
            regular = [
                symbol
                for symbol in column.figures
                if not any(
                    reservation.concerns(column, symbol) for reservation in statements.exceptions
                )
            ]
            deviations = []
            for ratios in ratios_of_designs:
                factor = common_factor(ratios[symbol] for symbol in regular)
                deviations.append(max(abs(ratios[symbol] / factor - 1.0) for symbol in regular))
            lines.append(
                ErratumLine(
                    column.statistic,
                    headed,
                    meant,
                    ratios_of_designs[0],
                    ratios_of_designs[1],
                    *deviations,
                )
            )
    return ComparedErratum(erratum, tuple(lines), statements.limits.figure)


def compare_progress(
    document: Document, shipped: Shipped, progress: PublishedIterations
) -> ComparedProgress:
    """Compare the iterations of a fit of exact readings."""
    limits = document.statements.limits
    fitted = fitted_exactly(shipped_experiment(shipped, progress.design))
    record = fitted.solution.iterations
    steps, sums = [iteration.step for iteration in record], sums_of_squares(fitted)
    # Further iterations would not change the final sum of squares.
    later = sums + sums[-1:] * len(progress.sums_of_squares)
    lines = []
    for k, published in enumerate(progress.steps, start=1):
        last = progress.settles and k == len(progress.steps)
        rule: Rule = "shown" if k in progress.steps_shown_only else "most" if last else "within"
        lines.append(_line("step", k, published, steps, rule, limits.step))
    for k, published in enumerate(progress.sums_of_squares):
        is_close = k < 2 or progress.misfit
        rule = "shown" if k in progress.sums_shown_only else "within" if is_close else "most"
        lines.append(_line("S^2", k, published, later, rule, limits.sum_of_squares))
    settled = fitted.solution.status == "converged"
    if progress.steps:
        settled = settled and len(record) - 1 <= len(progress.steps)
    else:
        for k in range(1, len(steps)):
            lines.append(_line("step", k, math.nan, steps, "shown", limits.step))
        for k in range(len(sums)):
            lines.append(_line("S^2", k, math.nan, sums, "shown", limits.sum_of_squares))
    return ComparedProgress(progress, settled, len(record) - 1, tuple(lines))


def _line(
    quantity: str, k: int, published: float, ours: list[float], rule: Rule, limit: float
) -> ProgressLine:
    value = ours[k] if k < len(ours) else math.nan
    rule = "most" if rule == "within" and math.isnan(value) else rule
    return ProgressLine(f"{quantity} {k}", published, value, rule, limit)


def compare_difference(
    document: Document, shipped: Shipped, difference: Difference, trials: int, report: Report
) -> ComparedDifference:
    """Compare published differences of two estimators with those of synthetic data sets."""
    experiment = shipped_experiment(shipped, difference.design)
    comparison = compare_estimators(experiment, trials, across_probes=True, report=report)
    return ComparedDifference(difference, comparison, document.statements.limits.median)
