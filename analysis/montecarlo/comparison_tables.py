"""Outcomes of replicates as text for people, and as plain data for programs."""

from __future__ import annotations

import math

from ballplate.presentation.formatting import Data, aligned, number, picked, shown_unit
from ballplate.simulator.inputs.settings import listing
from ballplate.uncertainty.quantities import QUANTITIES

from .experiments import Trials
from .figures import BEYOND, MonteCarloComparison, MonteCarloEstimate, MonteCarloOutcome

# S^2 of readings without noise, per degree of freedom, below which it is rounding.
NO_MISFIT = 1e-9


def with_error(figure: MonteCarloEstimate, factor: float = 1.0) -> str:
    """Return a value with its standard error in units of the last digit (GUM, 7.2.2).

    >>> with_error(MonteCarloEstimate(0.99213, 0.0066))
    '0.992(7)'
    >>> with_error(MonteCarloEstimate(0.9534, 0.0164), 100)
    '95(2)'
    >>> with_error(MonteCarloEstimate(581.3, 7.3))
    '581(7)'
    """
    value, error = factor * figure.value, factor * figure.error
    if not (math.isfinite(value) and math.isfinite(error)):
        return "-" if math.isnan(value) else f"{value:.4g}"
    if error <= 0.0:
        return f"{value:.4g}"
    decimals = max(-math.floor(math.log10(error)), 0)
    digits = round(error * 10**decimals)
    if digits == 10 and decimals:
        decimals, digits = decimals - 1, 1
    return f"{value:.{decimals}f}({digits})"


def trials_lines(result: Trials) -> list[str]:
    """Return replicates compared with the linearised uncertainties, as lines of text."""
    outcome = result.outcome
    if outcome is None:
        return [f"no Monte Carlo: {result.reason}"]
    if not outcome.comparisons:
        return [f"no Monte Carlo: {outcome.reason}", *_failed_lines(outcome)]
    rows = [
        [
            "",
            "average U",
            "actual",
            "unit",
            "spread / U",
            "bias / U",
            "covered, %",
            "sigma estimated",
            "",
        ]
    ]
    for symbol, comparison in outcome.comparisons.items():
        # Lengths and angles have ratios in common, and no average.
        averages = ["", "", ""]
        if ", " not in comparison.unit:
            averages = [
                number(1e6 * comparison.linear_average),
                number(1e6 * comparison.actual_average),
                shown_unit(comparison.unit),
            ]
        rows.append(
            [
                symbol,
                *averages,
                with_error(comparison.spread),
                with_error(comparison.bias),
                with_error(comparison.known, 100.0),
                with_error(comparison.estimated, 100.0),
                f"<- {', '.join(comparison.flags)}" if comparison.flags else "",
            ]
        )
    lines = [
        (
            f"Monte Carlo: {outcome.trials} data sets of the true machine, seed {result.seed}; in"
            " parentheses the standard error of the last digit"
        ),
        *aligned(rows, [False, True, True, False, True, True, True, True, False]),
    ]
    sampled = [symbol for symbol, comparison in outcome.comparisons.items() if comparison.sampled]
    if sampled:
        count = outcome.comparisons[sampled[0]].count
        lines.append(f"{' and '.join(sampled)} for a sample of {count} distances")
    if any(comparison.flags for comparison in outcome.comparisons.values()):
        lines.append(f"<- differs from linear theory by more than {BEYOND:g} standard errors")
    return lines + _failed_lines(outcome) + _misfit_lines(result, outcome)


def _failed_lines(outcome: MonteCarloOutcome) -> list[str]:
    if not outcome.failed:
        return []
    omission = " and are left out" if outcome.comparisons else ""
    numbers = listing([str(k) for k in outcome.failed])
    return [f"{len(outcome.failed)} data sets did not converge{omission}: {numbers}"]


