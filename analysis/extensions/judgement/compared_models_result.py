"""The result of a comparison of error models: text, data and rows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ballplate.presentation import Data, FitResult, chance_words, number, picked, table_lines
from ballplate.results import freedom_words
from ballplate.simulator.readings import ObservedReadings
from ballplate.uncertainty import Quantity

from .lack_of_fit import PureError
from .rungs import FILE

# Chance that a model is left although it is right, of all larger ones together (Bonferroni).
FALSE_STEP = 0.01


@dataclass(frozen=True)
class Beaten:
    """The least chance, among `count` larger models of the same kind, of what one of them explains
    more: that of `by`, empty without any.
    """

    least: float
    count: int
    by: str

    @property
    def chance(self) -> float:
        """The chance that any of so many explains as much; 1 without any."""
        return min(1.0, self.least * max(self.count, 1))


@dataclass(frozen=True)
class Rung:
    """An error model that was fitted: its number of parameters, its S^2 and degrees of freedom.

    The changes are differences of its corrected lengths between evaluation points from the
    recommended model's, in metres. Parameters undetermined beyond those of the largest model are
    `undetermined`.
    """

    model: str
    parameters: int
    sum_of_squares: float
    degrees_of_freedom: int
    bic: float
    beaten: Beaten
    largest_change: float
    rms_change: float
    is_recommended: bool
    is_of_file: bool
    undetermined: int = 0

    @property
    def sigma(self) -> float:
        return math.sqrt(self.sum_of_squares / max(self.degrees_of_freedom, 1))


@dataclass(frozen=True, repr=False)
class ComparedModels(FitResult):
    """Error models on the same readings, and the recommended one.

    `recommended` is the smallest that no larger one improves significantly, and `error_model` its
    statement in a file. `faults` are the residuals of even the largest or, if `is_mistake`, errors
    in the file that explain these; then no model is recommended, and changes of lengths are from
    the one that otherwise would be. `sigma` multiplies stated uncertainties. `lack_of_fit` is the
    p-value of the recommended model's residuals compared with `repeats`, NaN without any. `beyond`
    are models that the design leaves undetermined. `lengths` are the standard uncertainties U6
    with the recommended model.
    """

    label: str
    title: str
    observed: ObservedReadings
    rungs: tuple[Rung, ...]
    recommended: str
    error_model: dict[str, Any]
    faults: tuple[str, ...]
    sigma_is_given: bool
    sigma: float
    repeats: PureError
    lack_of_fit: float
    beaten: Beaten
    beyond: tuple[str, ...]
    lengths: Quantity
    coverage_factor: float
    unsure: tuple[str, ...] = ()
    is_mistake: bool = False

    @property
    def cautions(self) -> tuple[str, ...]:
        """Why the choice is less sure than its tests say."""
        return self.unsure

    @property
    def is_none(self) -> bool:
        """True if no model is recommended."""
        return bool(self.faults)

    def headline(self) -> str:
        return "none of these" if self.is_none else f"recommended: {self.recommended}"

    def verdict(self) -> list[str]:
        """Recommendation, as text."""
        if self.is_mistake:
            return [f"no recommendation until the file is corrected: {'; '.join(self.faults)}"]
        if self.is_none:
            return [
                (f"none of these: {'; '.join(self.faults)}"),
                (
                    "look for gross errors and drifts first (ballplate fit), then for an error that"
                    " repeats in less than the distance of the balls, such as one of a lead screw's"
                    " pitch: more coefficients would not follow it"
                ),
            ]
        if self.beaten.count:
            why = (
                "no larger model is significantly better (p ="
                f" {chance_words(self.beaten.chance)} after allowing for the number of models,"
                f" {self.beaten.count}; of {self.beaten.by})"
            )
        else:
            why = "it is the largest of its kind that this design determines"
        lines = [f"recommended: {self.recommended}; {why}"]
        file = next((rung for rung in self.rungs if rung.is_of_file), None)
        if file is not None and not file.is_recommended:
            lines.append(self._of_file(file))
        return lines

    def _of_file(self, file: Rung) -> str:
        chosen = next(rung for rung in self.rungs if rung.is_recommended)
        if file.undetermined:
            sentence = "is not determined by this design"
        elif file.beaten.chance < FALSE_STEP and file.beaten.count:
            chance = chance_words(file.beaten.chance)
            sentence = f"is too small: {file.beaten.by} explains more (p-value {chance})"
        elif file.parameters > chosen.parameters:
            sentence = "has more parameters than the readings need"
        else:
            apart = file.bic - chosen.bic
            sentence = f"is not nested with these; its BIC differs by {round(apart, 1) + 0.0:+.1f}"
        sentence = f"the file's error model, {file.model.removeprefix(FILE)}, {sentence}"
        if self.lengths.undetermined:
            return sentence
        return f"{sentence}; it changes lengths by {self._length(file.rms_change)} µm rms"

    def lines(self) -> list[str]:
        how = "given" if self.sigma_is_given else "estimated"
        test = "chi-squared" if self.sigma_is_given else "F"
        least = min(rung.bic for rung in self.rungs)
        columns = {
            "": "model",
            "parameters": "parameters",
            "freedom": "degrees_of_freedom",
            "sigma": ("sigma", "{:.4g}".format),
            f"{test}: p-value": (_chance, chance_words),
            "BIC": (lambda rung: rung.bic - least, "{:.1f}".format),
            "largest change": ("largest_change", self._length),
            "rms, µm": ("rms_change", self._length),
            " ": self._marks,
        }
        lines = [
            self.heading,
            (
                f"error models on the same readings, sigma {how}; p-value: of the largest"
                " improvement by a larger model of its kind, adjusted for their number; BIC above"
                f" the least; changes of lengths from {self.recommended}"
            ),
            "",
            *table_lines(columns, self.rungs),
            self._of_lengths(),
            "",
            *self._of_repeats(),
        ]
        if self.beyond:
            lines.append(
                f"not determined by this design, and no candidates: {'; '.join(self.beyond)}"
            )
        return [*lines, *self.verdict()]

    def _marks(self, rung: Rung) -> str:
        marks = {
            "recommended": rung.is_recommended and not self.is_none,
            "the file's": rung.is_of_file and not rung.model.startswith(FILE),
            f"{rung.undetermined} undetermined": rung.undetermined > 0,
        }
        words = ", ".join(word for word, is_so in marks.items() if is_so)
        return f"<- {words}" if words else ""

    def _length(self, value: float) -> str:
        return "undetermined" if self.lengths.undetermined else number(1e6 * value, 3)

    def _of_lengths(self) -> str:
        k = self.coverage_factor
        if self.lengths.undetermined:
            return "lengths are undetermined by this design with every model"
        largest, average = 1e6 * k * self.lengths.maximum, 1e6 * k * self.lengths.average
        return (
            f"for comparison, U (k = {k:g}) of corrected lengths: {number(largest, 3)} µm at most,"
            f" {number(average, 3)} µm on average"
        )

    def _of_repeats(self) -> list[str]:
        if not self.repeats.degrees_of_freedom:
            return ["no reading is repeated: lack of fit cannot be tested against repeats"]
        sentence = (
            f"standard deviation of repeated readings: {self.repeats.sigma:.3g} times the stated"
            f" one, with {freedom_words(self.repeats.degrees_of_freedom)}"
        )
        if math.isnan(self.lack_of_fit):
            return [f"{sentence}; no other degrees of freedom are left to test lack of fit"]
        return [
            f"{sentence}; lack of fit of {self.recommended}: p-value"
            f" {chance_words(self.lack_of_fit)}"
        ]

    def data(self) -> Data:
        return {
            **self.named,
            "recommended": None if self.is_none else self.recommended,
            "error_model": None if self.is_none else self.error_model,
            "unexplained": self.faults,
            **picked(self, "sigma_is_given", "sigma"),
            "repeats": picked(self.repeats, "sum_of_squares", "degrees_of_freedom"),
            "lack_of_fit": self.lack_of_fit,
            "undetermined_models": self.beyond,
            "lengths": {**picked(self.lengths, "maximum", "average", "undetermined"), "unit": "m"},
            "compared_with": self.recommended,
            "rungs": self.rows(),
            **self.notes_data(),
        }

    def rows(self) -> list[Data]:
        """One row for each error model."""
        lengths_are_open = self.lengths.undetermined > 0
        names = ("model", "parameters", "degrees_of_freedom", "sum_of_squares", "bic")
        return [
            {
                **picked(rung, *names),
                "chance": rung.beaten.chance if rung.beaten.count else None,
                "richer_models": rung.beaten.count,
                "best_richer_model": rung.beaten.by or None,
                "largest_change": None if lengths_are_open else rung.largest_change,
                "rms_change": None if lengths_are_open else rung.rms_change,
                "unit": "m",
                "recommended": rung.is_recommended,
                "of_the_file": rung.is_of_file,
                "undetermined": rung.undetermined,
            }
            for rung in self.rungs
        ]

    @property
    def complaint(self) -> str:
        if self.is_mistake:
            return "an error in the file explains the readings, and no error model does"
        return "no error model explains the readings" if self.is_none else ""


def _chance(rung: Rung) -> float:
    return rung.beaten.chance if rung.beaten.count else math.nan
