"""Error functions of a machine side by side, each with the band of its expanded uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.presentation import (
    DASHES,
    MUTED,
    PAPER,
    SERIES,
    SHOWN,
    drawing,
    number,
    placed_axes,
    save,
    to_uncertainty,
)
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import AXIS_ERRORS

from .error_functions import ErrorFunctions, EstimatedNumber, FunctionCurve
from .volumetric_tables import CONVENTION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Points: of a panel, between panels, and around them all.
PANEL, HEIGHT, BETWEEN, ABOVE_PANEL = 168.0, 92.0, 22.0, 22.0
LEFT, RIGHT, BELOW, ABOVE, LINE = 52.0, 14.0, 40.0, 86.0, 15.0

# The scale reaches so much beyond the largest value with its band.
MARGIN = 1.08

# Of a function with several lines along an axis, those that are drawn: along the edges of the
# volume that are lowest and highest.
DRAWN = ("low", "high")


def draw_functions(
    functions: ErrorFunctions, title: str, k: float, path: str | Path | None = None
) -> Figure:
    """Draw one panel per function and axis, with one scale per unit, squareness errors below.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the file name has no known picture format.
    :raises OSError: the file cannot be written.
    """
    panels = _panels(functions.curves)
    rows = list(dict.fromkeys(row for row, _ in sorted(panels)))
    columns = list(
        dict.fromkeys(column for _, column in sorted(panels, key=lambda panel: panel[1]))
    )
    angles = [_angle(error, k) for error in functions.squareness]
    width = LEFT + RIGHT + len(columns) * (PANEL + BETWEEN) - BETWEEN
    below = BELOW + LINE * (len(angles) + bool(angles))
    height = below + ABOVE + len(rows) * (HEIGHT + ABOVE_PANEL) - ABOVE_PANEL
    limits = _limits(functions.curves, k)
    with drawing(height, width) as figure:
        for (row, column), curves in panels.items():
            x = LEFT + columns.index(column) * (PANEL + BETWEEN)
            y = below + (len(rows) - 1 - rows.index(row)) * (HEIGHT + ABOVE_PANEL)
            axes = placed_axes(figure, x, y, PANEL, HEIGHT)
            _draw_panel(axes, curves, k, limits[curves[0].unit])
            is_last = not any((later, column) in panels for later in rows[rows.index(row) + 1 :])
            is_first = not any(
                (row, before) in panels for before in columns[: columns.index(column)]
            )
            axes.tick_params(labelbottom=is_last, labelleft=is_first)
            if is_last:
                axis = curves[0].axis
                axes.set_xlabel("part of the line" if axis is None else f"{AXIS_NAMES[axis]}, mm")
            if is_first:
                axes.set_ylabel(SHOWN[curves[0].unit])
        heads = [
            (title, 11.5),
            (f"band: expanded uncertainty U, k = {k:g}, at each position separately", 9.0),
            (CONVENTION, 9.0),
        ]
        if any(curve.line for curve in functions.curves):
            heads.append(("full lines: the other axes low; dashed: the other axes high", 9.0))
        for i, (text, size) in enumerate(heads):
            figure.text(LEFT / width, 1.0 - (18.0 + LINE * i) / height, text, fontsize=size)
        for i, text in enumerate(angles):
            y = (LINE * (len(angles) - i) - 8.0) / height
            figure.text(LEFT / width, y, text, fontsize=9.5)
        words = f"{title}: error functions with U, k = {k:g}"
        return save(figure, path, f"{words}. {'; '.join(angles)}".rstrip(". ") + ".")


Place = tuple[int, int]


def _panels(curves: Sequence[FunctionCurve]) -> dict[Place, list[FunctionCurve]]:
    """Return the curves of each panel, by row and column: a column per axis, displacements above
    rotations, then a row per function of location.
    """
    other_names = list(
        dict.fromkeys(curve.name for curve in curves if curve.name not in AXIS_ERRORS)
    )
    panels: dict[Place, list[FunctionCurve]] = {}
    for curve in curves:
        column = -1 if curve.axis is None else curve.axis
        if curve.name in AXIS_ERRORS:
            error = AXIS_ERRORS[curve.name]
            row = 3 * error.is_rotation + error.component
        else:
            row = 6 + other_names.index(curve.name)
            if curve.axis is not None and not _is_drawn(curve):
                continue
        panels.setdefault((row, column), []).append(curve)
    return panels


def _is_drawn(curve: FunctionCurve) -> bool:
    if not curve.line:
        return True
    _, _, levels_text = curve.line.partition(" at ")
    levels = {part.split()[-1] for part in levels_text.split(" and ")}
    return any(levels == {level} for level in DRAWN)


def _limits(curves: Sequence[FunctionCurve], k: float) -> dict[str, float]:
    """Return the largest values with their bands by unit, in millionths; 1 if undetermined."""
    limits: dict[str, float] = {}
    for curve in curves:
        ends = np.abs(curve.values) + k * curve.uncertainties
        determined = ends[np.isfinite(ends)]
        limits[curve.unit] = max(
            limits.get(curve.unit, 0.0), 1e6 * float(determined.max(initial=0.0))
        )
    return {unit: limit or 1.0 for unit, limit in limits.items()}


def _draw_panel(axes: Axes, curves: Sequence[FunctionCurve], k: float, limit: float) -> None:
    first, is_open = curves[0], all(curve.is_undetermined for curve in curves)
    along = f", along {AXIS_NAMES[first.axis]}" if first.line and first.axis is not None else ""
    axes.set_title(f"{first.name} {first.meaning}{along}", loc="left", fontsize=9.0, pad=4.0)
    if not is_open:
        axes.axhline(0.0, color=MUTED, linewidth=0.6)
        axes.grid(True)
    axes.margins(x=0.0)
    axes.set_ylim(-MARGIN * limit, MARGIN * limit)
    axes.tick_params(labelsize=8.5)
    for i, curve in enumerate(curves):
        x = (1.0 if curve.axis is None else 1e3) * curve.positions
        axes.set_xlim(x[0], x[-1])
        values, half = 1e6 * curve.values, 1e6 * k * curve.uncertainties
        colour = SERIES[i % len(SERIES)]
        axes.fill_between(x, values - half, values + half, color=colour, alpha=0.25, linewidth=0)
        axes.plot(x, values, color=colour, linestyle=DASHES[i % len(DASHES)], linewidth=1.3)
        for edge in (values - half, values + half):
            axes.plot(x, edge, color=colour, linewidth=0.5)
    if any(np.isnan(curve.uncertainties).any() for curve in curves):
        place, text = (
            ((0.5, 0.5), "undetermined") if is_open else ((0.5, 0.08), "undetermined in part")
        )
        label: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 9.0}
        label["bbox"] = {"facecolor": PAPER, "edgecolor": "none", "pad": 2.0}
        axes.text(*place, text, transform=axes.transAxes, **label)
    if is_open:
        axes.patch.set_hatch("///")
        axes.patch.set_edgecolor(MUTED)
        axes.patch.set_alpha(0.4)


def _angle(squareness: EstimatedNumber, k: float) -> str:
    if np.isnan(squareness.standard_uncertainty):
        return f"{squareness.name} {squareness.meaning}: undetermined"
    value = to_uncertainty(1e6 * squareness.value, 1e6 * squareness.standard_uncertainty)
    u = number(1e6 * k * squareness.standard_uncertainty, 3)
    return f"{squareness.name} {squareness.meaning}: {value.replace('-', '−')} µrad, U {u} µrad"
