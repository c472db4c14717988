"""Plot of a planned campaign: criterion against limit, and chosen positions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.planning import DESCRIPTIONS, HOUR, Budget, Campaign, Spent
from ballplate.presentation import (
    DASHES,
    INK,
    MARKERS,
    MUTED,
    PAPER,
    SERIES,
    draw_scene,
    drawing,
    legend_above,
    number,
    placed_axes,
    save,
    scene,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

# Points: of the drawing, its parts and what stands around them.
WIDTH, LEFT, RIGHT, BELOW, ABOVE = 480.0, 56.0, 16.0, 44.0, 26.0
CURVE, SCENE, LEGEND, LINE = 180.0, 330.0, 42.0, 16.0

CHOSEN, BOUND, TARGET = "chosen", "bound of any choice", "target"

# Values further apart than this are drawn on a logarithmic axis; a target further off than this is
# told in words.
WIDE, FAR = 5.0, 4.0


def draw_campaign(selection: Campaign, path: str | Path | None = None) -> Figure:
    """Draw the criterion against the limit, and the chosen positions; save to the path, if any.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the file name has no known picture format.
    :raises OSError: the file cannot be written.
    """
    marks = _marks(selection)
    top = CURVE + LEGEND + BELOW if selection.curve else LINE
    total = SCENE + top + ABOVE
    with drawing(total, WIDTH) as figure:
        unit = "" if selection.unit == "1" else ", µm"
        _title(figure, total - 14.0, f"{DESCRIPTIONS[selection.criterion]}{unit}")
        if selection.curve:
            _curve(
                placed_axes(figure, LEFT, total - ABOVE - top + BELOW, WIDTH - LEFT - RIGHT, CURVE),
                selection,
                marks,
            )
        else:
            values = "; ".join(f"{mark.name}: {mark.text}" for mark in marks)
            _title(figure, total - ABOVE - 0.5 * LINE, values)
        axes = placed_axes(figure, 0.0, 0.0, WIDTH, SCENE)
        axes.set_axis_off()
        axes.set_aspect("equal")
        draw_scene(axes, scene(selection.prediction.design))
        return save(figure, path, words(selection))


def words(selection: Campaign) -> str:
    """The picture for those who do not see it."""
    caption = [
        f"{selection.criterion}, at most {selection.budget}: chosen"
        f" {_value_text(selection, selection.value)}"
    ]
    if not math.isnan(selection.bound):
        caption.append(f"bound of any choice {_value_text(selection, selection.bound)}")
    if selection.drawn is not None:
        caption.append(f"{selection.drawn_words} {_value_text(selection, selection.drawn)}")
    if selection.target is not None:
        caption.append(f"target {_value_text(selection, selection.target)}")
    offered = len(selection.pool.candidates)
    return f"{', '.join(caption)}; {len(selection.chosen)} chosen of {offered} candidates"


def _value_text(selection: Campaign, value: float) -> str:
    if math.isinf(value):
        return "deficient"
    return number(value, 3) if selection.unit == "1" else f"{number(1e6 * value, 3)} µm"


def _title(figure: Figure, height: float, text: str) -> None:
    total = 72.0 * figure.get_size_inches()[1]
    figure.text(10.0 / WIDTH, height / total, text, fontsize=10.5, va="center")


@dataclass(frozen=True)
class _Extent:
    """The limited quantity along the axis."""

    name: str
    of_budget: str
    factor: float

    def amount(self, limit: Budget | Spent) -> float:
        value = getattr(limit, self.of_budget)
        assert value is not None
        return float(value) / self.factor


def _extent(budget: Budget) -> _Extent:
    if budget.seconds is not None:
        return _Extent("hours", "seconds", HOUR)
    return _Extent(*(("readings",) * 2 if budget.readings is not None else ("positions",) * 2), 1.0)


@dataclass(frozen=True)
class _Mark:
    """A value of the criterion on the plot, in micrometres or as a ratio."""

    name: str
    value: float
    colour: str
    marker: str

    @property
    def text(self) -> str:
        return number(self.value, 3) if math.isfinite(self.value) else "deficient"


def _factor(selection: Campaign) -> float:
    return 1.0 if selection.unit == "1" else 1e6


def _marks(selection: Campaign) -> list[_Mark]:
    """Return the choice and the values for its comparison."""
    marks = [_Mark(CHOSEN, selection.value, SERIES[0], MARKERS[0])]
    if not math.isnan(selection.bound):
        marks.append(_Mark(BOUND, selection.bound, MUTED, "|"))
    if selection.drawn is not None:
        marks.append(_Mark(selection.drawn_words, selection.drawn, SERIES[1], MARKERS[3]))
    if selection.target is not None:
        marks.append(_Mark(TARGET, selection.target, INK, "|"))
    return [replace(mark, value=_factor(selection) * mark.value) for mark in marks]


# In one piece: layers of one drawing, from the back to the front.
def _curve(axes: Axes, selection: Campaign, marks: Sequence[_Mark]) -> None:
    """Draw the criterion against the limit: choices, their bounds, current design, target."""
    from matplotlib.ticker import MaxNLocator

    extent, factor = _extent(selection.budget), _factor(selection)
    points = sorted(selection.curve, key=lambda point: extent.amount(point.budget))
    x = np.array([extent.amount(point.budget) for point in points])
    values = factor * np.array([point.value for point in points])
    bounds = factor * np.array([point.bound for point in points])
    by_name = {mark.name: mark for mark in marks}
    here = extent.amount(selection.budget)
    drawn_at = here if selection.drawn_spent is None else extent.amount(selection.drawn_spent)

    target = by_name.pop(TARGET, None)
    finite_values = [*values, *bounds, *(mark.value for mark in by_name.values())]
    low, high = _limits(finite_values, None if target is None else target.value)
    axes.set_yscale("log" if high > WIDE * low > 0.0 else "linear")
    axes.set_ylim(low, high)
    ends = np.array([*x, here, drawn_at])
    margin = 0.06 * float(np.ptp(ends)) or 0.5
    axes.set_xlim(max(ends.min() - margin, 0.0), ends.max() + margin)
    if not np.isnan(bounds).all():
        # What bounds a budget bounds smaller ones as well: between two of them the bound of the
        # larger holds.
        edges, steps = np.repeat(x, 2)[:-1], np.repeat(bounds, 2)[1:]
        axes.fill_between(edges, low, steps, color=MUTED, alpha=0.2, linewidth=0)
        axes.plot(edges, steps, color=MUTED, linestyle=DASHES[1], linewidth=1.0, label=BOUND)
        axes.plot(x, bounds, color=MUTED, linestyle="none", marker="_", markersize=9.0)
    axes.plot(
        x,
        values,
        color=SERIES[0],
        marker=MARKERS[0],
        markerfacecolor=PAPER,
        label="best choice found",
    )
    if BOUND in by_name and selection.is_determined:
        ends_of_gap = [by_name[BOUND].value, by_name[CHOSEN].value]
        axes.plot([here, here], ends_of_gap, color=SERIES[0], linewidth=0.8, linestyle=DASHES[2])
    for name, at_budget in ((CHOSEN, here), (selection.drawn_words, drawn_at)):
        if name in by_name:
            mark = by_name[name]
            is_known = math.isfinite(mark.value)
            axes.plot(
                at_budget,
                mark.value if is_known else high,
                color=mark.colour,
                linestyle="none",
                clip_on=False,
                marker=mark.marker if is_known else "^",
                markersize=9.0,
                zorder=4,
                label=f"{name}: {mark.text}",
            )
    if target is not None:
        if low <= target.value <= high:
            axes.axhline(target.value, color=INK, linewidth=1.2)
        beyond = (
            ""
            if low <= target.value <= high
            else f" ({'above' if target.value > high else 'below'})"
        )
        axes.plot([], [], color=INK, linewidth=1.2, label=f"{TARGET}: {target.text}{beyond}")
    axes.set_xlabel(f"{extent.name} allowed")
    axes.xaxis.set_major_locator(
        MaxNLocator(nbins=8, integer=extent.name != "hours", steps=[1, 2, 5, 10])
    )
    _plain_numbers(axes.yaxis, axes.get_yscale() == "log")
    axes.grid(True)
    legend_above(axes, 3, -0.09, 1.04)


def _limits(values: Sequence[float], target: float | None) -> tuple[float, float]:
    """Return ends of the axis around finite values, and the target unless it is far off."""
    finite_values = np.array([value for value in values if math.isfinite(value)] or [target or 1.0])
    if target is not None and finite_values.min() / FAR <= target <= finite_values.max() * FAR:
        finite_values = np.append(finite_values, target)
    low, high = float(finite_values.min()), float(finite_values.max())
    if high > WIDE * low > 0.0:
        return low / 1.25, high * 1.4
    margin = 0.15 * (high - low) or 0.2 * high
    return max(low - margin, 0.0), high + margin


def _plain_numbers(axis: Axis, is_logarithmic: bool) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

    if is_logarithmic:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.6g}"))
        axis.set_minor_formatter(NullFormatter())
    else:
        axis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 2, 5, 10]))
