"""Budgets of parametric errors as text for people and as plain data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from ballplate.presentation import ROUNDING, Data, aligned, number, picked, table_lines

from .fitted_tables import UNDETERMINED
from .part_budget import REST, PartBudget

# A part that contributes less to all figures, in metres, is left out of tables.
NOTHING = 1e-9

OF_POINTS = (
    "error alone: root mean square of the part's vectors; share: mean product of the part with the"
    " whole error, in parts of the mean square; shares add to 1"
)
OF_LENGTHS = "contributions to the error of a length add to the whole"
OF_ESTIMATES = (
    "share of variance: covariance of the part with the whole; shares add to 1. Estimates are"
    " correlated: a part alone may be less certain than the whole, and a share negative. Parts"
    " depend on the frame, the whole of a length does not"
)


def budget_lines(figures: Sequence[PartBudget], factor: float) -> list[str]:
    """Return contributions of the parts to the errors at points, then to all lengths and their
    variances.
    """
    shown = [
        k for k in range(len(figures[0].parts)) if any(_is_shown(budget, k) for budget in figures)
    ]
    lines, lengths = [], [budget for budget in figures if budget.is_length]
    names = [figures[0].parts[k][0] for k in shown]
    meanings = [figures[0].parts[k][1] for k in shown]
    for budget in (budget for budget in figures if not budget.is_length):
        columns = {
            f"budget: {budget.figure}": [*names, "whole"],
            "": [*meanings, ""],
            "error alone, µm": ([*budget.errors[shown], budget.total], _shown),
            "share": ([*budget.shares[shown], None], _percent),
            f"U alone, k = {factor:g}, µm": (
                factor * np.append(budget.uncertainties[shown], budget.uncertainty),
                _shown,
            ),
            "share of variance": ([*budget.variance_shares[shown], None], _percent),
        }
        lines += [*table_lines(columns), ""]
    errors = [
        (budget.figure, ([*budget.errors[shown], budget.total], _shown)) for budget in lengths
    ]
    lines += [*table_lines([("error of length, µm", [*names, "whole"]), *errors]), ""]
    right = [False, *[True] * len(lengths)]
    rows = [["share of variance", *(budget.figure for budget in lengths)]]
    if not any(budget.uncertainty for budget in figures):
        shown = []
    for k in shown:
        shares = [_percent(budget.variance_shares[k]) for budget in lengths]
        rows.append([figures[0].parts[k][0], *shares])
    rows.append(
        [f"U, k = {factor:g}, µm", *(_shown(factor * budget.uncertainty) for budget in lengths)]
    )
    lines += [*aligned(rows, right), ""]
    omitted = len(figures[0].parts) - len(shown)
    omission = [f"(omitted: {omitted} parts without contribution)"] if omitted else []
    return [*lines, *omission, OF_POINTS, OF_LENGTHS, OF_ESTIMATES]


def _is_shown(budget: PartBudget, k: int) -> bool:
    sizes = np.array([abs(budget.errors[k]), budget.uncertainties[k]])
    if np.isnan(sizes).any():
        return budget.parts[k] != REST
    return bool(sizes.max() > NOTHING)


def budget_data(figures: Sequence[PartBudget], factor: float) -> list[Data]:
    """The same in metres."""
    return [
        {
            **picked(budget, "figure", "is_length"),
            "error": budget.total,
            "expanded_uncertainty": factor * budget.uncertainty,
            "coverage_factor": factor,
            "parts": [
                {
                    "part": name,
                    "meaning": meaning,
                    "error": budget.errors[k],
                    "share": budget.shares[k],
                    "expanded_uncertainty": factor * budget.uncertainties[k],
                    "share_of_variance": budget.variance_shares[k],
                }
                for k, (name, meaning) in enumerate(budget.parts)
            ],
        }
        for budget in figures
    ]


def _shown(value: float) -> str:
    if np.isnan(value):
        return UNDETERMINED
    return number(0.0 if abs(value) < ROUNDING else 1e6 * float(value))


def _percent(share: float) -> str:
    return "-" if np.isnan(share) else f"{100.0 * share:z.1f} %"
