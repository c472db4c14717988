"""What a direction changes: error functions with their size and shape, the deformation of
artefacts, the motion of positions.
"""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing.numerics import above, comparable
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.machines.error_names import AXIS_ERRORS
from ballplate.simulator.machines.protocol import Array, HasLines

from .curve_shapes import shape
from .deformations import deformation
from .directions import ArtefactPart, Direction, FunctionPart, LengthPart, PositionPart

# Shares of a direction that move points by less than this fraction of its largest are not reported.
NEGLIGIBLE = 0.01

# Changes that move points by less than this fraction of a direction's largest are rounding.
ROUNDING = 1e-9


def signed(
    design: Design, layout: SharedLayout, shared: Array, balls: Array
) -> tuple[Array, Array]:
    """Return a direction without rounding errors, its first change positive."""
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
            t = np.linspace(0.0, 1.0, 201)
            lines = model.lines(name, t)
            values = np.stack([line.basis @ a[members] for line in lines])
            peak = float(values.flat[comparable(np.abs(values)).argmax()])
            k = int(comparable(np.ptp(values, axis=1)).argmax())
            form = " ".join(filter(None, (shape(t, values[k]), lines[k].words)))
        else:
            peak, form = float(a[members[0]]), ""
        meaning = parameter.meaning
        if form == "linear" and name in AXIS_ERRORS and AXIS_ERRORS[name].is_straightness:
            meaning, form = AXIS_ERRORS[name].slope_meaning, ""
        function_part = FunctionPart(name, meaning, peak, parameter.unit, form)
        parts.append((effect[members].max(), function_part))
    order = np.argsort(-comparable([size for size, _ in parts]), kind="stable")
    return tuple(parts[k][1] for k in order)
