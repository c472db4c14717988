"""Pictures of a design in the page of a sweep, as elements of it: positions, tips, error map."""

from __future__ import annotations

import io
import re
from html import escape
from typing import TYPE_CHECKING

import numpy as np
from ballplate.presentation import (
    INK,
    MUTED,
    PAPER,
    SERIES,
    WIDTH,
    Scene,
    blank_axes,
    drawing,
    number,
    placed_axes,
    scene_figure,
)
from ballplate.simulator.machines import Array

from ..error_map_uncertainty import ErrorMap, Slice

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Points around a map.
LEFT, RIGHT, BELOW, ABOVE = 50.0, 18.0, 40.0, 10.0

# Variables of the page for the colours that stand in for them.
COLOURS = {INK: "--ink", MUTED: "--muted", PAPER: "--paper"} | {
    colour: f"--series-{k}" for k, colour in enumerate(SERIES)
}

# Bands between lines of the error map at most, from the first of these colours to the second: light
# enough for dark letters everywhere.
MOST_BANDS = 10

LIGHT = ("#f6f9fc", "#79a4cb")

DARK = "#101010"


def as_svg(figure: Figure, name: str, words: str) -> str:
    """The figure as an element of a page, with `name` in front of its ids and a text for those who
    do not see it.
    """
    found = io.StringIO()
    figure.savefig(
        found,
        format="svg",
        transparent=True,
        metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")),
    )
    body = found.getvalue()
    body = body[body.index("<svg") :]
    size = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', body)
    assert size is not None
    inner = body[body.index(">") + 1 :]
    inner = re.sub(r"<metadata>.*?</metadata>", "", inner, flags=re.DOTALL)
    inner = re.sub(r"<!--.*?-->\s*", "", inner, flags=re.DOTALL)
    # A style inside would hold for the whole page, which has it in its own.
    inner = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", inner, flags=re.DOTALL)
    # Groups that nothing refers to need no id.
    used = set(re.findall(r'(?:xlink:href="#|url\(#)([^")]+)', inner))
    inner = re.sub(
        r' id="([^"]+)"', lambda m: f' id="{name}-{m[1]}"' if m[1] in used else "", inner
    )
    inner = re.sub(r'xlink:href="#([^"]+)"', rf'href="#{name}-\1"', inner)
    inner = re.sub(r"url\(#([^)]+)\)", rf"url(#{name}-\1)", inner)
    for colour, variable in COLOURS.items():
        inner = inner.replace(colour, f"var({variable})")
    inner = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font: \1px sans-serif", inner)
    inner = re.sub(r"\n\s*", "\n", inner)
    start = (
        f'<svg viewBox="0 0 {size[1]} {size[2]}" role="img"'
        f' aria-label="{escape(words, quote=True)}">'
    )
    return start + inner.strip()


def scene_svg(drawn: Scene, name: str, words: str) -> str:
    """The volume with the positions in it."""
    with scene_figure(drawn) as figure:
        return as_svg(figure, name, words)


def probes_svg(drawn: Scene, name: str, words: str) -> str:
    """The tips about the reference point, enlarged."""
    with drawing(200.0) as figure:
        axes = blank_axes(figure)
        size = max(float(np.abs(tip).max()) for _, tip in drawn.tips) or 1.0
        axes.plot(0.0, 0.0, color=INK, marker="s", markersize=6.0)
        groups: list[tuple[Array, list[str]]] = []
        for probe, tip in drawn.tips:
            same = next(
                (names for at, names in groups if np.abs(at - tip).max() < 0.02 * size), None
            )
            if same is None:
                groups.append((tip, [probe]))
            else:
                same.append(probe)
        for tip, names in groups:
            axes.plot([0.0, tip[0]], [0.0, tip[1]], color=INK, linewidth=1.4)
            axes.plot(*tip, color=INK, marker="o", markersize=8.0, markerfacecolor=PAPER)
            away = tip / np.linalg.norm(tip) if np.linalg.norm(tip) > 0 else np.array([0.0, 1.0])
            side = "left" if away[0] > 0.3 else "right" if away[0] < -0.3 else "center"
            height = "bottom" if away[1] > 0.5 else "top" if away[1] < -0.5 else "center"
            text = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
            axes.annotate(
                text,
                (tip[0], tip[1]),
                (9.0 * away[0], 9.0 * away[1]),
                textcoords="offset points",
                ha=side,
                va=height,
            )
        axes.set_xlim(-2.2 * size, 2.2 * size)
        axes.set_ylim(-1.5 * size, 1.3 * size)
        return as_svg(figure, name, words)


def slice_svg(drawn: ErrorMap, one: Slice, name: str, words: str) -> str:
    """A level of the error map: shades with the same limits in all levels, and lines with their
    values.
    """
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.ticker import MaxNLocator

    values = 1e6 * one.values
    every = 1e6 * np.concatenate([level.values.ravel() for level in drawn.slices])
    every = every[np.isfinite(every)]
    low, high = (float(every.min()), float(every.max())) if len(every) else (0.0, 1.0)
    levels = MaxNLocator(nbins=MOST_BANDS, steps=[1, 2, 2.5, 5, 10]).tick_values(
        low, max(high, low + 1e-9)
    )
    span = np.array([np.ptp(drawn.x), np.ptp(drawn.y)])
    width = WIDTH - LEFT - RIGHT
    height = min(max(width * float(span[1] / span[0]), 150.0), 450.0)
    with drawing(height + BELOW + ABOVE) as figure:
        axes = placed_axes(figure, LEFT, BELOW, width, height)
        axes.set_aspect("equal")
        axes.set_xlabel("x, mm")
        axes.set_ylabel("y, mm")
        x, y = 1e3 * drawn.x, 1e3 * drawn.y
        axes.set_xlim(x[0], x[-1])
        axes.set_ylim(y[0], y[-1])
        hatched = np.isnan(values)
        if hatched.any():
            axes.contourf(
                x, y, hatched.astype(float), levels=[0.5, 1.5], colors="none", hatches=["///"]
            )
        if not hatched.all():
            colours = LinearSegmentedColormap.from_list("light", LIGHT)(
                np.linspace(0.0, 1.0, len(levels) - 1)
            )
            axes.contourf(x, y, np.ma.masked_invalid(values), levels=levels, colors=colours)
            if ((np.nanmin(values) < levels) & (levels < np.nanmax(values))).any():
                lines = axes.contour(
                    x, y, np.ma.masked_invalid(values), levels=levels, colors=DARK, linewidths=0.8
                )
                axes.clabel(lines, fmt=lambda value: f"{value:.3g}", fontsize=9.5, colors=DARK)
        return as_svg(figure, name, words)


def slice_words(drawn: Slice) -> str:
    """A level of the error map for those who do not see it."""
    known = drawn.values[np.isfinite(drawn.values)]
    at = ""
    if drawn.level is not None:
        at = f"{drawn.name} level, z {1e3 * drawn.level + 0.0:.6g} mm: "
    if not len(known):
        return f"{at}the error map is undetermined everywhere"
    told = f"{at}{number(1e6 * known.min(), 3)} to {number(1e6 * known.max(), 3)} µm"
    left = 1.0 - len(known) / drawn.values.size
    return told + (f"; undetermined at {number(100 * left, 3)} % of the points" if left else "")
