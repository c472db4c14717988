"""What a direction changes: error functions with their size and shape, the deformation of
artefacts, the motion of positions.
"""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing.numerics import above, comparable, lstsq
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.geometry.motions import without_rigid_motion
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.machines.arrangement import AXIS_ERRORS
from ballplate.simulator.machines.protocol import HasLines

from .directions import ArtefactPart, Direction, FunctionPart, LengthPart, PositionPart

# Highest degree of polynomial tried for a curve before it is called irregular.
HIGHEST = 10

SHAPES = {1: "linear", 2: "quadratic", 3: "cubic"}


def shape(t: Array, values: Array) -> str:
    """Return a word for a curve's shape: the lowest degree of polynomial, up to 10, that describes
    it; empty for a constant.

    >>> t = np.linspace(0, 1, 50)
    >>> shape(t, 3 * t), shape(t, t - t**2), shape(t, t**5), shape(t, 0 * t + 2)
    ('linear', 'quadratic', 'of degree 5', '')
    """
    if not np.ptp(values):
        return ""
    basis = np.asarray(np.polynomial.chebyshev.chebvander(2 * t - 1, HIGHEST), float)
    size = float(np.abs(values).max())
    for degree in range(1, HIGHEST + 1):
        part = basis[:, : degree + 1]
        residual = values - part @ lstsq(part, values, rcond=None)[0]
        if np.abs(residual).max() <= 1e-3 * size:
            return SHAPES.get(degree, f"of degree {degree}")
    return "irregular"


def deformation(places: Array, displacement: Array) -> str:
    """Return a description of an artefact's deformation, from ball places and their displacements,
    both (n, d).

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    >>> deformation(square, square * [1.0, -1.0])
    'stretches along its x and shrinks along its y'
    """
    # A deformation is described by its linear part, as stretches and shears, and by what is left of
    # it, as bending or distortion. A part with less than two per cent of the sum of squares has no
    # words.
    n, d = places.shape
    moved = without_rigid_motion(places, displacement[:, :, None])[:, :, 0]
    total = float((moved**2).sum())
    if total <= 1e-12 * float((displacement**2).sum()):
        return "moves as a whole"
    centred = places - places.mean(axis=0)
    linear = lstsq(centred, moved, rcond=1e-9)[0].T
    remainder = moved - centred @ linear.T
    extent = np.ptp(places, axis=0)
    words = []
    if above(((centred @ linear.T) ** 2).sum(), 0.02 * total):
        names = ("x", "y", "z")
        # A plate has no extent across its plane, so that no stretch is seen there.
        stretch = np.array([linear[i, i] * (extent[i] > 0) for i in range(d)])
        flat = [i for i in range(d) if extent[i] > 0]
        largest = np.abs(linear).max()
        used = [i for i in flat if above(abs(stretch[i]), 0.05 * largest)]
        if len(used) > 1 and np.ptp(stretch[used]) < 0.02 * largest and len(used) == len(flat):
            words.append("changes its size as a whole")
        else:
            grow = " and ".join(
                f"its {names[i]}" for i in used if stretch[i] * stretch[used[0]] > 0
            )
            shrink = " and ".join(
                f"its {names[i]}" for i in used if stretch[i] * stretch[used[0]] < 0
            )
            if grow:
                words.append(
                    f"stretches along {grow}" + (f" and shrinks along {shrink}" if shrink else "")
                )
        sheared = [
            (i, j)
            for i in flat
            for j in flat
            if i < j and above(abs(linear[i, j] + linear[j, i]), 0.1 * largest)
        ]
        words += [f"shears in its {names[i]}{names[j]} plane" for i, j in sheared]
    if above((remainder**2).sum(), 0.02 * total):
        out_of_plane = (
            d == 3
            and extent[2] == 0
            and above((remainder[:, 2] ** 2).sum(), 0.5 * float((remainder**2).sum()))
        )
        words.append("bends out of its plane" if out_of_plane else "distorts unevenly")
    return ", ".join(words) if words else "deforms"


# Shares of a direction that move points by less than this fraction of its largest are not reported.
NEGLIGIBLE = 0.01

# Changes that move points by less than this fraction of a direction's largest are rounding.
ROUNDING = 1e-9


def signed(
    design: Design, layout: SharedLayout, shared: Array, balls: Array
) -> tuple[Array, Array]:
    """Return a direction without rounding errors, its first change positive."""
    # A direction has no sign of its own. The first change that is printed is made positive, so that
    # the same design has the same words everywhere.
    shared, balls = _less_rounding(layout, shared, balls)
    direction = described(design, layout, shared, balls)
    if direction.functions:
        first = direction.functions[0].peak
    elif direction.lengths:
        first = direction.lengths[0].change
    else:
        changes = np.concatenate([shared / layout.scale, balls.ravel()])
        first = float(changes[comparable(np.abs(changes)).argmax()])
    return (shared, balls) if first >= 0.0 else (-shared, -balls)


