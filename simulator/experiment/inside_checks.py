"""Checks that readings and points lie within the volume."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from ballplate.simulator.design.lookup import References
from ballplate.simulator.design.objects import SLIGHTLY, Volume
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.geometry.positions import ball_coordinates
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.problems import Problems
from ballplate.simulator.inputs.quantity_words import format_length
from ballplate.simulator.inputs.settings import number_of
from ballplate.simulator.inputs.yamltree import Mark

from .model import Position, Probe

TOLERANCE = 1e-9


def check_inside(
    position: Position,
    steps: Steps,
    volume: Volume,
    probes: Mapping[str, Probe],
    references: References,
) -> None:
    """Report readings with scale readings outside the measuring volume.

    Error models are functions of the scale readings, where the ball is less the probe's offset.
    Balls may be outside, and scale readings by a thousandth of the volume.
    """
    layout = references.layouts[position.artefact]
    rows = [
        (group.ball_indices, probe, probes[probe].offset)
        for group in position.readings
        for probe in group.probes
        if probe in probes and probes[probe].offset.shape == volume.lower.shape
    ]
    if not rows:
        return
    places = ball_coordinates(position.pose, layout)
    balls = np.concatenate([indices for indices, _, _ in rows])
    by_how_much, axes, sides = excess(
        np.concatenate([places[reading] - offset for reading, _, offset in rows]), volume
    )
    outside = np.flatnonzero(by_how_much > SLIGHTLY * (volume.upper - volume.lower)[axes])
    if len(outside) == 0:
        return
    # The first of those furthest outside, whatever rounding makes of equal ones.
    worst = int(outside[np.argmax(by_how_much[outside] > by_how_much.max() - TOLERANCE)])
    axis, probe = int(axes[worst]), [probe for indices, probe, _ in rows for _ in indices][worst]
    offset, place = float(probes[probe].offset[axis]), float(places[balls[worst], axis])
    others_text = f", and {number_of(len(outside) - 1, 'more reading')}" if len(outside) > 1 else ""
    less = (
        f" (the ball at {format_length(place)} less the offset of {format_length(offset)})"
        if offset
        else ""
    )
    remedy = "move the artefact"
    if AXIS_NAMES[axis] in position.parts:
        remedy = f"there is no room along {AXIS_NAMES[axis]}: take a smaller artefact"
    text = (
        f'reading ball "{layout.names[balls[worst]]}" with probe "{probe}" moves the scales to'
        f" {AXIS_NAMES[axis]} = {format_length(place - offset)}{less},"
        f" {format_length(by_how_much[worst])} {sides[worst]} the measuring volume{others_text};"
        f" {remedy}, or read it otherwise"
    )
    references.problems.add(steps, text)


def excess(points: Array, volume: Volume) -> tuple[Array, Array, list[str]]:
    """Return how far points (n, d) are outside the volume, along which axis, and on which side."""
    below, above = volume.lower - points, points - volume.upper
    by_axis = np.maximum(below, above)
    axes = np.argmax(by_axis, axis=1)
    rows = np.arange(len(points))
    sides = ["below" if is_below else "above" for is_below in below[rows, axes] > above[rows, axes]]
    return by_axis[rows, axes], axes, sides


def check_points(
    points: Array,
    steps: Steps,
    volume: Volume,
    problems: Problems,
    marks: Sequence[Mark] | None = None,
    of_one: bool = False,
) -> None:
    """Report points outside the volume: listed ones one by one, of a table (with ``marks``) the
    first.

    ``of_one``: the path is that of a single point, not of a list.
    """
    by_how_much, axes, sides = excess(points, volume)
    outside = np.flatnonzero(by_how_much > TOLERANCE)
    for i in outside if marks is None else outside[:1]:
        axis = int(axes[i])
        others_text = (
            f", as {len(outside) - 1} further points are"
            if marks is not None and len(outside) > 1
            else ""
        )
        text = (
            f"{AXIS_NAMES[axis]} = {format_length(points[i, axis])} is"
            f" {format_length(by_how_much[i])} {sides[i]} the measuring volume{others_text};"
            " move the point inside"
        )
        if marks is None:
            problems.add(steps if of_one else (*steps, int(i)), text)
        else:
            problems.add_at(marks[int(i)], steps, text)
