"""Pictures of a design as elements of a sweep's page: positions, error map."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING

import numpy as np
from ballplate.extensions.pages.elements import Html, element
from ballplate.presentation import (
    INK,
    MUTED,
    PAPER,
    SERIES,
    WIDTH,
    Scene,
    drawing,
    number,
    placed_axes,
    scene_figure,
)

from ..error_map_uncertainty import ErrorMap, Slice

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Points around a map.
LEFT, RIGHT, BELOW, ABOVE = 50.0, 18.0, 40.0, 10.0

# Variables of the page by the colours in pictures.
COLOURS = {INK: "--ink", MUTED: "--muted", PAPER: "--paper"} | {
    colour: f"--series-{k}" for k, colour in enumerate(SERIES)
}

# Bands between lines of the error map at most, from the first of these colours to the second: light
# enough for dark letters everywhere.
MOST_BANDS = 10

LIGHT = ("#f6f2fa", "#a58cc7")

DARK = "#101010"


def as_svg(figure: Figure, name: str, words: str) -> Html:
    """Return the figure as an element of a page, with `name` before its ids, and an accessible
    text.
    """
    stream = io.StringIO()
    figure.savefig(
        stream,
        format="svg",
        transparent=True,
        metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")),
    )
    body = stream.getvalue()
    body = body[body.index("<svg") :]
    size = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', body)
    assert size is not None
    inner = body[body.index(">") + 1 : body.rindex("</svg>")]
    inner = re.sub(r"<metadata>.*?</metadata>", "", inner, flags=re.DOTALL)
    inner = re.sub(r"<!--.*?-->\s*", "", inner, flags=re.DOTALL)
    # A style inside would apply to the whole page.
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
    box = f"0 0 {size[1]} {size[2]}"
    return element("svg", Html(inner.strip()), viewBox=box, role="img", aria_label=words)


def scene_svg(drawn: Scene, name: str, words: str) -> Html:
    """Return the volume with its positions."""
    with scene_figure(drawn) as figure:
        return as_svg(figure, name, words)


def slice_svg(drawn: ErrorMap, drawn_slice: Slice, name: str, words: str) -> Html:
    """Return a level of the error map: shades with common limits in all levels, and contour
    lines.
    """
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.ticker import MaxNLocator

    values = 1e6 * drawn_slice.values
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
    """Return an accessible text on a level of the error map."""
    determined = drawn.values[np.isfinite(drawn.values)]
    level = ""
    if drawn.level is not None:
        level = f"{drawn.name} level, z {1e3 * drawn.level + 0.0:.6g} mm: "
    if not len(determined):
        return f"{level}the error map is undetermined everywhere"
    text = f"{level}{number(1e6 * determined.min(), 3)} to {number(1e6 * determined.max(), 3)} µm"
    undetermined_share = 1.0 - len(determined) / drawn.values.size
    return text + (
        f"; undetermined at {number(100 * undetermined_share, 3)} % of the points"
        if undetermined_share
        else ""
    )
