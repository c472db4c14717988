"""A fit as lines of text, and as plain data."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from ballplate.presentation.formatting import Data, given, picked
from ballplate.presentation.table_columns import table_lines

from ._fit_findings import FitFindings
from ._named_tables import named_data, named_lines
from .adjustments import adjustment_data, adjustment_lines, freedom_words
from .estimates import ESTIMATE_COLUMNS, labels
from .plates import plate_data, plate_table
from .residuals import Residual, residual_groups
from .text_blocks import (
    iteration_lines,
    map_lines,
    quantities_data,
    uncertainty_table,
    verdict_data,
    verdict_lines,
)

if TYPE_CHECKING:
    pass


# Steps of an iteration below this, in metres and radians, are reported as rounding.
LEAST_STEP = 1e-10

# Largest residuals in the text.
SHOWN_RESIDUALS = 3


def fit_lines(fit: FitFindings) -> list[str]:
    """Return verdict, iterations, residuals, uncertainties and estimates as lines of text."""
    record = fit.solution.iterations
    lengths = fit.quantities.get("U6")
    verdict = verdict_lines(fit.verdict, lengths, fit.unread)
    lines = [fit.heading, *verdict]
    origin = "estimated from the residuals" if fit.sigma_is_estimated else "as given"
    summary = (
        f"{fit.solution.status} after {len(record) - 1} iterations; S^2 = {fit.sum_of_squares:.6g}"
    )
    if fit.converged:
        summary += (
            f" with {freedom_words(fit.sum_freedom)}; sigma = {fit.sigma:.4g} times the stated "
        )
        summary += f"uncertainties ({origin})"
    maps = map_lines(fit.experiment)
    lines += [summary, *(maps if fit.campaigns is None else fit.campaigns.lines())]
    lines += ["", *iteration_lines(record, _step)]
    if not fit.converged:
        return lines
    lines += ["", *_residual_table(fit)]
    if fit.diagnosis is not None:
        lines += ["", *fit.diagnosis.lines()]
    lines += ["", *uncertainty_table(fit.quantities, fit.lack_of_fit.caveat), ""]
    named = named_lines(fit.design, fit.quantities, fit.lack_of_fit.caveat)[1:]
    lines += [*named, ""] if named else []
    printed = [estimate for estimate in fit.estimates if estimate.kind not in ("origin", "ball")]
    lines += table_lines(ESTIMATE_COLUMNS, printed, "kind")
    quoted = fit.design.model.reported().names
    if any(e.kind == "machine" and e.name not in quoted for e in printed):
        lines.append(
            "([1], [2], … are coefficients of the basis in which errors are estimated;"
            f" U3 is of others, such as {quoted[-1]}, which --monomials lists)"
        )
    lines.append(
        "(origins of positions and co-ordinates of balls are among the estimates of --json)"
    )
    if fit.adjustments:
        lines += ["", *adjustment_lines(fit.adjustments)]
    for plate in fit.plates:
        lines += ["", *plate_table(plate, named=len(fit.plates) > 1)]
    return lines


def fit_data(fit: FitFindings) -> Data:
    """Return a fit as plain data, in metres and radians."""
    estimates = zip(labels(fit.estimates), fit.estimates, strict=True)
    curves = fit.error_functions if fit.converged else ()
    return {
        **fit.named,
        **verdict_data(fit.verdict),
        "status": fit.solution.status,
        **picked(fit, "sigma", "sigma_is_estimated", "degrees_of_freedom", "too_large"),
        "sum_of_squares": fit.sum_of_squares,
        **given(campaigns=fit.campaigns and fit.campaigns.to_dict()),
        "iterations": [
            picked(iteration, "step", "sum_of_squares") for iteration in fit.solution.iterations
        ],
        "quantities": quantities_data(fit.quantities),
        **named_data(fit.design, fit.quantities),
        "largest_residuals": [
            {
                **picked(item, "position", "ball", "probe", "axis", "value"),
                "unit": "m",
                "standard_uncertainties": _standardised(fit, item),
            }
            for item in fit.largest
        ],
        **given(
            error_functions=[curve.to_dict() for curve in curves],
            residuals=_residual_groups(fit),
            diagnosis=None if fit.diagnosis is None else fit.diagnosis.to_dict(),
        ),
        "estimates": {
            name: picked(item, "value", "standard_uncertainty", "unit") for name, item in estimates
        },
        **given(
            plates={plate.artefact: plate_data(plate) for plate in fit.plates},
            adjustments=adjustment_data(fit.adjustments),
        ),
        **fit.notes_data(),
    }


def _residual_groups(fit: FitFindings) -> dict[str, list[dict[str, Any]]]:
    """Residuals by group as plain data; empty without results."""
    if not fit.converged or not len(fit.design.plate_readings):
        return {}
    sigma = float("nan") if fit.without_scatter else fit.sigma
    return residual_groups(fit.design, fit.solution, fit.observed.x, sigma)


def _standardised(fit: FitFindings, residual: Residual) -> float:
    """A residual in its standard uncertainties; NaN without noise."""
    return float("nan") if fit.without_scatter else residual.standardised / fit.sigma


def _residual_table(fit: FitFindings) -> list[str]:
    columns = {
        "largest residuals": "position",
        "ball": "ball",
        "probe": "probe",
        "axis": "axis",
        "µm": "value",
        "standard uncertainties": partial(_standardised, fit),
    }
    return table_lines(columns, fit.largest[:SHOWN_RESIDUALS])


def _step(step: float) -> str:
    return f"{step:.1e}" if not step < LEAST_STEP else f"below {LEAST_STEP:.0e}"
