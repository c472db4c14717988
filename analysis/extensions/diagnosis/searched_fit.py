"""Search of a fit's residuals for gross errors, with its result as sentences and data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ballplate.presentation import Data
from ballplate.simulator.estimation import Linearisation
from ballplate.simulator.inputs import Mark
from ballplate.simulator.machines import Array

from .refits import diagnosis_with_refits
from .remainders import too_many_entries
from .suspects import Diagnosis
from .wording import diagnosis_data, diagnosis_lines, diagnosis_words


@dataclass(frozen=True)
class DiagnosisInWords(Diagnosis):
    """A diagnosis that can be printed; `marks` locate the readings in their file."""

    @property
    def names_causes(self) -> bool:
        return bool(self.suspects or self.scatter or self.refit)

    def words(self, marks: Sequence[Mark] = ()) -> list[str]:
        return diagnosis_words(self, marks)

    def lines(self, marks: Sequence[Mark] = ()) -> list[str]:
        return diagnosis_lines(self, marks)

    def data(self, marks: Sequence[Mark] = ()) -> list[Data]:
        return diagnosis_data(self, marks)


def diagnosed(
    at: Linearisation, x: Array, freedom: int, sigma_is_estimated: bool
) -> tuple[DiagnosisInWords, str]:
    """Return the causes of a fit's residuals, and the reason if there was no search."""
    untested = too_many_entries(at.design)
    if untested:
        return DiagnosisInWords(), untested
    return DiagnosisInWords(**vars(diagnosis_with_refits(at, x, freedom, sigma_is_estimated))), ""
