"""SVG drawing of the location of an artefact in the volume, for a page."""

from __future__ import annotations

import numpy as np
from ballplate.presentation import escaped
from ballplate.simulator.experiment import Candidate, Experiment, Position
from ballplate.simulator.geometry import AXIS_INDEX, ball_coordinates

SIZE, MARGIN = 170.0, 22.0
# A name longer than this is told by a number instead.
LONGEST_NAME = 9
# Of more balls only those at the corners are drawn.
MOST_BALLS = 400
# Axis across the drawing, whether it runs to the left, and axis upwards, as seen from the end of
# the normal.
VIEWS = {"x": ("y", False, "z"), "y": ("x", True, "z"), "z": ("x", False, "y")}


# In one piece: elements of one drawing, which share its scale and margins.
def place_drawing(candidate: Candidate, experiment: Experiment) -> str:
    """Return a position viewed along its plane's normal: volume and balls, filled if read, the
    first named.

    For an artefact in a free pose the view is along its thinnest axis.
    """
    position = candidate.item
    assert isinstance(position, Position)
    layout = experiment.layouts[position.artefact]
    balls = ball_coordinates(position.pose, layout)
    d = experiment.dimension
    plane = candidate.plane or ("z" if d == 2 else "xyz"[int(np.ptp(balls, axis=0).argmin())])
    across, to_left, up = VIEWS[plane]
    columns = [AXIS_INDEX[across], AXIS_INDEX[up]]
    lower, upper = (
        experiment.machine.volume.lower[columns],
        experiment.machine.volume.upper[columns],
    )
    scale = (SIZE - 2 * MARGIN) / float((upper - lower).max())
    width, height = scale * (upper - lower)
    left, top = (SIZE - width) / 2, (SIZE - height) / 2
    points = (balls[:, columns] - lower) * scale
    if to_left:
        points[:, 0] = width - points[:, 0]
    points = np.column_stack([left + points[:, 0], top + height - points[:, 1]])
    is_read = np.isin(np.arange(len(points)), position.balls)
    shown = (
        np.arange(len(points)) if len(points) <= MOST_BALLS else np.array(layout.corner_set or (0,))
    )
    first, second = (points[0], points[1]) if len(points) > 1 else (points[0], points[0])
    # The name goes where there are no balls, and where it is outside the volume other words make
    # room for it.
    y = first[1] + (13 if first[1] >= points[:, 1].mean() else -7)
    above, below = (11 if y < top + 4 else 0), (11 if y > top + height else 0)
    name = layout.names[0] if len(layout.names[0]) <= LONGEST_NAME else "1"
    parts = [
        (
            f'<svg viewBox="0 {top - 18 - above:.1f} {SIZE:g} {height + 38 + above + below:.1f}"'
            f' role="img" aria-label="{escaped(candidate.name)}" font-family="sans-serif"'
            ' font-size="10">'
        ),
        (
            f'<rect x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{height:.1f}"'
            ' fill="none" stroke="#999"/>'
        ),
        (
            f'<line x1="{first[0]:.1f}" y1="{first[1]:.1f}" x2="{second[0]:.1f}"'
            f' y2="{second[1]:.1f}" stroke="#222"/>'
        ),
    ]
    for i in shown:
        fill = "#222" if is_read[i] else "white"
        radius = 3.2 if i == 0 else 1.8
        parts.append(
            f'<circle cx="{points[i, 0]:.1f}" cy="{points[i, 1]:.1f}" r="{radius}" fill="{fill}"'
            ' stroke="#222"/>'
        )
    label = f'<text x="{first[0]:.1f}" y="{y:.1f}" text-anchor="middle" fill="#222"'
    parts.append(
        f'{label} stroke="white" stroke-width="3" paint-order="stroke">{escaped(name)}</text>'
    )
    arrow = f"← {across}" if to_left else f"{across} →"
    parts.append(
        f'<text x="{SIZE / 2:g}" y="{top + height + 13 + below:.1f}" text-anchor="middle"'
        f' fill="#555">{arrow}</text>'
    )
    x, y = left - 6, top + height / 2
    parts.append(
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="middle" fill="#555" transform="rotate(-90'
        f' {x:.1f} {y:.1f})">{up} →</text>'
    )
    view = f"seen from +{plane}" if d == 3 else "seen from above"
    parts.append(
        f'<text x="{SIZE / 2:g}" y="{top - 6 - above:.1f}" text-anchor="middle"'
        f' fill="#555">{view}</text></svg>'
    )
    return "".join(parts)
