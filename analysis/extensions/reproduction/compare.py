"""A document's values and statements compared with the shipped designs, each with a verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import Report

from ..estimators import compare_estimators
from .published import (
    REPEATABILITY,
    SUM_OF_SQUARES,
    Difference,
    Document,
    Erratum,
    PublishedColumn,
    PublishedIterations,
    RankStatement,
    Remark,
    case_of,
    section_of,
)
from .shipped import (
    Shipped,
    fitted_exactly,
    planned,
    shipped_experiment,
    sums_of_squares,
    tabulated,
)


@dataclass(frozen=True)
class ComparedValue:
    """A published value or statement and what ballplate computes, in metres and radians.

    Values of a table are compared by their ratio after the common `factor` of their column, which
    must be `within` limits. Without a factor the computed value itself must be; a statement in
    words has no published value (NaN). `note` is the key of an exception, or the statement.
    """

    table: str
    quantity: str
    case: str
    unit: str
    published: float
    computed: float
    within: tuple[float, float]
    factor: float | None = None
    note: str = ""

    @property
    def ratio(self) -> float:
        """Published over computed value after the common factor; NaN of statements."""
        return math.nan if self.factor is None else self.published / self.computed / self.factor

    @property
    def agrees(self) -> bool:
        compared = self.computed if self.factor is None else self.ratio
        return self.within[0] <= compared <= self.within[1]


def compare_section(
    document: Document, shipped: Shipped, section: str, trials: int | None, report: Report
) -> list[ComparedValue]:
    """Compare everything that a document states in one section.

    `trials` is the number of synthetic data sets for the comparison of estimators; None skips it.
    `report` receives progress.

    :raises ExperimentError: a shipped design is missing or has errors.
    """
    compared = [
        compare_rank(shipped, design, statement)
        for statement in document.ranks
        for design in statement.designs
        if statement.section == section
    ]
    for column in document.columns:
        if column.section == section:
            compared += compare_column(document, shipped, column)
    for remark in document.remarks:
        if remark.section == section:
            compared += compare_remark(shipped, remark)
    for erratum in document.errata:
        if section_of(erratum.headed[0]) == section:
            compared.append(compare_erratum(document, shipped, erratum))
    for iterations in document.convergence:
        if section_of(iterations.design) == section:
            compared += compare_iterations(document, shipped, iterations)
    for difference in document.differences:
        if section_of(difference.design) == section and trials is not None:
            compared += compare_difference(document, shipped, difference, trials, report)
    return compared


def compare_rank(shipped: Shipped, design: str, statement: RankStatement) -> ComparedValue:
    """Compare a stated rank deficiency with that of one of its designs."""
    stated, computed = statement.deficiency, planned(shipped, design).verdict.deficiency
    published, within, note = (
        (math.nan, (1.0, math.inf), "deficient")
        if stated == "some"
        else (float(stated), (stated, stated), "")
    )
    return ComparedValue(
        "", "rank deficiency", case_of(design), "", published, computed, within, note=note
    )


def compare_column(
    document: Document, shipped: Shipped, column: PublishedColumn
) -> list[ComparedValue]:
    """Compare the common factor of one column, which exceptions do not influence, and then its
    values after that factor.
    """
    quantities = tabulated(shipped, column.design)
    exceptions = {
        symbol: exception
        for exception in reversed(document.exceptions)
        for symbol in column.figures
        if exception.concerns(column, symbol)
    }
    ratios = _ratios(shipped, column, column.design)
    factor = _median(ratio for symbol, ratio in ratios.items() if symbol not in exceptions)
    limit, usual = document.limits.factor, document.limits.figure
    compared = [
        ComparedValue(
            column.table,
            f"factor, {column.statistic}",
            column.case,
            "",
            math.nan,
            factor,
            (1.0 - limit, 1.0 + limit),
        )
    ]
    for symbol, published in column.figures.items():
        exception = exceptions.get(symbol)
        compared.append(
            ComparedValue(
                column.table,
                f"{symbol} {column.statistic}",
                column.case,
                quantities[symbol].unit,
                published,
                getattr(quantities[symbol], column.statistic),
                exception.within if exception else (1.0 - usual, 1.0 + usual),
                factor,
                f"see {exception.key}" if exception else "",
            )
        )
    return compared


def _median(ratios: Iterable[float]) -> float:
    """Return the median, which a few outliers do not move."""
    return float(np.median(list(ratios)))


def _ratios(shipped: Shipped, column: PublishedColumn, design: str) -> dict[str, float]:
    """Return the ratios of a column's values to those of a design."""
    quantities = tabulated(shipped, design)
    return {
        symbol: value / getattr(quantities[symbol], column.statistic)
        for symbol, value in column.figures.items()
    }


