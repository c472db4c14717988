"""Pictures of a design: plates in the volume with the balls that are read and styli."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from ballplate.presentation import MOST_BALLS, box_edges, hull, names_fit, projection, round_number
from ballplate.simulator.computing import svd
from ballplate.simulator.design import Design, locations, nominal_state
from ballplate.simulator.machines import Array, Integers

from .spatial import Layer, SpatialPicture

# Ways out of the volume from its axes, at right angles to them on paper.
OUT = np.array([[0.0, -0.5, -0.85], [0.7, 0.0, -0.7], [-0.9, -0.9, 0.0]])
# Of a drawn plate, as a part of the volume's size.
THICKNESS = 0.014


def volume_layers(lower: Array, upper: Array) -> list[Layer]:
    """The volume between two corners (d,) with the names of its axes, ticks in millimetres, and the
    origin.
    """
    d = len(lower)
    _, away = projection(d)
    edges, hidden = box_edges(lower, upper, away)
    size = float((upper - lower).max())
    strokes, places, names = [], [], []
    for k in range(d):
        # The edges that the eye of still pictures sees in front and at the left.
        start, along = lower.copy(), size * np.eye(d)[k]
        out = size * OUT[k] if d == 3 else along - size
        if k == 1 and d == 3:
            start[0] = upper[0]
        for value in _ticks(float(lower[k]), float(upper[k])):
            start[k] = value
            strokes += [start.copy(), start + 0.025 * out]
            # The zeros at one corner are one, and that of y is where the name of x is.
            if start.any() and (k != 1 or value != 0.0):
                places.append(start + 0.09 * out)
                names.append(f"{1e3 * value + 0.0:.6g}")
        start[k] = upper[k]
        tip = start + 0.12 * along
        strokes += [start, tip]
        for side in (-0.012, 0.012):
            strokes += [tip, tip - 0.03 * along + side * out]
        places.append(tip + (0.17 if d == 3 else 0.08) * along)
        names.append(f"{'xyz'[k]}, mm")
    origin = np.zeros((int((lower <= 0.0).all() and (upper >= 0.0).all()), d))
    places += list(origin - 0.04 * size)
    names += ["0"] * len(origin)
    visible, unseen = edges[~hidden].reshape(-1, d), edges[hidden].reshape(-1, d)
    return [
        Layer("lines", "faint thin dotted", unseen, (2,) * int(hidden.sum())),
        Layer("lines", "faint thin", visible, (2,) * int((~hidden).sum())),
        Layer("lines", "faint thin", np.array(strokes), (2,) * (len(strokes) // 2)),
        Layer("dots", "ink", origin),
        Layer("labels", "axes", np.array(places), names=tuple(names)),
    ]


def _ticks(low: float, high: float) -> list[float]:
    """Return both ends, and between them round numbers that are not too near to an end."""
    step = round_number(0.4 * (high - low))
    between = step * np.arange(np.ceil(low / step), np.ceil(high / step))
    is_apart = (between - low > 0.6 * step) & (high - between > 0.6 * step)
    return [low, *between[is_apart].tolist(), high]


def volume_view(design: Design) -> SpatialPicture:
    """Positions in the volume, the balls that are read, some of each position, and styli."""
    where = locations(design, nominal_state(design), design.readings)
    volume = design.machine.volume
    balls, styli, positions = [], [], []
    for k, name in enumerate(design.positions.names):
        mine = np.flatnonzero(design.readings.position == k)
        if not len(mine):
            continue
        read = where[mine]
        positions.append((name, read))
        balls.append(Layer("dots", "plate", read[_some(design.readings.ball[mine])]))
        middle = read[np.linalg.norm(read - read.mean(axis=0), axis=1).argmin()]
        offsets = design.probes.offsets[np.unique(design.readings.probe[mine])]
        styli += [np.stack([middle, middle - offset]) for offset in offsets if offset.any()]
    if styli:
        balls.append(Layer("lines", "ink fine", np.concatenate(styli), (2,) * len(styli)))
        balls.append(Layer("dots", "ink", np.stack([stylus[1] for stylus in styli])))
    words = f"{len(positions)} positions in the volume, which the run sheet lists"
    caption = (
        "Positions in the volume: balls that are read, and from one ball of each position the styli"
        " to the machine's reference point."
    )
    if not names_fit([name for name, _ in positions]):
        caption += " Positions are numbered as in the run sheet."
    if len(design.readings.ball) and max(_counts(design)) > MOST_BALLS:
        caption += " Only some of the balls are drawn."
    return plates_view(volume.lower, volume.upper, positions, words, caption, balls)


def plates_view(
    lower: Array,
    upper: Array,
    positions: Sequence[tuple[str, Array]],
    words: str,
    caption: str,
    more: Sequence[Layer] = (),
) -> SpatialPicture:
    """Return plates in the volume between two corners (d,) by the name of each position and points
    (k, d) at the edge of its plate, and `more` in front of them.
    """
    layers = volume_layers(lower, upper)
    (_, up), _ = projection(len(lower))
    thickness = THICKNESS * float((upper - lower).max())
    labels, names = [], [name for name, _ in positions]
    for _, points in positions:
        outline = _outline(points)
        if len(outline) > 2:
            layers.append(Layer("areas", "plate", outline, (len(outline),)))
        layers.append(_edges(outline, thickness))
        # Plates in a plane do not hide one another's middle.
        centre, top = outline.mean(axis=0), outline[(outline @ up).argmax()]
        labels.append(centre if len(lower) == 2 else top + 0.12 * (top - centre))
    shown = names if names_fit(names) else [str(k + 1) for k in range(len(names))]
    layers += [*more, Layer("labels", "names", np.array(labels), names=tuple(shown))]
    return SpatialPicture(layers, words, caption)


def _edges(outline: Array, thickness: float) -> Layer:
    """The edges of a plate around an outline (k, d); in a plane, or of a bar, the outline."""
    closed = np.concatenate([outline, outline[:1]])
    if closed.shape[1] == 2 or len(outline) < 3:
        return Layer("lines", "plate thin", closed, (len(closed),))
    normal = np.cross(outline[1] - outline[0], outline[2] - outline[0])
    half = 0.5 * thickness * normal / np.linalg.norm(normal)
    across = np.stack([outline - half, outline + half], axis=1).reshape(-1, 3)
    sizes = (len(closed), len(closed), *(2,) * len(outline))
    return Layer(
        "lines", "plate thin", np.concatenate([closed - half, closed + half, across]), sizes
    )


def _outline(points: Array) -> Array:
    """Corners (k, d) of points' convex hull in the plane that they are closest to, the lowest along
    x first.
    """
    centre = points.mean(axis=0)
    _, _, axes = svd(points - centre, full_matrices=False)
    plane = axes[:2]
    corners = hull((points - centre) @ plane.T) if len(points) > 1 else np.zeros((1, len(plane)))
    outline = centre + corners @ plane[: corners.shape[1]]
    # Rounding decides where the hull begins, and which side of the plane is seen.
    rounded, count = np.round(outline, 9).tolist(), len(outline)
    first = rounded.index(min(rounded))
    step = 1 if rounded[(first + 1) % count] <= rounded[first - 1] else -1
    return outline[(first + step * np.arange(count)) % count]


def _some(balls: Integers) -> Integers:
    """Return locations of each ball's first reading, or of a selection of balls."""
    _, first = np.unique(balls, return_index=True)
    return first[:: -(-len(first) // MOST_BALLS) or 1]


def _counts(design: Design) -> Sequence[int]:
    """Return the number of balls read in each position."""
    pairs = np.stack([design.readings.position, design.readings.ball], axis=1)
    counts: list[int] = np.unique(np.unique(pairs, axis=0)[:, 0], return_counts=True)[1].tolist()
    return counts
