"""A selection of positions and certificates as text."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.extensions import service
from ballplate.simulator.inputs.settings import number_of

from ..presentation.formatting import aligned, number, picked
from ..presentation.result import Result
from ..presentation.table_columns import table_lines
from .choice import Gain, Selection
from .constraints import HOUR, Spent
from .criteria import DESCRIPTIONS
from .done import base_name
from .drift_in_orders import DriftEffect, in_order_settings, in_time, is_of_plates
from .experiment_file import experiment_text
from .orders import ORDERS
from .run_sheet_tables import sheet_data, sheet_lines
from .schedule import RunSheet, run_sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Candidates left out, and reasons for leaving candidates out of the pool, that are told.
TOLD = 5


@dataclass(frozen=True, repr=False)
class Campaign(Selection, Result):
    """A selection that shows itself, with the run sheet of what was chosen."""

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
        """The choice as the text of an experiment file that is to stand in a folder.

        :raises ExperimentError: the experiment comes from no file.
        """
        source = self.experiment.source.name
        header = f"Chosen by ballplate plan from {source}: {self.criterion}, no more"
        header += f" than {self.budget}."
        deficiency, stated = self.left_open or None, self.experiment.expected_rank_deficiency
        if stated == self.prediction.verdict.deficiency:
            deficiency = stated
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

    def sheet_text(self, form: str = ".txt") -> str:
        """The run sheet as .html to print, .md, .csv or .txt.

        :raises ValueError: another form.
        """
        return self.to_print.text(form)

    @property
    def to_print(self) -> Any:
        """The run sheet with what it is printed with: the table to fill in, and the points."""
        return service("Sheet")(self.experiment, self.sheet)

    def headline(self) -> str:
        count = f"{len(self.chosen)} of {len(self.pool.candidates)} candidates"
        if not self.is_determined:
            return f"{count}; something stays undetermined"
        value = f"{1e6 * self.value:.4g} µm" if self.unit == "m" else f"{self.value:.4g}"
        return f"{count}, {self.criterion} {value}"

    def lines(self) -> list[str]:
        """The choice beside its bound, gains, the curve, U1 to U6 and the run sheet, as lines of
        text.
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
                "no choice was found that determines everything; what the nearest one leaves"
                " undetermined follows"
            )
        elif math.isnan(self.bound):
            lines.append(f"there is no bound of {self.criterion}")
        else:
            lines.append(
                "no choice within the limits is better by more than"
                f" {100 * (1.0 - self.efficiency):.1f} %"
            )
        if self.excluded:
            lines.append(
                f"left out of {self.criterion}: {self.excluded} that no choice from this pool"
                " determines"
            )
        if self.gap is not None:
            lines += [self.gap.words, self.gap.remedy]
        lines += _interrupted(self)
        if self.gains:
            lines += ["", *_gain_table(self)]
        if self.curve:
            lines += ["", *_curve_table(self)]
        if self.orders:
            lines += ["", *_order_table(self)]
        return [*lines, "", *self.prediction.lines()[1:], "", *sheet_lines(self.sheet)]

    def data(self) -> dict[str, Any]:
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
            "interrupted": [picked(one, "name", "readings") for one in self.interrupted],
            "completed": self.completed and self.completed.whole.name,
            "left_open": self.left_open,
            "whole_pool": self.gap and self.gap.to_dict(),
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
            **picked(self, "order", "drift", "orders"),
            "run_sheet": sheet_data(self.sheet),
            "plan": self.prediction.to_dict(),
        }

    def rows(self) -> list[dict[str, Any]]:
        """One row for each step of the run sheet, times in seconds."""
        return list(sheet_data(self.sheet)["steps"])

    def plot(self, path: str | Path | None = None) -> Figure:
        """The criterion against the budget, what each position gains, and the positions in the
        volume.

        With a path, which ends in .svg, .png or .pdf, the picture is written as well.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path ends in something else.
        """
        figure: Figure = service("draw_campaign")(self, path)
        return figure


