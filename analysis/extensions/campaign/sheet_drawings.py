"""Drawings of a run sheet as SVG within a page: an artefact with its balls numbered, and the volume
with all positions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from ballplate.presentation import Box, DrawnPosition, escaped, on_paper, pitch, scene
from ballplate.simulator.design import Design
from ballplate.simulator.geometry import BallLayout
from ballplate.simulator.machines import Array

# Sizes in the drawings' own units, of which a page has about 700 from side to side.
PLATE, VOLUME, MARGIN = 340.0, 660.0, 34.0

# A name longer than this is replaced by a number.
LONGEST_NAME = 9

# Room for a ball with its name, in an artefact no larger than this.
ROOM, LARGEST = 42.0, 620.0

INK, GREY = "#222", "#777"


def artefact_drawing(name: str, layout: BallLayout, order: Sequence[int]) -> str:
    """Return an artefact viewed along its normal, with named balls and the path of the reading
    order.

    If balls are too close, only those at the corners and the first are named; numbers replace long
    names.
    """
    points = np.array(layout.coordinates)[:, :2]
    lower, size = points.min(axis=0), np.ptp(points, axis=0)
    across = float(size.max())
    # Of many balls, more room.
    wanted = ROOM * (across / pitch(points) + 1.0) if across else PLATE
    scale = (min(max(PLATE, wanted), LARGEST) - 2 * MARGIN) / (across or 1.0)
    width, height = scale * size + 2 * MARGIN
    drawn = on_paper(points, lower, scale, MARGIN, height)
    least = pitch(drawn) if across else PLATE
    is_long = max(map(len, layout.names)) > LONGEST_NAME
    names = [str(k) for k in range(1, len(points) + 1)] if is_long else layout.names
    longest = max(map(len, names))
    letter = min(11.0, 1.5 * least / max(longest, 2))
    named = set(range(len(points)))
    if letter < 5.5:
        letter, named = 9.0, {*map(int, layout.corner_set or ()), int(order[0]) if order else 0}
    radius = min(4.0, 0.2 * least)
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in drawn[list(order)])
    edge = min(0.62 * MARGIN, 0.6 * least)
    parts = [
        f'<svg class="artefact" viewBox="0 0 {width:.0f} {height + 16:.0f}"'
        f' style="width:{width:.0f}px" role="img" aria-label="{escaped(name)}: its balls and the'
        ' order of reading" font-family="sans-serif">',
        f'<rect x="{MARGIN - edge:.1f}" y="{MARGIN - edge:.1f}"'
        f' width="{width - 2 * (MARGIN - edge):.1f}" height="{height - 2 * (MARGIN - edge):.1f}"'
        f' rx="5" fill="none" stroke="{GREY}"/>',
        f'<polyline points="{path}" fill="none" stroke="#bbb"/>',
    ]
    for k, (x, y) in enumerate(drawn):
        fill = INK if order and k == order[0] else "white"
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{fill}" stroke="{INK}"/>'
        )
    parts += [
        _text(drawn[k, 0], drawn[k, 1] - radius - 2.5, names[k], letter) for k in sorted(named)
    ]
    parts.append(_text(width / 2, height + 4, "x of the artefact →", 10.0, GREY))
    x, y = 10.0, height / 2
    if size[1] > 0.0:
        turn = f' transform="rotate(-90 {x:.1f} {y:.1f})"'
        parts.append(_text(x, y, "y of the artefact →", 10.0, GREY, turn))
    return "".join([*parts, "</svg>"])


def volume_drawing(design: Design, names: Mapping[str, str]) -> str:
    """Return the machine's volume with all positions, seen from the front and above; `names` are
    their labels.
    """
    drawn = scene(design)
    ends = drawn.box.edges.reshape(-1, 2)
    every = np.concatenate([ends, *(place.outline for place in drawn.places)])
    lower, size = every.min(axis=0), np.ptp(every, axis=0)
    scale = min((VOLUME - 2 * MARGIN) / float(size[0]), 0.75 * VOLUME / (float(size[1]) or 1.0))
    width, height = scale * size + 2 * MARGIN

    def to_page(points: Array) -> Array:
        return on_paper(points, lower, scale, MARGIN, height)

    parts = [
        f'<svg class="volume" viewBox="0 0 {width:.0f} {height:.0f}"'
        f' style="width:{width:.0f}px" role="img"'
        ' aria-label="The volume of the machine with all positions" font-family="sans-serif">'
    ]
    for edge, is_hidden in zip(drawn.box.edges, drawn.box.hidden, strict=True):
        dashes = ' stroke-dasharray="3 4"' if is_hidden else ""
        parts.append(_line(to_page(edge), GREY, dashes))
    parts += [
        _position(place, to_page(place.outline), to_page(place.balls[:1])[0])
        for place in drawn.places
    ]
    parts += _axes(drawn.box, to_page)
    # No name covers the dot of a first ball.
    first_balls = [to_page(place.balls[:1])[0] for place in drawn.places]
    for place in sorted(drawn.places, key=lambda place: place.number):
        outline = to_page(place.outline)
        parts.append(_label(names[place.name], outline, first_balls))
    return "".join([*parts, "</svg>"])


def _position(place: DrawnPosition, outline: Array, first: Array) -> str:
    """The outline of a position, with a dot where its first ball is."""
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in outline)
    return (
        f'<polygon points="{points}" fill="{GREY}" fill-opacity="0.14" stroke="{GREY}"'
        ' stroke-width="1.6"/>'
        f'<circle cx="{first[0]:.1f}" cy="{first[1]:.1f}" r="4" fill="{INK}"/>'
    )


def _label(name: str, outline: Array, points: list[Array]) -> str:
    """A position's name at the corner, or middle of a side, that is furthest from other names."""
    centre = outline.mean(axis=0)
    places = np.concatenate([outline, 0.5 * (outline + np.roll(outline, 1, axis=0))])
    places = centre + 0.86 * (places - centre)
    apart = [
        min(
            (
                float(np.hypot(*((place - points_of_place) * [1.0, 2.0])))
                for points_of_place in points
            ),
            default=0.0,
        )
        for place in places
    ]
    x, y = places[int(np.argmax(apart))]
    points.append(np.array([x, y]))
    width = 7.4 * len(name) + 8.0
    return (
        f'<rect x="{x - width / 2:.1f}" y="{y - 9:.1f}" width="{width:.1f}" height="18" rx="3"'
        f' fill="white" fill-opacity="0.9" stroke="{GREY}"/>'
        + _text(x, y + 4.3, name, 12.0, INK, ' font-weight="bold"')
    )