def compare_remark(shipped: Shipped, remark: Remark) -> list[ComparedValue]:
    """Compare the least and the largest ratio of a remark with its limits."""
    ratios = []
    for design, reference in remark.pairs:
        if remark.quantities == (SUM_OF_SQUARES,):
            last, compared_with = (
                sums_of_squares(fitted_exactly(shipped_experiment(shipped, name)))[-1]
                for name in (design, reference)
            )
            ratios.append(last / compared_with)
            continue
        plan = planned(shipped, design)
        for symbol in remark.quantities:
            if reference == REPEATABILITY:
                compared_with = float(plan.design.machine.repeatability[0])
            else:
                compared_with = planned(shipped, reference).quantities[symbol].average
            ratios.append(plan.quantities[symbol].average / compared_with)
    note = f"{', '.join(remark.quantities)}: {remark.text}"
    limits = (
        ("least ratio", min(ratios), remark.at_least, math.inf),
        ("largest ratio", max(ratios), 0.0, remark.at_most),
    )
    return [
        ComparedValue("", quantity, "", "", math.nan, ratio, (low, high), note=note)
        for quantity, ratio, low, high in limits
        if low is not None and high is not None
    ]


def compare_erratum(document: Document, shipped: Shipped, erratum: Erratum) -> ComparedValue:
    """Compute the largest deviation of a block's values from the designs in its heading, which must
    exceed that of a column that agrees; columns have the values of the designs meant.
    """
    deviations = []
    for headed, meant in zip(erratum.headed, erratum.meant, strict=True):
        for column in document.columns:
            if (column.table, column.design) == (erratum.figures_of or erratum.table, meant) and (
                column.statistic in erratum.statistics
            ):
                ratios = [
                    ratio
                    for symbol, ratio in _ratios(shipped, column, headed).items()
                    if not any(one.concerns(column, symbol) for one in document.exceptions)
                ]
                factor = _median(ratios)
                deviations += [abs(ratio / factor - 1.0) for ratio in ratios]
    return ComparedValue(
        erratum.table,
        "as headed, off by",
        "",
        "",
        math.nan,
        max(deviations),
        (document.limits.figure, math.inf),
        note=erratum.text,
    )


def compare_iterations(
    document: Document, shipped: Shipped, published: PublishedIterations
) -> list[ComparedValue]:
    """Compare the iterations of a fit of exact readings with a published one's."""
    limits, case = document.limits, case_of(published.design)
    fitted = fitted_exactly(shipped_experiment(shipped, published.design))
    record = fitted.solution.iterations
    steps, sums = [iteration.step for iteration in record], sums_of_squares(fitted)
    # Further iterations would not change the final sum of squares.
    sums += sums[-1:] * len(published.sums_of_squares)
    count = len(published.steps)
    compared = []
    if published.settles is not None:
        settled = fitted.solution.status == "converged" and len(record) - 1 <= (count or math.inf)
        stated = float(published.settles)
        words = f"settles within {count}" if count else "settles"
        compared.append(
            ComparedValue(
                published.table, words, case, "", stated, float(settled), (stated, stated)
            )
        )
    for name, values, computed, shown_only, limit, first, most in (
        (
            "step",
            published.steps,
            steps,
            published.steps_shown_only,
            limits.step,
            1,
            {count} if published.settles else set(),
        ),
        (
            "S^2",
            published.sums_of_squares,
            sums,
            published.sums_shown_only,
            limits.sum_of_squares,
            0,
            set() if published.misfit else set(range(2, len(sums))),
        ),
    ):
        for k, value in enumerate(values, start=first):
            if k in shown_only:
                continue
            within = 1.0 / limit, math.inf if k in most else limit
            found = computed[k] if k < len(computed) else math.nan
            compared.append(
                ComparedValue(published.table, f"{name} {k}", case, "", value, found, within, 1.0)
            )
    return compared


def compare_difference(
    document: Document, shipped: Shipped, difference: Difference, trials: int, report: Report
) -> list[ComparedValue]:
    """Compare the published differences of two estimators over one data set with the median over
    synthetic ones, in whose range they must be.
    """
    experiment = shipped_experiment(shipped, difference.design)
    estimated = compare_estimators(experiment, trials, across_probes=True, report=report)
    case, limit = case_of(difference.design), document.limits.median
    compared = [
        ComparedValue(
            "", "not converged", case, "", math.nan, float(len(estimated.failed)), (0.0, 0.0)
        )
    ]
    for name, published, values in (
        ("rms", difference.rms, np.array(estimated.rms)),
        ("maximum", difference.maximum, np.array(estimated.maximum)),
    ):
        below = float((values < published).mean())
        within = 1.0 / len(values), 1.0 - 1.0 / len(values)
        compared += [
            ComparedValue(
                *("", f"{name} difference", case, "m", published, float(np.median(values))),
                (1.0 / limit, limit),
                1.0,
            ),
            ComparedValue("", f"{name}, share below", case, "", math.nan, below, within),
        ]
    return compared
