"""Repairs of a design: changes, with the prediction of the changed design, as lines of text and
as plain data.
"""

from __future__ import annotations

from dataclasses import dataclass

from ballplate.presentation import Data, finite, given, number, picked
from ballplate.rank import length
from ballplate.results import Prediction, given_words, qualification_data
from ballplate.uncertainty import OFFSET_TRIAL, exact_offsets

from .candidates import duration
from .changes import Change
from .written import Edit


@dataclass(frozen=True, eq=False)
class Repair:
    """Changes with the prediction of the changed design.

    They take `readings` and `seconds` more. `loosened` is the average U6, in metres, if probe
    offsets that the file holds exact have a standard uncertainty of `OFFSET_TRIAL`, and `target`
    the average target, both infinite if undetermined or absent. `edits` are the changes of the
    file.
    """

    changes: tuple[Change, ...]
    prediction: Prediction
    loosened: float
    target: float
    edits: tuple[Edit, ...]
    readings: int
    seconds: float

    @property
    def deficiency(self) -> int:
        return self.prediction.verdict.deficiency

    @property
    def weak(self) -> int:
        """Number of directions that remain weakly determined."""
        return len(self.prediction.verdict.weak)

    @property
    def smallest(self) -> float:
        """The smallest singular value of determined directions."""
        values = self.prediction.verdict.singular_values
        return float(values[len(values) - self.deficiency - 1])

    @property
    def order(self) -> tuple[bool, bool, bool]:
        """Sort key: first what determines everything, then what does it well, then what meets the
        target.
        """
        return bool(self.deficiency), bool(self.weak), self.loosened > self.target

    @property
    def words(self) -> str:
        """The changes as imperative sentences."""
        return "; and ".join(change.words for change in self.changes)

    @property
    def outcome(self) -> str:
        """What the changes lead to, in words."""
        words = f"rank deficiency {self.deficiency}" if self.deficiency else "full rank"
        if self.weak:
            count = "1 direction is" if self.weak == 1 else f"{self.weak} directions are"
            weakest = max(each.standard_deviation for each in self.prediction.verdict.weak)
            words += (
                f", but {count} weakly determined, the weakest known only to {length(weakest)} in"
                " corrected points"
            )
        elif not self.deficiency:
            words += ", and no weak direction"
        u6 = self.prediction.lengths
        if u6 is not None:
            words += f"; average U6 {number(1e6 * u6.average)} µm"
        experiment = self.prediction.experiment
        if u6 is not None and experiment is not None and exact_offsets(experiment):
            trial = f"with {1e6 * OFFSET_TRIAL:g} µm on the exact probe offsets"
            loose = finite(self.loosened)
            value = "undetermined" if loose is None else f"{number(1e6 * loose)} µm"
            words += f", {value} {trial}"
        words += given_words(self.prediction.qualifications)
        minutes = f"{duration(self.seconds)} more" if self.seconds else "no time more"
        is_longer = self.readings or self.seconds
        words += f"; {self.readings:+d} readings, {minutes}" if is_longer else ""
        return f"{words}; smallest singular value {self.smallest:.3g}"

    def to_dict(self) -> Data:
        """Return it as plain data in metres at full precision."""
        u6 = self.prediction.lengths
        return {
            "changes": [
                {"kind": change.kind.name.lower(), "text": change.words} for change in self.changes
            ],
            "rank_deficiency": self.deficiency,
            "weakly_determined": self.weak,
            "smallest_singular_value": self.smallest,
            "average_U6": u6 and finite(u6.average),
            "average_U6_with_uncertain_offsets": finite(self.loosened),
            "offset_uncertainty": OFFSET_TRIAL,
            "qualifications": qualification_data(self.prediction.qualifications),
            **picked(self, "readings", "seconds"),
            "edits": [
                {"path": edit.path, "adds": edit.is_new, "value": edit.value} for edit in self.edits
            ],
        }


@dataclass(frozen=True)
class Repairs:
    """Repairs of a design, the best first; without any, the `reason` if it needs one. `strategy`
    has lines on positions that would do better than its own.
    """

    repairs: tuple[Repair, ...] = ()
    reason: str = ""
    strategy: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """Return lines of each repair, with its change of the file."""
        lines = [f"repair: {self.reason}"] if self.reason else []
        for k, repair in enumerate(self.repairs, start=1):
            lines.append(f"repair {k}: {repair.words}: {repair.outcome}")
            lines += [f"repair {k}, in the file: {edit}" for edit in repair.edits]
        return [*lines, *self.strategy]

    def to_dict(self) -> Data:
        """Return repairs as plain data in metres at full precision, if any are needed."""
        is_needed = bool(self.repairs or self.reason)
        found = [each.to_dict() for each in self.repairs] if is_needed else None
        return {"repairs": found, **given(strategy=self.strategy)}