def _axes(box: Box, to_page: object) -> list[str]:
    """Names of the axes with the co-ordinates of the volume's ends in millimetres."""
    assert callable(to_page)
    parts = []
    middle = to_page(box.edges.reshape(-1, 2)).mean(axis=0)
    for name, ends, low, high in box.axes:
        start, end = to_page(ends)
        along = (end - start) / (float(np.linalg.norm(end - start)) or 1.0)
        away = np.array([-along[1], along[0]])
        if away @ (0.5 * (start + end) - middle) < 0.0:
            away = -away
        tip = end + 14.0 * along
        wings = [np.stack([tip, tip - 6.0 * along + way * away]) for way in (-3.0, 3.0)]
        parts += [_line(line, GREY) for line in (np.stack([end, tip]), *wings)]
        for share, text in (
            (0.04, f"{1e3 * low:.5g}"),
            (0.5, f"{name}, mm"),
            (0.96, f"{1e3 * high:.5g}"),
        ):
            x, y = start + share * (end - start) + 15.0 * away
            parts.append(_text(x, y + 4.0, text, 11.0, INK if share == 0.5 else GREY))
    return parts


def _line(ends: Array, colour: str, more: str = "") -> str:
    (x1, y1), (x2, y2) = ends
    return (
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}"{more}/>'
    )


def _text(x: float, y: float, text: str, size: float, colour: str = INK, more: str = "") -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:.1f}" text-anchor="middle"'
        f' fill="{colour}" stroke="white" stroke-width="2.5" paint-order="stroke"{more}>'
        f"{escaped(text)}</text>"
    )