def _order_table(campaign: Campaign) -> list[str]:
    """What a drift does in each order, and which one is chosen."""
    size = campaign.drift
    budget = campaign.budget.seconds

    def remarks(one: DriftEffect) -> str:
        is_over = budget is not None and one.seconds > budget * (1.0 + 1e-9)
        words = ["chosen"] if one.order == campaign.order.name else []
        return ", ".join(words + (["more hours than allowed"] if is_over else []))

    columns = {
        "order": lambda one: ORDERS[one.order],
        "hours": ("seconds", _hours),
        "change-over, h": ("change_seconds", _hours),
        f"{number(1e6 * size.point)} µm/h does": ("of_point", _micrometres),
        f"{number(1e6 * size.scale)} ppm/h does": ("of_scale", _micrometres),
        "U6, no drift": ("without", _micrometres),
        "drift estimated": ("estimated", _micrometres),
        "": remarks,
    }
    table = table_lines(columns, campaign.orders)
    places = (step.candidate for step in campaign.sheet.steps)
    if not is_of_plates(campaign.experiment, places):
        why = "no figures of drift: that of length standards is not followed"
        return [*table, why]
    return [
        *table,
        "what a drift that nobody knows of changes a distance between corrected points by at"
        " most, and the mean uncertainty of these distances; µm",
        *_chosen_without_drift(campaign),
    ]


def _chosen_without_drift(campaign: Campaign) -> list[str]:
    """That the drift of the file had no part in the choice."""
    drifts = [one for one in campaign.experiment.influences if one.in_order]
    if not drifts:
        return []
    return [
        "positions were chosen as if nothing drifted; U1 to U6 are those with the drift of the"
        " file, in the order chosen"
    ]


def _interrupted(campaign: Campaign) -> list[str]:
    """What becomes of positions that were read in part."""
    names = {one.name for one in campaign.chosen}
    lines = []
    for one in campaign.interrupted:
        text = (
            f"{campaign.title_of(one)} was interrupted after {number_of(one.readings, 'reading')}"
        )
        if campaign.completed is not None and campaign.completed.whole.name == one.name:
            text += f"; {campaign.completed.rest.readings} more complete it"
        elif again := [
            name for name in names if name != one.name and base_name(name) == base_name(one.name)
        ]:
            text += f'; it is set up again as "{again[0]}"'
        else:
            text += "; it is left so"
        lines.append(text)
    if campaign.left_open:
        count = "one direction" if campaign.left_open == 1 else f"{campaign.left_open} directions"
        lines.append(
            f"too little was read there to determine {count} of its pose; nothing else"
            " depends on that"
        )
    for one in campaign.ignored:
        lines.append(
            f"{one.name} is left out: nothing else worth its time reads the other balls of"
            f" {one.item.artefact}; delete its readings from the file"
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
    return f" (and not offered: {'; '.join([*words[:TOLD], *more])})"


def _comparison(campaign: Campaign) -> list[str]:
    rows = [["", campaign.criterion, "", "hours", "readings", "positions"]]
    rows.append(["chosen", *_value(campaign, campaign.value), *_spent(campaign.spent)])
    if not math.isnan(campaign.bound):
        rows.append(["bound of any choice", *_value(campaign, campaign.bound), "", "", ""])
    if campaign.drawn is not None and campaign.drawn_spent is not None:
        words = campaign.drawn_words + ("" if campaign.drawn_is_within else " (more than allowed)")
        rows.append([words, *_value(campaign, campaign.drawn), *_spent(campaign.drawn_spent)])
    if campaign.target is not None:
        rows.append(["target (of u)", *_value(campaign, campaign.target), "", "", ""])
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
        ["left out: " + gain.candidate.name, *_gain(campaign, gain)]
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


def _gain_data(gain: Gain) -> dict[str, Any]:
    return {
        "name": gain.candidate.name,
        "without": gain.without,
        "with": gain.with_,
        "seconds": gain.candidate.seconds,
    }


def _names(candidates: Iterable[Any]) -> list[str]:
    return [candidate.name for candidate in candidates]
