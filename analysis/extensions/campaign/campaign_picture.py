"""Picture of a planned campaign: the criterion against the limit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.presentation import DASHES, INK, MARKERS, MUTED, PAPER, SERIES, drawing, save

from ..planning import DESCRIPTIONS, HOUR, Budget, Campaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Points: of the drawing.
HEIGHT, WIDTH = 260.0, 480.0


def draw_curve(campaign: Campaign, path: str | Path | None = None) -> Figure:
    """Draw the best choices found for several limits with their bounds, the criterion of the
    file's positions, and the target; save to the path, if any.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the file name has no known picture format.
    :raises OSError: the file cannot be written.
    """
    factor, unit = (1.0, "") if campaign.unit == "1" else (1e6, ", µm")
    name, _ = _limit(campaign.budget)
    limits = [_limit(point.budget)[1] for point in campaign.curve]
    with drawing(HEIGHT, WIDTH) as figure:
        axes = figure.add_axes((0.11, 0.17, 0.86, 0.72))
        axes.set_title(f"{DESCRIPTIONS[campaign.criterion]}{unit}", loc="left")
        axes.set_xlabel(f"{name} allowed")
        # What bounds a limit bounds smaller ones as well.
        steps: Any = {"linestyle": DASHES[1], "drawstyle": "steps-pre"}
        bounds = factor * np.array([point.bound for point in campaign.curve])
        axes.plot(limits, bounds, color=MUTED, label="bound of any choice", **steps)
        dots: Any = {"marker": MARKERS[0], "markerfacecolor": PAPER}
        values = factor * np.array([point.value for point in campaign.curve])
        axes.plot(limits, values, color=SERIES[0], label="best choice found", **dots)
        others = (campaign.drawn_words, campaign.drawn, SERIES[1]), ("target", campaign.target, INK)
        for label, value, colour in others:
            if value is not None and np.isfinite(value):
                axes.axhline(factor * value, color=colour, linewidth=1.2, label=label)
        axes.set_ylim(bottom=0.0)
        axes.grid(True)
        axes.legend()
        return save(figure, path, f"{campaign.criterion} against {name} allowed")


def _limit(budget: Budget) -> tuple[str, float]:
    """The limited quantity along the axis, and its value."""
    if budget.seconds is not None:
        return "hours", budget.seconds / HOUR
    if budget.readings is not None:
        return "readings", budget.readings
    return "positions", budget.positions or 0
