"""Maps of values over x and y as SVG within a page: a shaded cell with its value per point."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from ballplate.presentation import number

from .elements import Html, element, joined

SHADES = 8
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
    points: Iterable[MapPoint], ends: tuple[float, float], words: str, limit: float = np.inf
) -> Html:
    """Return the map of points on a grid, shaded between the `ends` of all levels; above a limit
    in another colour.
    """
    points = list(points)
    x, y = np.unique([point.x for point in points]), np.unique([point.y for point in points])
    parts = []
    for point in points:
        column, row = np.searchsorted(x, point.x), len(y) - 1 - np.searchsorted(y, point.y)
        left_edge, top = LEFT + CELL * column, ABOVE + ROW * row
        kind = "open" if point.value is None else _shade(point.value, *ends, limit)
        parts.append(
            Html(
                f'<rect class="{kind}" x="{left_edge:g}" y="{top:g}" width="{CELL:g}"'
                f' height="{ROW:g}"/>'
            )
        )
        parts.append(
            element(
                "text",
                "–" if point.value is None else number(point.value, 3),
                class_=None if point.value is None else "place",
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


def _shade(value: float, low: float, high: float, limit: float) -> str:
    """A step of colour among values from `low` to `high`; above a limit, one of another colour.

    >>> [_shade(value, 0.2, 3.0, 1.0) for value in (0.2, 1.0, 1.1, 3.0)]
    ['heat-0', 'heat-7', 'over-0', 'over-7']
    """
    is_over = value > limit
    first, last = (max(low, limit), high) if is_over else (low, min(high, limit))
    # Equal values but for rounding have no order to show.
    share = (value - first) / (last - first) if last - first > 1e-9 * last else 0.0
    name = "over" if is_over else "heat"
    return f"{name}-{min(int(SHADES * (share + 1e-9)), SHADES - 1)}"


def _label(x: float, y: float, text: str, anchor: str) -> Html:
    return element("text", text, x=f"{x:g}", y=f"{y:g}", text_anchor=anchor)
