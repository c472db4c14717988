"""Predictions of positions left out: text, data and rows."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ballplate.presentation import Data, FitResult, MainTable, chance_words, picked, table_lines
from ballplate.simulator.readings import ObservedReadings

# Chance, of all that is left out together, below which a prediction fails.
FAILED = 0.01


@dataclass(frozen=True)
class PredictedReading:
    """A prediction error of one co-ordinate in metres, with its standard uncertainty, the noise of
    the reading included.
    """

    ball: str
    probe: str
    axis: str
    error: float
    standard_uncertainty: float
    standardised: float


@dataclass(frozen=True)
class LengthDifference:
    """The largest change of a corrected length without a position, in metres, with its standard
    uncertainty. `undetermined` lengths rest on its readings alone.
    """

    change: float
    standard_uncertainty: float
    undetermined: int
    between: tuple[str, str]


@dataclass(frozen=True)
class PredictedPosition:
    """A position that was left out and predicted.

    `predicted` counts the independent co-ordinates that the others predict, `mean_square` is the
    mean square of their errors over the stated variances; `sigma` is the others' own. `chance` is
    the p-value of the errors.
    """

    name: str
    predicted: int
    mean_square: float
    sigma: float
    chance: float
    converged: bool
    worst: PredictedReading | None = None
    lengths: LengthDifference | None = None


@dataclass(frozen=True, repr=False)
class Validation(FitResult):
    """Each position of an experiment's readings, predicted from the others."""

    label: str
    title: str
    observed: ObservedReadings
    left_out: tuple[PredictedPosition, ...]
    sigma_is_given: bool
    coverage_factor: float

    @property
    def failed(self) -> tuple[PredictedPosition, ...]:
        """Positions whose prediction fails the joint test."""
        tested = [position for position in self.left_out if position.predicted > 0]
        return tuple(position for position in tested if position.chance * len(tested) < FAILED)

    @property
    def complaint(self) -> str:
        lost = [position for position in self.left_out if not position.converged]
        reasons = [
            f"position {position.name} is predicted wrongly by the others"
            for position in self.failed
        ]
        reasons += [
            f"without position {position.name} the estimate does not converge" for position in lost
        ]
        if not any(position.predicted for position in self.left_out):
            reasons.append("no test is possible: no position is predicted by the others")
        return "; ".join(reasons)

    def headline(self) -> str:
        tested = sum(position.predicted > 0 for position in self.left_out)
        if not tested:
            return "no position is predicted by the others"
        return f"{tested} left out in turn, {len(self.failed)} predicted wrongly"

    def lines(self) -> list[str]:
        test = "chi-squared" if self.sigma_is_given else "F"
        k = self.coverage_factor
        failed = self.failed
        columns = {
            "position left out": "name",
            "predicted": "predicted",
            "rms error / u": (_error, 3),
            f"{test}: p-value": (_chance, chance_words),
            "worst reading": _worst,
            "error / u": ("worst.standardised", 3),
            "length, µm": ("lengths.change", 3),
            f"U (k = {k:g}), µm": (lambda position: _expanded(position, k), 3),
            " ": lambda position: "<- failed" * (position in failed),
        }
        lines = [
            self.heading,
            (
                "each left out in turn and predicted from all others; its pose, and balls read"
                " nowhere else, come from its own readings; uncertainties of prediction errors"
                " include the noise of the reading; length: largest change of a corrected length,"
                " with U of this change"
            ),
            "",
            *table_lines(columns, self.left_out),
        ]
        tested = sum(position.predicted > 0 for position in self.left_out)
        if not tested:
            return [*lines, self.headline()]
        if not failed:
            least = min(position.chance for position in self.left_out if position.predicted > 0)
            summary = (
                f"no prediction fails: the smallest of {tested} p-values is {chance_words(least)}"
            )
            return [*lines, summary]
        names = ", ".join(position.name for position in failed)
        return [
            *lines,
            (
                f"predicted wrongly: position {names}; the error model is too small there, or the"
                " readings or certificates contradict one another: see ballplate models and the"
                " readings that fit flags"
            ),
        ]

    def data(self) -> Data:
        return {
            **self.named,
            **picked(self, "sigma_is_given"),
            "left_out": [_data(position) for position in self.left_out],
            "failed": [position.name for position in self.failed],
            **self.notes_data(),
        }

    def columns(self) -> MainTable:
        """One row for each that was left out."""
        return COLUMNS, self.left_out


COLUMNS = {
    "left out": "name",
    "predicted": "predicted",
    "mean square error": "mean_square",
    "sigma": "sigma",
    "chance": "chance",
    "largest standardised error": "worst.standardised",
    "length change, µm": "lengths.change",
    "standard uncertainty, µm": "lengths.standard_uncertainty",
    "unit": lambda one: "m",
}


def _error(position: PredictedPosition) -> float:
    """Return the root mean square of standardised errors; NaN without a prediction."""
    is_known = position.predicted and position.sigma > 0.0
    return position.mean_square**0.5 / position.sigma if is_known else math.nan


def _chance(position: PredictedPosition) -> float:
    return position.chance if position.predicted else math.nan


def _worst(position: PredictedPosition) -> str:
    worst = position.worst
    return f"{worst.ball} {worst.probe} {worst.axis}" if worst else ""


def _expanded(position: PredictedPosition, k: float) -> float:
    return k * position.lengths.standard_uncertainty if position.lengths else math.nan


def _data(position: PredictedPosition) -> Data:
    return {
        **picked(position, "name", "converged", "predicted"),
        "mean_square_error": position.mean_square,
        **picked(position, "sigma", "chance"),
        "worst_reading": position.worst and vars(position.worst),
        "largest_length_difference": position.lengths and {**vars(position.lengths), "unit": "m"},
    }
