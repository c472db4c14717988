"""Drawing of a run sheet as SVG within a page: the volume with all positions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from ballplate.presentation import escaped, on_paper, scene
from ballplate.simulator.design import Design
from ballplate.simulator.machines import Array

# Sizes in the drawing's own units, of which a page has about 700 from side to side.
VOLUME, MARGIN = 660.0, 34.0

INK, GREY = "#222", "#777"


def volume_drawing(design: Design, names: Mapping[str, str]) -> str:
    """Return the machine's volume with all positions, seen from the front and above; `names` are
    their labels.
    """
    box, places = scene(design)
    corners = box.edges.reshape(-1, 2)
    every = np.concatenate([corners, *(place.outline for place in places)])
    lower, size = every.min(axis=0), np.ptp(every, axis=0)
    scale = min((VOLUME - 2 * MARGIN) / float(size[0]), 0.75 * VOLUME / (float(size[1]) or 1.0))
    width, height = scale * size + 2 * MARGIN

    def to_page(points: Array) -> Array:
        return on_paper(points, lower, scale, MARGIN, height)

    parts = []
    for edge, is_hidden in zip(box.edges, box.hidden, strict=True):
        dashes = ' stroke-dasharray="3 4"' if is_hidden else ""
        parts.append(f'<polyline points="{_path(to_page(edge))}" stroke="{GREY}"{dashes}/>')
    for place in places:
        (x, y), outline = to_page(place.balls[:1])[0], _path(to_page(place.outline))
        parts.append(
            f'<polygon points="{outline}" fill="{GREY}" fill-opacity="0.14" stroke="{GREY}"/>'
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{INK}"/>'
        )
    middle = to_page(corners).mean(axis=0)
    for name, ends, low, high in box.axes:
        start, end = to_page(ends)
        away = np.array([start[1] - end[1], end[0] - start[0]])
        away *= 15.0 / (float(np.linalg.norm(away)) or 1.0)
        away *= 1.0 if away @ (0.5 * (start + end) - middle) >= 0.0 else -1.0
        for share, text in ((0.04, 1e3 * low), (0.5, f"{name}, mm"), (0.96, 1e3 * high)):
            label = text if isinstance(text, str) else f"{text:.5g}"
            parts.append(_text(start + share * (end - start) + away, label))
    for place in places:
        # From the first ball, which has a dot, a label is on the far side of the middle.
        centre, first = to_page(place.outline).mean(axis=0), to_page(place.balls[:1])[0]
        parts.append(_text(centre + 0.3 * (centre - first), names[place.name]))
    return (
        f'<svg class="volume" viewBox="0 0 {width:.0f} {height:.0f}"'
        f' style="width:{width:.0f}px" role="img"'
        ' aria-label="The volume of the machine with all positions" font-family="sans-serif"'
        f' font-size="12" fill="none">{"".join(parts)}</svg>'
    )


def _path(points: Array) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _text(point: Array, text: str) -> str:
    return (
        f'<text x="{point[0]:.1f}" y="{point[1] + 4.0:.1f}" text-anchor="middle" fill="{INK}"'
        f' stroke="white" stroke-width="2.5" paint-order="stroke">{escaped(text)}</text>'
    )
