"""Maps of values over x and y as SVG within a page: a shaded cell with its value per point."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from ballplate.presentation import number

from .elements import Html, element, joined

# Upper bounds of the bands of a map of shares of lengths that miss their target; the first holds
# those that miss none. The studio draws the same.
MISSED = (0.0, 0.05, 0.1, 0.25, 0.5, 0.75)
# Of a map: width of a cell, its height, and the room around.
CELL, ROW, LEFT, BELOW, ABOVE = 46.0, 26.0, 46.0, 32.0, 18.0


@dataclass(frozen=True)
class MapPoint:
    """A point by x and y in metres with its value, None if undetermined, and the attributes of its
    text.
    """

    x: float
    y: float
    value: float | None
    attributes: Mapping[str, str] = field(default_factory=dict)


def level_map(
    points: Iterable[MapPoint], bounds: Sequence[float], words: str, digits: int = 3
) -> Html:
    """Return the map of points on a grid, shaded by bands with these upper bounds, the last band
    without one.
    """
    points = list(points)
    x, y = np.unique([point.x for point in points]), np.unique([point.y for point in points])
    parts = []
    for point in points:
        column, row = np.searchsorted(x, point.x), len(y) - 1 - np.searchsorted(y, point.y)
        left_edge, top = LEFT + CELL * column, ABOVE + ROW * row
        kind = "open" if point.value is None else f"band-{_band(point.value, bounds)}"
        parts.append(
            Html(
                f'<rect class="{kind}" x="{left_edge:g}" y="{top:g}" width="{CELL:g}"'
                f' height="{ROW:g}"/>'
            )
        )
        parts.append(
            element(
                "text",
                "–" if point.value is None else number(point.value, digits),
                class_=None if point.value is None else f"place on-{kind}",
                x=f"{left_edge + CELL / 2:g}",
                y=f"{top + ROW / 2 + 3.5:g}",
                text_anchor="middle",
                **point.attributes,
            )
        )
    bottom = ABOVE + ROW * len(y)
    for k, value in enumerate(x.tolist()):
        parts.append(_label(LEFT + CELL * (k + 0.5), bottom + 12, f"{1e3 * value:.5g}", "middle"))
    for k, value in enumerate(y.tolist()):
        parts.append(_label(LEFT - 5, bottom - ROW * (k + 0.5) + 3.5, f"{1e3 * value:.5g}", "end"))
    parts += [
        _label(LEFT + CELL * len(x) / 2, bottom + 26, "x, mm", "middle"),
        _label(LEFT - 5, ABOVE - 6, "y, mm", "end"),
    ]
    return element(
        "svg",
        joined(parts),
        class_="map",
        viewBox=f"0 0 {LEFT + CELL * len(x) + 6:g} {bottom + BELOW:g}",
        role="img",
        aria_label=words,
    )


def even_bounds(low: float, high: float) -> tuple[float, ...]:
    """Return the upper bounds of equal bands between two ends, the last one left out.

    >>> even_bounds(0.0, 7.0)
    (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    """
    return tuple(np.linspace(low, high, len(MISSED) + 2)[1:-1].tolist())


def level_legend(bounds: Sequence[float], shown: Callable[[float], str]) -> Html:
    """Return the legend of a map, made of the bounds of its bands as `shown`."""
    texts = [shown(bound) for bound in bounds]
    words = [f"up to {text}" for text in texts] + [f"more than {texts[-1]}"]
    words[0] = texts[0] if bounds[0] == 0.0 else words[0]
    items = [
        element("li", element("span", class_=f"swatch band-{k}", aria_hidden="true"), text)
        for k, text in enumerate(words)
    ]
    return element("ul", *items, class_="legend bands")


def _band(value: float, bounds: Sequence[float]) -> int:
    """Return the band of a value; one on a bound, but for rounding, is below it.

    >>> [_band(share, MISSED) for share in (0.0, 0.01, 0.1, 0.9)]
    [0, 1, 2, 6]
    """
    return int(np.searchsorted(bounds, value * (1.0 - 1e-9)))


def _label(x: float, y: float, text: str, anchor: str) -> Html:
    return element("text", text, x=f"{x:g}", y=f"{y:g}", text_anchor=anchor)
