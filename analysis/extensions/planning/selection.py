"""A selection of positions and certificates, with the effect of each candidate."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ballplate.presentation import Data, Result, aligned, number, picked
from ballplate.results import (
    Prediction,
    Qualification,
    given_words,
    qualification_data,
    target_lines,
)
from ballplate.simulator.experiment import Candidate, Experiment, Pool
from ballplate.simulator.inputs import number_of, service

from .constraints import HOUR, Budget, Spent, with_chosen
from .criteria import DESCRIPTIONS, MAXIMUM, CriterionName
from .experiment_file import experiment_text
from .run_sheet_tables import sheet_data, sheet_lines
from .schedule import RunSheet
from .set_ups import REST, base_name

# Candidates left out, and reasons for leaving candidates out of the pool, that are told.
TOLD = 5


@dataclass(frozen=True)
class Gain:
    """Effect of a candidate: the criterion `without` it and `with_` it, infinite if deficient."""

    candidate: Candidate
    without: float
    with_: float

    @property
    def relative(self) -> float:
        """Relative increase of the criterion without the candidate."""
        return self.without / self.with_ - 1.0


@dataclass(frozen=True)
class CurvePoint:
    """The best selection found for a limit of time; `bound` may be NaN (missing)."""

    budget: Budget
    spent: Spent
    chosen: tuple[Candidate, ...]
    value: float
    bound: float


@dataclass(frozen=True, repr=False)
class Campaign(Result):
    """A selection with its evaluation; values in metres, those of `condition` ratios.

    `chosen` follows the order of the pool, `done` (read already, in part or in full) the order of
    reading. `completed` has all its readings, past and future. `interrupted` positions were read
    in part; `left_open` counts the directions of their own poses and lengths that remain
    undetermined, on which no other parameter depends. `ignored` readings are excluded. `value` is
    infinite if the selection is deficient; `bound` is the lower bound of all selections, NaN if
    missing. `drawn` is the criterion of the experiment's own positions, or of an earlier choice,
    within the limits or not, described by `drawn_words`. `prediction` evaluates the full choice in
    the order of the `sheet`.
    """

    experiment: Experiment
    pool: Pool
    criterion: CriterionName
    unit: str
    excluded: int
    budget: Budget
    chosen: tuple[Candidate, ...]
    done: tuple[Candidate, ...]
    spent: Spent
    value: float
    bound: float
    drawn: float | None
    drawn_words: str
    drawn_spent: Spent | None
    target: float | None
    gains: tuple[Gain, ...]
    left_out: tuple[Gain, ...]
    prediction: Prediction
    sheet: RunSheet
    curve: tuple[CurvePoint, ...] = ()
    completed: tuple[Candidate, Candidate] | None = None
    interrupted: tuple[Candidate, ...] = ()
    left_open: int = 0
    ignored: tuple[Candidate, ...] = ()

    @property
    def label(self) -> str:
        return self.prediction.label

    @property
    def title(self) -> str:
        return self.prediction.title

    @property
    def chosen_experiment(self) -> Experiment:
        """The experiment with the chosen positions and certificates alone, in the order of the run
        sheet and under its short names.
        """
        return with_chosen(self.experiment, self.sheet.written)

    def to_yaml(self, folder: str | Path = ".") -> str:
        """Return the choice as the text of an experiment file for a folder.

        :raises ExperimentError: the experiment comes from no file.
        """
        source = self.experiment.source.name
        header = f"Chosen by ballplate plan from {source}: {self.criterion}, no more"
        header += f" than {self.budget}."
        deficiency, expected_deficiency = (
            self.left_open or None,
            self.experiment.expected_rank_deficiency,
        )
        if expected_deficiency == self.prediction.verdict.deficiency:
            deficiency = expected_deficiency
        return experiment_text(
            self.experiment, self.sheet.written, header, Path(folder), deficiency
        )

    def sheet_page(self) -> str:
        """Return the run sheet as a page of HTML to print."""
        return str(self.to_print.page())

    @property
    def to_print(self) -> Any:
        """Return the run sheet with the table to fill in and the points."""
        return service("Sheet")(self.experiment, self.sheet)

    def title_of(self, candidate: Candidate) -> str:
        """The name of a candidate, after its short name if it has one."""
        prefix, name = "", candidate.name
        if name.startswith(REST):
            prefix, name = REST, name.removeprefix(REST)
        short = self.sheet.names.get(name, name)
        return candidate.name if short == name else f"{prefix}{short}, {name}"

    @property
    def efficiency(self) -> float:
        """Bound over value: the selection is at most this far from the best possible."""
        return self.bound / self.value

    @property
    def drawn_is_within(self) -> bool:
        """True if the reference selection is within the limit; then the choice is never worse."""
        spent, budget = self.drawn_spent, self.budget
        return spent is None or spent.is_within(budget)

    @property
    def is_determined(self) -> bool:
        return math.isfinite(self.value)

    def headline(self) -> str:
        count = f"{len(self.chosen)} of {len(self.pool.candidates)} candidates"
        if not self.is_determined:
            return f"{count}; something stays undetermined"
        value = f"{1e6 * self.value:.4g} µm" if self.unit == "m" else f"{self.value:.4g}"
        return f"{count}, {self.criterion} {value}{given_words(self.qualifications)}"

    @property
    def qualifications(self) -> tuple[Qualification, ...]:
        """Those of its prediction, and of the reach of the probes."""
        return (*self.prediction.qualifications, *of_pool(self.pool))

    def lines(self) -> list[str]:
        """Return the choice with its bound, effects, the curve, U1 to U6 and the run sheet, as
        lines of text.
        """
        lines = [
            f"{self.prediction.label}: {self.prediction.title}",
            (f"{len(self.pool.candidates)} candidates{_dropped(self)}; no more than {self.budget}"),
            f"{self.criterion}: {DESCRIPTIONS[self.criterion]}",
            "",
            *_comparison(self),
        ]
        if not self.is_determined:
            lines.append(
                "no choice was found that determines every parameter; the undetermined ones of the"
                " nearest follow"
            )
        elif math.isnan(self.bound):
            lines.append(f"there is no bound of {self.criterion}")
        else:
            lines.append(
                "no choice within the limits is better by more than"
                f" {100 * (1.0 - self.efficiency):.1f} %"
            )
        lines += target_lines(self.prediction.lengths)
        lines += [each.text for each in self.qualifications if each.kind != "undetermined"]
        if self.excluded:
            lines.append(
                f"left out of {self.criterion}: {self.excluded} that no choice from this pool"
                " determines"
            )
        if any(influence.in_order for influence in self.experiment.influences):
            lines.append("positions were chosen without drift; U1 to U6 are those with the drift")
        lines += _interrupted(self)
        if self.gains:
            lines += ["", *_gain_table(self)]
        if self.curve:
            lines += ["", *_curve_table(self)]
        return [*lines, "", *self.prediction.lines()[1:], "", *sheet_lines(self.sheet)]

    def data(self) -> Data:
        """The campaign as data, in metres and seconds."""
        return {
            "experiment": self.prediction.label,
            "candidates": len(self.pool.candidates),
            "dropped": dict(self.pool.dropped),
            **picked(self, "criterion", "unit", "budget", "value", "bound", "drawn"),
            **picked(self, "drawn_spent", "target", "excluded", "spent"),
            "chosen": _names(self.chosen),
            "names": self.sheet.names,
            "done": _names(self.done),
            "interrupted": [picked(position, "name", "readings") for position in self.interrupted],
            "completed": self.completed and self.completed[1].name,
            "left_open": self.left_open,
            "ignored": _names(self.ignored),
            "gains": list(map(_gain_data, self.gains)),
            "left_out": list(map(_gain_data, self.left_out)),
            "curve": [
                {
                    **picked(point, "budget", "spent"),
                    "chosen": _names(point.chosen),
                    **picked(point, "value", "bound"),
                }
                for point in self.curve
            ],
            "run_sheet": sheet_data(self.sheet),
            "qualifications": qualification_data(self.qualifications),
            "plan": self.prediction.to_dict(),
        }

    def rows(self) -> list[Data]:
        """One row for each step of the run sheet, times in seconds."""
        return list(sheet_data(self.sheet)["steps"])


def _interrupted(campaign: Campaign) -> list[str]:
    """Return lines on positions that were read in part."""
    names = {candidate.name for candidate in campaign.chosen}
    lines = []
    for position in campaign.interrupted:
        count = number_of(position.readings, "reading")
        text = f"{campaign.title_of(position)} was interrupted after {count}"
        if campaign.completed is not None and campaign.completed[1].name == position.name:
            text += f"; {campaign.completed[0].readings} more complete it"
        elif again := [
            name
            for name in names
            if name != position.name and base_name(name) == base_name(position.name)
        ]:
            text += f'; it is set up again as "{again[0]}"'
        else:
            text += "; it is left so"
        lines.append(text)
    if campaign.left_open:
        count = "one direction" if campaign.left_open == 1 else f"{campaign.left_open} directions"
        lines.append(
            f"too little was read to determine {count} of its pose; no other parameter depends on"
            " that"
        )
    for position in campaign.ignored:
        lines.append(
            f"{position.name} is left out: no affordable position reads the other balls of"
            f" {position.item.artefact}; delete its readings from the file"
        )
    return lines


def _dropped(campaign: Campaign) -> str:
    words = [
        f"{count} {reason}"
        for reason, count in sorted(campaign.pool.dropped.items(), key=lambda item: -item[1])
    ]
    if not words:
        return ""
    more = [f"{len(words) - TOLD} reasons more"] if len(words) > TOLD else []
    return f" (and left out: {'; '.join([*words[:TOLD], *more])})"


def _comparison(campaign: Campaign) -> list[str]:
    rows = [["", campaign.criterion, "", "hours", "readings", "positions"]]
    rows.append(["chosen", *_value(campaign, campaign.value), *_spent(campaign.spent)])
    if not math.isnan(campaign.bound):
        rows.append(["bound of any choice", *_value(campaign, campaign.bound), "", "", ""])
    if campaign.drawn is not None and campaign.drawn_spent is not None:
        words = campaign.drawn_words + ("" if campaign.drawn_is_within else " (more than allowed)")
        rows.append([words, *_value(campaign, campaign.drawn), *_spent(campaign.drawn_spent)])
    if campaign.target is not None:
        words = "target / k" if campaign.criterion.endswith(MAXIMUM) else "mean of target / k"
        words = words if campaign.unit == "m" else "limit"
        rows.append([words, *_value(campaign, campaign.target), "", "", ""])
    return aligned(rows, [False, True, False, True, True, True])


def _hours(seconds: float) -> str:
    return f"{seconds / HOUR:.2f}"


def _value(campaign: Campaign, value: float) -> list[str]:
    if math.isinf(value):
        return ["-", "deficient"]
    return [number(1e6 * value), "µm"] if campaign.unit == "m" else [number(value), ""]


def _spent(spent: Spent) -> list[str]:
    return [_hours(spent.seconds), str(spent.readings), str(spent.positions)]


def _gain_table(campaign: Campaign) -> list[str]:
    rows = [["", f"{campaign.criterion} without it", "with it", "minutes"]]
    rows += [
        ["chosen: " + campaign.title_of(gain.candidate), *_gain(campaign, gain)]
        for gain in campaign.gains
    ]
    rows += [
        ["beyond the limit: " + gain.candidate.name, *_gain(campaign, gain)]
        for gain in campaign.left_out[:TOLD]
    ]
    return aligned(rows, [False, True, True, True])


def _gain(campaign: Campaign, gain: Gain) -> list[str]:
    without, with_ = (
        " ".join(_value(campaign, value)).strip("- ").strip()
        for value in (gain.without, gain.with_)
    )
    return [without, with_, f"{gain.candidate.seconds / 60:.0f}"]


def _curve_table(campaign: Campaign) -> list[str]:
    rows = [["no more than", campaign.criterion, "", "bound", "hours", "readings", "positions"]]
    for point in campaign.curve:
        bound = "-" if math.isnan(point.bound) else _value(campaign, point.bound)[0]
        rows.append(
            [str(point.budget), *_value(campaign, point.value), bound, *_spent(point.spent)]
        )
    return aligned(rows, [False, True, False, True, True, True, True])


def _gain_data(gain: Gain) -> Data:
    return {
        "name": gain.candidate.name,
        "without": gain.without,
        "with": gain.with_,
        "seconds": gain.candidate.seconds,
    }


def _names(candidates: Iterable[Any]) -> list[str]:
    return [candidate.name for candidate in candidates]


# Reasons for which a candidate is not offered that are those of probes, by their first words.
OF_PROBES = ("out of reach", "outside the volume")


def of_pool(pool: Pool) -> Iterator[Qualification]:
    """Yield the qualification of a choice from a pool some of whose candidates probes do not
    reach.
    """
    reasons = [
        f"{count} {reason}"
        for reason, count in pool.dropped.items()
        if reason.startswith(OF_PROBES)
    ]
    if reasons:
        text = f"warning: candidates not offered: {'; '.join(reasons)}"
        yield Qualification("reach", "the reach of the probes", text)
