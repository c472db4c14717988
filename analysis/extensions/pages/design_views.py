"""Pictures in space of a design: plates in the volume, uncertainties of points and balls, and what
undetermined directions move.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from ballplate.presentation import MOST_BALLS, box_edges, hull, names_fit, projection, round_number
from ballplate.simulator.computing import eigh, svd
from ballplate.simulator.design import Design, locations, nominal_state
from ballplate.simulator.estimation import Linearisation, correction_rows
from ballplate.simulator.machines import Array, Integers

from .elements import Html, element, joined
from .motions import Motion, moved_balls, moved_points
from .spatial import Layer, SpatialPicture

# Of the picture's size: the longest half axis of an ellipsoid, and the largest displacement.
LONGEST_AXIS, LARGEST_MOTION = 0.05, 0.09
# What moves no point by more, in metres, moves none: a direction moves something by 1e-6.
NO_MOTION = 1e-12
# Balls in moving pictures, of all positions together, and points along a line of the grid.
MOST_MOVING, ALONG = 600, 9
# Ways out of the volume from its axes, at right angles to them on paper.
OUT = np.array([[0.0, -0.5, -0.85], [0.7, 0.0, -0.7], [-0.9, -0.9, 0.0]])
# Of a drawn plate, as a part of the volume's size.
THICKNESS = 0.014


def volume_layers(design: Design) -> list[Layer]:
    """The volume with the names of its axes, ticks in millimetres, and the origin."""
    lower, upper = design.machine.volume.lower, design.machine.volume.upper
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


def volume_view(design: Design, most: int = MOST_BALLS) -> SpatialPicture:
    """Positions in the volume, the balls that are read, `most` of each position, and styli."""
    where = locations(design, nominal_state(design), design.readings)
    layers = volume_layers(design)
    (_, up), _ = projection(design.dimension)
    thickness = THICKNESS * float(design.machine.volume.size.max())
    labels, names, styli = [], [], []
    positions_read = [
        k for k in range(len(design.positions.names)) if (design.readings.position == k).any()
    ]
    position_names = [design.positions.names[k] for k in positions_read]
    is_named = names_fit(position_names)
    for number, k in enumerate(positions_read):
        mine = np.flatnonzero(design.readings.position == k)
        balls = where[mine]
        outline = _outline(balls)
        if len(outline) > 2:
            layers.append(Layer("areas", "plate", outline, (len(outline),)))
        layers.append(_edges(outline, thickness))
        layers.append(Layer("dots", "plate", balls[_some(design.readings.ball[mine], most)]))
        middle = balls[np.linalg.norm(balls - balls.mean(axis=0), axis=1).argmin()]
        offsets = design.probes.offsets[np.unique(design.readings.probe[mine])]
        styli += [np.stack([middle, middle - offset]) for offset in offsets if offset.any()]
        # Plates in a plane do not hide one another's middle.
        centre, top = outline.mean(axis=0), outline[(outline @ up).argmax()]
        labels.append(centre if design.dimension == 2 else top + 0.12 * (top - centre))
        names.append(position_names[number] if is_named else str(number + 1))
    if styli:
        layers.append(Layer("lines", "ink fine", np.concatenate(styli), (2,) * len(styli)))
        layers.append(Layer("dots", "ink", np.stack([stylus[1] for stylus in styli])))
    layers.append(Layer("labels", "names", np.array(labels), names=tuple(names)))
    words = f"{len(positions_read)} positions in the volume, which the run sheet lists"
    caption = (
        "Positions in the volume: balls that are read, and from one ball of each position the styli"
        " to the machine's reference point."
    )
    if not is_named:
        caption += " Positions are numbered as in the run sheet."
    if len(design.readings.ball) and max(_counts(design)) > most:
        caption += " Only some of the balls are drawn."
    whole = joined([caption, turning_words(design)])
    return SpatialPicture(layers, "volume-view", "positions", words, whole)


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


def turning_words(design: Design) -> Html:
    """Return instructions for turning a picture on screens."""
    if design.dimension == 2:
        return Html()
    words = " Drag it, or press arrow keys while it has the focus, to turn it."
    return element("span", words, class_="turning")


def point_view(linearisation: Linearisation, factor: float, sigma: float = 1.0) -> SpatialPicture:
    """Ellipsoids of the corrected evaluation points, enlarged, with their expanded uncertainties
    as half axes.
    """
    design, evaluation = linearisation.design, linearisation.design.evaluation
    probes = np.full(len(evaluation.points), evaluation.probe)
    rows = correction_rows(
        design, linearisation.layout, linearisation.state, evaluation.points, probes
    )
    open_ = np.isnan(linearisation.of_shared(rows.reshape(-1, rows.shape[2]))).reshape(
        rows.shape[:2]
    )
    is_determined = ~open_.any(axis=1)
    layers = volume_layers(design)
    points = evaluation.points[is_determined]
    spread = factor * sigma * (rows[is_determined] @ linearisation.shared)
    size = float(
        np.ptp(np.stack([design.machine.volume.lower, design.machine.volume.upper]), axis=0).max()
    )
    names = "point-view", "points", "Corrected evaluation points"
    return _ellipsoids(
        layers, points, spread, evaluation.points[~is_determined], size, names, factor
    )


def ball_views(
    linearisation: Linearisation, factor: float, sigma: float = 1.0
) -> Iterator[SpatialPicture]:
    """Return ellipsoids of each plate's balls in the plate's frame."""
    design = linearisation.design
    of_balls = linearisation.of_balls()
    spread = np.concatenate([linearisation.balls.common, linearisation.balls.own], axis=2)
    for number, artefact in enumerate(design.artefacts.plates):
        members = np.asarray(design.balls.of(artefact))
        determined = members[~np.isnan(of_balls[members]).any(axis=1)]
        places = design.balls.places
        size = float(np.ptp(places[members], axis=0).max(initial=0.0)) or 0.1
        outline = _outline(places[members])
        layers = [
            Layer(
                "lines", "faint thin", np.concatenate([outline, outline[:1]]), (len(outline) + 1,)
            )
        ]
        plate = design.artefacts.names[artefact]
        title = f"Balls of {plate} in its own frame"
        names = f"ball-view-{number}", f"balls of {plate}", title
        open_ = places[np.setdiff1d(members, determined)]
        yield _ellipsoids(
            layers,
            places[determined],
            factor * sigma * spread[determined],
            open_,
            size,
            names,
            factor,
        )


def _ellipsoids(
    layers: list[Layer],
    points: Array,
    spread: Array,
    undetermined: Array,
    size: float,
    names: tuple[str, str, str],
    factor: float,
) -> SpatialPicture:
    """Return ellipsoids about points (m, d) with covariances of square roots `spread` (m, d, r),
    with a name, a label and a title.
    """
    name, label, title = names
    variances, axes = eigh(spread @ spread.transpose(0, 2, 1))
    half = np.sqrt(np.maximum(variances, 0.0))
    longest = float(half.max(initial=0.0))
    times = round_number(LONGEST_AXIS * size / longest) if longest > 0.0 else 1.0
    layers = [
        *layers,
        Layer("ellipsoids", "uncertain", points, shapes=times * axes * half[:, None, :]),
        Layer("dots", "alert", undetermined),
    ]
    caption = (
        f"{title}: half axes are expanded uncertainties U, k = {factor:g}, enlarged"
        f" {times:,.0f} times. They refer to the frame that the error model's constraints"
        " and the poses fix."
    )
    if not len(points):
        caption = f"{title}: all {len(undetermined)} are undetermined, and have no ellipsoid."
    elif len(undetermined):
        caption += f" {len(undetermined)} are undetermined: dots without an ellipsoid."
    return SpatialPicture(layers, name, label, title, caption)


def motion_view(
    linearisation: Linearisation,
    motion: Motion,
    name: str,
    words: str,
    kind: str,
    most: int = MOST_MOVING,
) -> SpatialPicture | None:
    """Return a direction as an enlarged, moving picture of the machine's grid and of at most
    `most` balls, if it moves any.
    """
    design = linearisation.design
    grid, sizes = _grid(design)
    of_probes = [
        moved_points(linearisation, motion, grid, np.full(len(grid), probe))
        for probe in range(len(design.probes.names))
    ]
    # The probe of the evaluation, unless the direction shows with others only.
    probe = design.evaluation.probe
    if not _largest(of_probes[probe]) > NO_MOTION:
        probe = int(
            np.argmax([_largest(probe_position) > NO_MOTION for probe_position in of_probes])
        )
    readings = design.readings.select(_moving_readings(design, most))
    balls = locations(design, linearisation.state, readings)
    of_grid, of_balls = of_probes[probe], moved_balls(linearisation, motion, readings)
    largest = max(_largest(of_grid), _largest(of_balls))
    if not largest > NO_MOTION:
        return None
    times = round_number(LARGEST_MOTION * float(design.machine.volume.size.max()) / largest)
    ends = np.stack([0.0 * of_balls, of_balls], axis=1).reshape(-1, design.dimension)
    trails = np.repeat(balls, 2, axis=0)
    layers = [
        Layer("lines", "faint thin dotted", grid, sizes),
        *volume_layers(design)[2:],
        Layer("lines", "alert", grid, sizes, times * of_grid),
        Layer("dots", "alert fine", grid, (), times * of_grid),
        Layer("dots", "faint", balls),
        Layer("lines", "ink thin", trails, (2,) * len(balls), times * ends),
        Layer("dots", "ink", balls, (), times * of_balls),
    ]
    subject = f"the grid of corrected points with the probe {design.probes.names[probe]} (red)"
    if len(balls):
        subject = f"{subject} and the balls (dots)"
    explanation = (
        f". Enlarged {times:,.0f} times: {subject}, compared with the nominal geometry (grey)."
    )
    caption = joined([element("strong", kind), ": ", words, explanation])
    return SpatialPicture(layers, name, kind.lower(), f"{kind} as a moving picture", caption)


def _largest(moved: Array) -> float:
    return float(np.linalg.norm(moved, axis=1).max(initial=0.0))


def _grid(design: Design) -> tuple[Array, tuple[int, ...]]:
    """Lines parallel to the axes over the faces of the volume: points, and how many each has."""
    lower, upper = design.machine.volume.lower, design.machine.volume.upper
    d = len(lower)
    levels, along = np.linspace(0.0, 1.0, 3), np.linspace(0.0, 1.0, ALONG)
    lines = []
    for axis in range(d):
        other_axes = [k for k in range(d) if k != axis]
        for place in np.array(np.meshgrid(*[levels] * (d - 1), indexing="ij")).reshape(d - 1, -1).T:
            if d == 3 and (place == 0.5).all():
                continue
            line = np.zeros((ALONG, d))
            line[:, axis], line[:, other_axes] = along, place
            lines.append(line)
    points = np.concatenate(lines)
    return lower + points * (upper - lower), (ALONG,) * len(lines)


def _moving_readings(design: Design, most: int) -> Integers:
    """Readings of plates whose balls are drawn: each ball of a position once, and of many some."""
    mine = design.plate_readings
    keys = np.stack([design.readings.position[mine], design.readings.ball[mine]], axis=1)
    _, first = np.unique(keys, axis=0, return_index=True)
    return mine[first[:: -(-len(first) // most) or 1]]


def _outline(points: Array) -> Array:
    """Corners (k, d) of points' convex hull in the plane that they are closest to."""
    centre = points.mean(axis=0)
    _, _, axes = svd(points - centre, full_matrices=False)
    plane = axes[:2]
    corners = (
        hull(np.round((points - centre) @ plane.T, 9))
        if len(points) > 1
        else np.zeros((1, len(plane)))
    )
    return centre + corners @ plane[: corners.shape[1]]


def _some(balls: Integers, most: int) -> Integers:
    """Return locations of each ball's first reading, or of a selection of balls."""
    _, first = np.unique(balls, return_index=True)
    return first[:: -(-len(first) // most) or 1]


def _counts(design: Design) -> Sequence[int]:
    """Return the number of balls read in each position."""
    pairs = np.stack([design.readings.position, design.readings.ball], axis=1)
    counts: list[int] = np.unique(np.unique(pairs, axis=0)[:, 0], return_counts=True)[1].tolist()
    return counts
