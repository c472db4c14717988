"""Curves and dots over two axes as SVG within a page: small, sharp, and in the page's colours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.presentation import round_number
from ballplate.simulator.machines import Array

from .elements import Html, element, joined

# Of a chart and the room around what is drawn, in units of which a letter is about ten high.
WIDTH, HEIGHT = 360.0, 200.0
LEFT, RIGHT, ABOVE, BELOW = 46.0, 16.0, 10.0, 34.0
# Ticks along an axis, about.
TICKS = 4
# Letters of a name below an axis that is told.
LETTERS = 12


@dataclass(frozen=True, eq=False)
class Trace:
    """Values `y` (m,) over `x` (m,), possibly NaN: a line, dots, or a band up to `upper` (m,).
    `style` is a class of the page. `notes` are, for each dot, its text and the id of the element
    that it leads to, which may be empty.
    """

    kind: str
    style: str
    x: Array
    y: Array
    upper: Array | None = None
    notes: Sequence[tuple[str, str]] = ()


@dataclass(frozen=True, eq=False)
class Chart:
    """Traces over two axes. `places` are names along the first axis instead of numbers, each with
    its co-ordinate; `words` describe the chart for those who do not see it.
    """

    traces: Sequence[Trace]
    across: str
    up: str
    words: str
    places: Sequence[tuple[float, str]] = ()
    from_zero: bool = False
    height: float = HEIGHT
    width: float = WIDTH


def chart_svg(chart: Chart) -> Html:
    """The chart as an element of a page."""
    horizontal, vertical = _limits(chart)
    scale = _Scale(horizontal, vertical, chart.height, chart.width)
    parts = [*_grid(chart, scale), *(_trace(trace, scale) for trace in chart.traces)]
    return element(
        "svg",
        joined(parts),
        class_="chart" if chart.width == WIDTH else "chart full",
        viewBox=f"0 0 {chart.width:g} {chart.height:g}",
        role="img",
        aria_label=chart.words,
    )


@dataclass(frozen=True)
class _Scale:
    across: tuple[float, float]
    up: tuple[float, float]
    height: float
    width: float

    def x(self, values: Array) -> Array:
        low, high = self.across
        return np.asarray(LEFT + (values - low) / (high - low) * (self.width - LEFT - RIGHT))

    def y(self, values: Array) -> Array:
        low, high = self.up
        room = self.height - ABOVE - BELOW
        return np.asarray(ABOVE + (high - values) / (high - low) * room)


def _limits(chart: Chart) -> tuple[tuple[float, float], tuple[float, float]]:
    across = np.concatenate([trace.x for trace in chart.traces])
    up = np.concatenate(
        [part for trace in chart.traces for part in (trace.y, trace.upper) if part is not None]
    )
    ends = _ends(up)
    low = min(ends[0], 0.0) if chart.from_zero else ends[0]
    room = 0.06 * ((ends[1] - low) or abs(low) or 1.0)
    vertical = (0.0 if chart.from_zero and low >= 0.0 else low - room, ends[1] + room)
    where = np.array([x for x, _ in chart.places])
    low, high = _ends(where if chart.places else across)
    beside = 0.5 * ((high - low) / max(len(where) - 1, 1) or 1.0) if chart.places else 0.0
    return (low - beside, high + beside if high > low or beside else low + 1.0), vertical


def _ends(values: Array) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)


def ticks(low: float, high: float, count: int = TICKS) -> list[float]:
    """Return about `count` round values between two ends.

    >>> ticks(0.0, 1000.0), ticks(-1.2, 3.1)
    ([0.0, 200.0, 400.0, 600.0, 800.0, 1000.0], [-1.0, 0.0, 1.0, 2.0, 3.0])
    """
    step = round_number((high - low) / count)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(k * step, 12) + 0.0 for k in range(first, last + 1)]


def _grid(chart: Chart, scale: _Scale) -> list[Html]:
    """Lines, numbers and titles of both axes."""
    bottom = scale.height - BELOW
    lines, texts = [], []
    for value, y in zip(
        ticks(*scale.up), scale.y(np.array(ticks(*scale.up))).tolist(), strict=True
    ):
        kind = "zero" if value == 0.0 and scale.up[0] < 0.0 else "grid"
        lines.append(_path(f"M{LEFT:g} {y:.1f}H{scale.width - RIGHT:g}", kind))
        texts.append(_text(LEFT - 5, y + 3.5, f"{value:g}", "end"))
    if chart.places:
        for x, name in _shown_places(chart, scale):
            texts.append(_text(x, bottom + 13, name, "middle"))
    else:
        values = ticks(*scale.across)
        for value, x in zip(values, scale.x(np.array(values)).tolist(), strict=True):
            lines.append(_path(f"M{x:.1f} {ABOVE:g}V{bottom:g}", "grid"))
            texts.append(_text(x, bottom + 13, f"{value:g}", "middle"))
    texts.append(_text((LEFT + scale.width - RIGHT) / 2, bottom + 28, chart.across, "middle"))
    middle = ABOVE + (bottom - ABOVE) / 2
    turned = f"rotate(-90 11 {middle:g})"
    texts.append(element("text", chart.up, x=11, y=middle, text_anchor="middle", transform=turned))
    return [*lines, *texts]


def _shown_places(chart: Chart, scale: _Scale) -> list[tuple[float, str]]:
    """Return names along the axis if they fit, otherwise some of their numbers."""
    where = scale.x(np.array([x for x, _ in chart.places])).tolist()
    room = (scale.width - LEFT - RIGHT) / max(len(where), 1)
    longest = max(len(name) for _, name in chart.places)
    if 5.6 * min(longest, LETTERS) < room:
        most = max(LETTERS, int(room / 5.6))
        names = [name if len(name) <= most else f"{name[: most - 1]}…" for _, name in chart.places]
        return list(zip(where, names, strict=True))
    every = -(-24 // max(int(room), 1))
    return [(x, str(k + 1)) for k, x in enumerate(where) if k % every == 0]


def _trace(trace: Trace, scale: _Scale) -> Html:
    is_finite = np.isfinite(trace.x) & np.isfinite(trace.y)
    if trace.upper is not None:
        is_finite &= np.isfinite(trace.upper)
    x, y = np.round(scale.x(trace.x), 1).tolist(), np.round(scale.y(trace.y), 1).tolist()
    runs = _runs(is_finite)
    if trace.notes:
        dots = (_noted(x[k], y[k], trace.style, *trace.notes[k]) for run in runs for k in run)
        return joined(dots)
    if trace.kind == "dots":
        path = "".join(f"M{x[k]:g} {y[k]:g}h0" for run in runs for k in run)
    elif trace.upper is not None:
        top = np.round(scale.y(trace.upper), 1).tolist()
        back = (_line(x, top, run[::-1]).replace("M", "L") for run in runs)
        path = "".join(f"{_line(x, y, run)}{end}Z" for run, end in zip(runs, back, strict=True))
    else:
        path = "".join(_line(x, y, run) for run in runs)
    return _path(path, f"{trace.kind} {trace.style}")


def _noted(x: float, y: float, style: str, words: str, target: str) -> Html:
    """A dot with its text. Tables have the links for those who use no pointer."""
    dot = _path(f"M{x:g} {y:g}h0", f"dots noted {style}")
    href = f"#{target}" if target else None
    return element("a", element("title", words), dot, href=href, tabindex=-1)


def _runs(is_finite: np.ndarray) -> list[list[int]]:
    """Indices of neighbouring values that are known."""
    index = np.flatnonzero(is_finite)
    return [
        run.tolist() for run in np.split(index, np.flatnonzero(np.diff(index) > 1) + 1) if len(run)
    ]


def _line(x: Sequence[float], y: Sequence[float], run: Sequence[int]) -> str:
    return f"M{'L'.join(f'{x[k]:g} {y[k]:g}' for k in run)}"


def _path(d: str, kind: str) -> Html:
    return Html(f'<path class="{kind}" d="{d}"/>')


def _text(x: float, y: float, text: str, anchor: str) -> Html:
    return element("text", text, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor)


def figure(caption: str | Html, *content: str, class_: str = "") -> Html:
    """Content with words below it."""
    return element("figure", *content, element("figcaption", caption), class_=class_ or None)


def figures(*content: str) -> Html:
    """Return figures in a row if they fit."""
    return element("div", *content, class_="figures")


def legend(*entries: tuple[str, str, str]) -> Html:
    """Return the legend: sort and style of each mark, and its text."""
    marks = {"dots": "M9 6h0", "band": "M1 1H17V11H1Z"}
    items = []
    for kind, style, words in entries:
        mark = _path(marks.get(kind, "M1 6H17"), f"{kind} {style}")
        items.append(
            element("li", element("svg", mark, viewBox="0 0 18 12", aria_hidden="true"), words)
        )
    return element("ul", *items, class_="legend")
