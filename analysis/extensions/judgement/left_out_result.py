"""Predictions of groups left out: text, data and rows."""

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

    position: str
    ball: str
    probe: str
    axis: str
    error: float
    standard_uncertainty: float
    standardised: float


@dataclass(frozen=True)
class LengthDifference:
    """The largest change of a corrected length without a group, in metres, with the standard
    uncertainties of the change and of the length. `undetermined` lengths rest on the group alone.
    """

    change: float
    standard_uncertainty: float
    of_length: float
    undetermined: int
    between: tuple[str, str]

    @property
    def standardised(self) -> float:
        return self.change / self.standard_uncertainty if self.standard_uncertainty > 0.0 else 0.0


@dataclass(frozen=True)
class PredictedGroup:
    """A position, plate or direction that was left out and predicted.

    `predicted` counts the independent co-ordinates that the others predict, `mean_square` is the
    mean square of their errors over the stated variances; `sigma` is the others' own. `chance` is
    the p-value of the errors.
    """

    kind: str
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
    """Everything that can be left out of an experiment's readings, predicted from the rest."""

    label: str
    title: str
    observed: ObservedReadings
    left_out: tuple[PredictedGroup, ...]
    sigma_is_given: bool
    coverage_factor: float

    @property
    def failed(self) -> tuple[PredictedGroup, ...]:
        """Groups whose prediction fails the joint test."""
        tested = [group for group in self.left_out if group.predicted > 0]
        return tuple(group for group in tested if group.chance * len(tested) < FAILED)

    @property
    def complaint(self) -> str:
        lost = [group for group in self.left_out if not group.converged]
        reasons = [
            f"{group.kind} {group.name} is predicted wrongly by the others" for group in self.failed
        ]
        reasons += [
            f"without {group.kind} {group.name} the estimate does not converge" for group in lost
        ]
        if not any(group.predicted for group in self.left_out):
            reasons.append(
                "no test is possible: no group that can be left out is predicted by the others"
            )
        return "; ".join(reasons)

    def headline(self) -> str:
        tested = sum(group.predicted > 0 for group in self.left_out)
        if not tested:
            return "no group that can be left out is predicted by the others"
        return f"{tested} left out in turn, {len(self.failed)} predicted wrongly"

    def lines(self) -> list[str]:
        test = "chi-squared" if self.sigma_is_given else "F"
        k = self.coverage_factor
        failed = self.failed
        columns = {
            "left out": "kind",
            "": "name",
            "predicted": "predicted",
            "rms error / u": (_error, 3),
            f"{test}: p-value": (_chance, chance_words),
            "worst reading": _worst,
            "error / u": ("worst.standardised", 3),
            "length, µm": ("lengths.change", 3),
            f"U (k = {k:g}), µm": (lambda group: _expanded(group, k), 3),
            " ": lambda group: "<- failed" * (group in failed),
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
        tested = sum(group.predicted > 0 for group in self.left_out)
        if not tested:
            return [*lines, self.headline()]
        if not failed:
            least = min(group.chance for group in self.left_out if group.predicted > 0)
            summary = (
                f"no prediction fails: the smallest of {tested} p-values is {chance_words(least)}"
            )
            return [*lines, summary]
        names = ", ".join(f"{group.kind} {group.name}" for group in failed)
        return [
            *lines,
            (
                f"predicted wrongly: {names}; the error model is too small there, or the readings"
                " or certificates contradict one another: see ballplate models and the readings"
                " that fit flags"
            ),
        ]

    def data(self) -> Data:
        return {
            **self.named,
            **picked(self, "sigma_is_given"),
            "left_out": [_data(group) for group in self.left_out],
            "failed": [f"{group.kind} {group.name}" for group in self.failed],
            **self.notes_data(),
        }

    def columns(self) -> MainTable:
        """One row for each that was left out."""
        return COLUMNS, self.left_out


COLUMNS = {
    "kind": "kind",
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


def _error(group: PredictedGroup) -> float:
    """Return the root mean square of standardised errors; NaN without a prediction."""
    is_known = group.predicted and group.sigma > 0.0
    return group.mean_square**0.5 / group.sigma if is_known else math.nan


def _chance(group: PredictedGroup) -> float:
    return group.chance if group.predicted else math.nan


def _worst(group: PredictedGroup) -> str:
    if group.worst is None:
        return ""
    where = "" if group.kind == "position" else f"{group.worst.position}: "
    return f"{where}{group.worst.ball} {group.worst.probe} {group.worst.axis}"


def _expanded(group: PredictedGroup, k: float) -> float:
    return k * group.lengths.standard_uncertainty if group.lengths else math.nan


def _data(group: PredictedGroup) -> Data:
    return {
        **picked(group, "kind", "name", "converged", "predicted"),
        "mean_square_error": group.mean_square,
        **picked(group, "sigma", "chance"),
        "worst_reading": group.worst and vars(group.worst),
        "largest_length_difference": group.lengths and {**vars(group.lengths), "unit": "m"},
    }