def largest_displacement(layout: SharedLayout, shared: Array, balls: Array) -> float:
    """Return the largest displacement of points in a direction, in metres."""
    parts = np.abs(shared / layout.scale), np.abs(balls)
    return max(float(part.max(initial=0.0)) for part in parts)


def _less_rounding(layout: SharedLayout, shared: Array, balls: Array) -> tuple[Array, Array]:
    """Return a direction with zeros for rounding errors."""
    least = ROUNDING * largest_displacement(layout, shared, balls)
    return np.where(np.abs(shared / layout.scale) > least, shared, 0.0), np.where(
        np.abs(balls) > least, balls, 0.0
    )


def described(design: Design, layout: SharedLayout, shared: Array, balls: Array) -> Direction:
    """Return the parts of a direction, of changes (s,) of the shared parameters and (n, d) of the
    balls.
    """
    d = design.dimension
    functions = _function_parts(design, layout, shared)
    effect = np.abs(shared / layout.scale)
    largest = largest_displacement(layout, shared, balls)
    positions = []
    for k in design.posed_positions:
        columns = layout.pose_columns[k]
        values = np.where(columns >= 0, shared[np.maximum(columns, 0)], 0.0)
        if above(effect[columns[columns >= 0]].max(initial=0.0), NEGLIGIBLE * largest):
            shift, turn = np.linalg.norm(values[:d]), np.linalg.norm(values[d:])
            along, about = _single_axis(values[:d], " along "), _single_axis(values[d:], " about ")
            positions.append(
                PositionPart(design.positions.names[k], float(shift), float(turn), along, about)
            )
    artefacts = []
    for artefact in design.artefacts.plates:
        members = design.balls.of(artefact)
        moved = np.linalg.norm(balls[members], axis=1)
        if above(moved.max(initial=0.0), NEGLIGIBLE * largest):
            words = deformation(design.balls.places[members], balls[members])
            artefacts.append(
                ArtefactPart(design.artefacts.names[artefact], float(moved.max()), words)
            )
    probes = []
    for k, columns in enumerate(layout.offset_columns):
        values = np.where(columns >= 0, shared[np.maximum(columns, 0)], 0.0)
        if above(np.abs(values).max(), NEGLIGIBLE * largest):
            probes.append(PositionPart(design.probes.names[k], float(np.linalg.norm(values)), 0.0))
    lengths = tuple(
        LengthPart(name, float(change))
        for name, change in zip(design.unknown_lengths.names, shared[layout.lengths], strict=True)
        if above(abs(change), NEGLIGIBLE * largest)
    )
    influences = tuple(
        LengthPart(parameter.name, float(change), parameter.unit)
        for parameter, change in zip(
            design.influence_parameters, shared[layout.influences], strict=True
        )
        if above(abs(change) * parameter.effect, NEGLIGIBLE * largest)
    )
    return Direction(
        functions,
        tuple(artefacts),
        tuple(positions),
        probes=tuple(probes),
        lengths=lengths,
        influences=influences,
    )


def _single_axis(vector: Array, word: str) -> str:
    if len(vector) == 1 or not vector.any():
        return ""
    axis = int(comparable(np.abs(vector)).argmax())
    return f"{word}{'xyz'[axis]}" if abs(vector[axis]) > 0.999 * np.linalg.norm(vector) else ""


def _function_parts(
    design: Design, layout: SharedLayout, shared: Array
) -> tuple[FunctionPart, ...]:
    a, parameters = shared[layout.model], layout.parameters[layout.model]
    effect = np.abs(a / layout.scale[layout.model])
    largest = float(np.abs(shared / layout.scale).max(initial=0.0))
    parts = []
    model = design.model
    for name in dict.fromkeys(p.function for p in parameters):
        members = [i for i, p in enumerate(parameters) if p.function == name]
        if not above(effect[members].max(), NEGLIGIBLE * largest):
            continue
        parameter = parameters[members[0]]
        if isinstance(model, HasLines):
            # Size and shape of a curve are those of its values: coefficients depend on the basis.
            t = np.linspace(0.0, 1.0, 201)
            lines = model.lines(name, t)
            values = np.stack([line.basis @ a[members] for line in lines])
            peak = float(values.flat[comparable(np.abs(values)).argmax()])
            k = int(comparable(np.ptp(values, axis=1)).argmax())
            form = " ".join(filter(None, (shape(t, values[k]), lines[k].words)))
        else:
            peak, form = float(a[members[0]]), ""
        meaning = parameter.meaning
        # A straightness error that is a straight line is an axis out of square, and is called that.
        if form == "linear" and name in AXIS_ERRORS and AXIS_ERRORS[name].is_straightness:
            meaning, form = AXIS_ERRORS[name].slope_meaning, ""
        function_part = FunctionPart(name, meaning, peak, parameter.unit, form)
        parts.append((effect[members].max(), function_part))
    order = np.argsort(-comparable([size for size, _ in parts]), kind="stable")
    return tuple(parts[k][1] for k in order)
