"""A selection of positions and certificates as text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.presentation.formatting import Data
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.extensions import service
from ballplate.simulator.inputs.settings import number_of

from ..presentation.formatting import aligned, number, picked
from ..presentation.result import Result
from ..results.qualifications import Qualification, given_words, of_pool, qualification_data
from ..results.text_blocks import target_lines
from .choice import Gain, Selection
from .constraints import HOUR, Spent
from .criteria import DESCRIPTIONS, MAXIMUM
from .drift_times import in_order_settings, in_time
from .experiment_file import experiment_text
from .run_sheet_tables import sheet_data, sheet_lines
from .schedule import RunSheet, run_sheet
from .set_ups import base_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Candidates left out, and reasons for leaving candidates out of the pool, that are told.
TOLD = 5

# What is said where nothing drifts: the size of a drift that would be told of, and no orders.
WITHOUT_DRIFT: Mapping[str, Any] = {"drift": {"point": 1e-6, "scale": 1e-6}, "orders": []}


@dataclass(frozen=True, repr=False)
class Campaign(Selection, Result):
    """A selection with its tables, pictures and run sheet."""

    @property
    def label(self) -> str:
        return self.prediction.label

    @property
    def title(self) -> str:
        return self.prediction.title

    @property
    def sheet(self) -> RunSheet:
        """The choice in the order in which it is to be read."""
        return run_sheet(
            self.chosen,
            self.pool.changes,
            self.done,
            self.completed,
            self.interrupted,
            self.names,
            self.order,
        )

    @property
    def chosen_experiment(self) -> Experiment:
        """The experiment with the chosen positions and certificates alone, in the order of the run
        sheet and under its short names.
        """
        return in_time(self.experiment, self.sheet, self.pool.changes, self.names)

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
        written = self.sheet.written
        return experiment_text(
            self.experiment,
            written,
            header,
            Path(folder),
            None,
            deficiency,
            self.names,
            in_order_settings(self.chosen_experiment),
            with_times=True,
        )

    def sheet_page(self) -> str:
        """Return the run sheet as a page of HTML to print."""
        return str(self.to_print.page())

    @property
    def to_print(self) -> Any:
        """Return the run sheet with the table to fill in and the points."""
        return service("Sheet")(self.experiment, self.sheet)

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
        lines += _interrupted(self)
        if self.gains:
            lines += ["", *_gain_table(self)]
        if self.curve:
            lines += ["", *_curve_table(self)]
        orders = [] if self.orders is None else self.orders.lines(self)
        lines += ["", *orders] if orders else []
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
            "names": dict(self.names),
            "done": _names(self.done),
            "interrupted": [picked(position, "name", "readings") for position in self.interrupted],
            "completed": self.completed and self.completed.whole.name,
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
            **picked(self, "order"),
            **(WITHOUT_DRIFT if self.orders is None else self.orders.data()),
            "run_sheet": sheet_data(self.sheet),
            "qualifications": qualification_data(self.qualifications),
            "plan": self.prediction.to_dict(),
        }

    def rows(self) -> list[Data]:
        """One row for each step of the run sheet, times in seconds."""
        return list(sheet_data(self.sheet)["steps"])

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw the criterion against the limit of time, the effect of each position, and the
        positions in the volume.

        With a path, which ends in .svg, .png or .pdf, the picture is written as well.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path has another suffix.
        """
        figure: Figure = service("draw_campaign")(self, path)
        return figure


def _interrupted(campaign: Campaign) -> list[str]:
    """Return lines on positions that were read in part."""
    names = {position.name for position in campaign.chosen}
    lines = []
    for position in campaign.interrupted:
        count = number_of(position.readings, "reading")
        text = f"{campaign.title_of(position)} was interrupted after {count}"
        if campaign.completed is not None and campaign.completed.whole.name == position.name:
            text += f"; {campaign.completed.rest.readings} more complete it"
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
        rows.append([words, *_value(campaign, campaign.target), "", "", ""])
    return aligned(rows, [False, True, False, True, True, True])


def _hours(seconds: float) -> str:
    return f"{seconds / HOUR:.2f}"


def _micrometres(value: float) -> str:
    return number(1e6 * value)


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