def _misfit_lines(result: Trials, outcome: MonteCarloOutcome) -> list[str]:
    misfit = outcome.misfit
    lines = [
        f"S^2 is {with_error(misfit.mean)} with {misfit.degrees_of_freedom} degrees of freedom, and"
        f" beyond its 95 % limit in {with_error(misfit.rejected, 100.0)} % of the data sets"
    ]
    if result.power is None:
        return lines
    if misfit.noise_free < NO_MISFIT * misfit.degrees_of_freedom:
        return [
            *lines,
            "the true machine has another error model, which the fitted one follows exactly",
        ]
    ratios_by_symbol = {
        symbol: comparison.actual
        for symbol, comparison in outcome.comparisons.items()
        if QUANTITIES[comparison.symbol].effect
    }
    ratios = [f"{symbol} {with_error(ratio)}" for symbol, ratio in ratios_by_symbol.items()]
    too_optimistic = any(
        ratio.value > 1.0 and ratio.differs_from(1.0) for ratio in ratios_by_symbol.values()
    )
    lines += [
        "",
        ("Too optimistic? " if too_optimistic else "")
        + "The fitted model cannot follow the true machine exactly.",
        f"ratios of actual to predicted errors, as root mean squares: {', '.join(ratios)}"
        + (
            ""
            if too_optimistic
            else f"; no ratio is above 1 by more than {BEYOND:g} standard errors"
        ),
        (
            f"readings without noise leave S^2 = {misfit.noise_free:.4g}; with sigma known, S^2"
            f" alone shows the lack of fit in {100 * result.power:.3g} % of experiments"
        ),
    ]
    own_model = result.own_model
    if own_model is not None:
        lines.append(
            f"a second fit with the true machine's own functions added, {own_model.more} parameters"
            f" more that this design determines, lowers S^2 by {own_model.gain:.4g} more than"
            f" noise does; comparing the two shows it in {100 * own_model.power:.3g} %"
        )
    return lines


def trials_data(result: Trials) -> Data:
    """Return replicates as data in metres and radians at full precision; NaN if undetermined."""
    outcome = result.outcome
    if outcome is None:
        return {"reason": result.reason}
    misfit = outcome.misfit
    data: Data = {
        **({"reason": outcome.reason} if outcome.reason else {}),
        "trials": outcome.trials,
        "seed": result.seed,
        "not_converged": list(outcome.failed),
        **picked(outcome, "passes", "interrupted"),
        "quantities": {
            symbol: _comparison_data(comparison)
            for symbol, comparison in outcome.comparisons.items()
        },
        "sum_of_squares": {
            **_figure(misfit.mean),
            "degrees_of_freedom": misfit.degrees_of_freedom,
            "without_noise": misfit.noise_free,
            "beyond_limit": _figure(misfit.rejected),
        },
    }
    if result.power is not None:
        own_model = result.own_model
        data["too_optimistic"] = {
            "misfit_noticed": result.power,
            "own_model": (
                None
                if own_model is None
                else {
                    "parameters_more": own_model.more,
                    "gain": own_model.gain,
                    "noticed": own_model.power,
                }
            ),
        }
    return data


def _comparison_data(comparison: MonteCarloComparison) -> Data:
    return {
        **picked(comparison, "unit", "count", "sampled"),
        "linear": {"maximum": comparison.linear_maximum, "average": comparison.linear_average},
        "actual": {"maximum": comparison.actual_maximum, "average": comparison.actual_average},
        "spread_ratio": _figure(comparison.spread),
        "actual_ratio": _figure(comparison.actual),
        "bias_ratio": _figure(comparison.bias),
        "largest_bias": comparison.largest_bias,
        "coverage_sigma_given": _figure(comparison.known),
        "coverage_sigma_estimated": _figure(comparison.estimated),
        "flags": list(comparison.flags),
    }


def _figure(figure: MonteCarloEstimate) -> Data:
    return {"value": figure.value, "standard_error": figure.error}
