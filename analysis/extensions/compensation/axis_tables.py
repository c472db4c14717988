"""Errors of each axis at nodes along it, between which a controller interpolates linearly.

Errors are corrections here, to be added to scale readings: where the tip is less where the scales
say. A table holds six errors of an axis, in metres and radians. Straightness errors keep their
slopes: squareness is in them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.machines import (
    AXIS_ERRORS,
    Arrangement,
    Array,
    ErrorModel,
    Field,
    KinematicModel,
    PlaneModel,
    Points,
    TrueMachine,
    VolumetricModel,
    carried_vectors,
    curves_model,
)

Corner = tuple[float, ...]


class NotOfAxesError(ValueError):
    """Errors of a machine are not the sum of what its axes do; the text says why."""


def names_of(axis: int) -> tuple[str, ...]:
    """ISO 230-1 names of the six errors of an axis, 0 to 2, displacements first.

    >>> names_of(1)
    ('EXY', 'EYY', 'EZY', 'EAY', 'EBY', 'ECY')
    """
    return tuple(name for name, error in AXIS_ERRORS.items() if error.axis == axis)


@dataclass(frozen=True, eq=False)
class AxisTable:
    """Errors of an axis, 0 to 2: `values` (n, 6) by `names_of` at ascending `positions` (n,)."""

    axis: int
    positions: Array
    values: Array


@dataclass(frozen=True, eq=False)
class AxisTables:
    """Tables of the axes of a machine of an arrangement; `origin` is the point from which levers of
    rotations count, in metres.
    """

    arrangement: Arrangement
    origin: Corner
    axes: tuple[AxisTable, ...]

    @property
    def dimension(self) -> int:
        return len(self.axes)

    @property
    def lower(self) -> Corner:
        return tuple(float(table.positions[0]) for table in self.axes)

    @property
    def upper(self) -> Corner:
        return tuple(float(table.positions[-1]) for table in self.axes)

    def machine(self) -> TrueMachine:
        """The machine that the tables describe, interpolated linearly."""
        curves = {
            name: Points(tuple(table.positions.tolist()), tuple(values.tolist()))
            for table in self.axes
            for name, values in zip(names_of(table.axis), table.values.T, strict=True)
        }
        lower, upper = _in_space(self.lower, self.origin), _in_space(self.upper, self.origin, 1.0)
        chain = curves_model(curves, "linear", self.arrangement, lower, upper)
        assert isinstance(chain, KinematicModel)
        model: ErrorModel = replace(chain, origin=self.origin)
        if self.dimension == 2:
            model = PlaneModel(model, self.origin[2])
        return TrueMachine(model, np.ones(len(model.parameters)))

    def changed(self, change: Callable[[AxisTable], Array]) -> AxisTables:
        """The same with other values."""
        return replace(
            self, axes=tuple(replace(table, values=change(table)) for table in self.axes)
        )


def _in_space(corner: Corner, origin: Corner, height: float = 0.0) -> Corner:
    return corner if len(corner) == 3 else (*corner, origin[2] + height)


@dataclass(frozen=True)
class AxisFunctions:
    """Errors of a machine that are the sum of what its axes do: those of a `chain`, and `fields`
    each of whose terms depends on one axis, with the parameters `a` of both.
    """

    chain: KinematicModel
    fields: tuple[Field, ...]
    a: Array

    @property
    def origin(self) -> Array:
        """From where levers count."""
        return np.asarray(self.chain.lower if self.chain.origin is None else self.chain.origin)

    def values(self, axis: int, positions: Array) -> Array:
        """The six errors (m, 6) of an axis at positions (m,) along it."""
        x = np.tile(self.origin, (len(positions), 1))
        x[:, axis] = positions
        size = len(self.chain.parameters)
        translation, rotation = self.chain.motions(x, self.a[:size])
        moved = translation[:, axis].copy()
        for field, value in zip(self.fields, self.a[size:], strict=True):
            # At the others' origin a term of another axis is zero.
            moved += value * field.values(x - self.origin)
        return np.hstack([moved, rotation[:, axis]])


def axis_functions(model: ErrorModel, a: Array) -> AxisFunctions:
    """The errors of each axis.

    :raises NotOfAxesError: the model's errors are not a sum of such.
    """
    inner = model.spatial if isinstance(model, PlaneModel) else model
    if isinstance(inner, KinematicModel):
        return AxisFunctions(inner, (), a)
    if not isinstance(inner, VolumetricModel):
        raise NotOfAxesError("its error model is not one of errors of single axes")
    for field in inner.fields:
        if any(sum(power > 0 for power in exponents) != 1 for _, _, exponents in field.terms):
            raise NotOfAxesError(f"{field.meaning} depends on two axes at once")
    return AxisFunctions(inner.chain, inner.fields, a)


def tabulated(
    functions: AxisFunctions, nodes: tuple[Array, ...], zero: Array, origin: Corner
) -> AxisTables:
    """Tables of the errors at `nodes` of each axis, with levers from `origin`, and zero at the
    point `zero` (3,).

    A rotation that is moved to another origin leaves a displacement that depends on the same axis;
    what an axis has turned at `zero` turns the ways of those that it carries. The volumetric error
    stays what it was, less its value at `zero` with the same probe.
    """
    arrangement = functions.chain.arrangement
    shift = np.asarray(origin) - functions.origin
    axes = range(len(nodes))
    tables = {k: functions.values(k, nodes[k]) for k in axes}
    at_zero = {k: functions.values(k, zero[k : k + 1])[0] for k in axes}
    levers = carried_vectors(arrangement, shift[None], np.zeros((1, 3)))
    masks = carried_vectors(arrangement, np.ones((1, 3)), np.zeros((1, 3)))
    for k in axes:
        for values in (tables[k], at_zero[k]):
            turned = levers[k][0] * np.cross(values[..., 3:], levers[k][1][0])
            values[..., :3] += turned
    for k in axes:
        for j in axes:
            if masks[k][1][0, j]:
                slope = masks[k][0] * np.cross(at_zero[k][3:], np.eye(3)[j])
                tables[j][:, :3] += slope * (nodes[j] - origin[j])[:, None]
                at_zero[j][:3] += slope * (zero[j] - origin[j])
    return AxisTables(
        arrangement,
        origin,
        tuple(AxisTable(k, nodes[k], tables[k] - at_zero[k]) for k in axes),
    )


def tool_chain(arrangement: Arrangement) -> tuple[str, ...]:
    """The axes on the way from the workpiece to the probe.

    >>> tool_chain(Arrangement(("z",), ("x", "y")))
    ('y', 'x', 'z')
    """
    return (*reversed(arrangement.workpiece_side), *arrangement.probe_side)


def in_arrangement(tables: AxisTables, arrangement: Arrangement) -> AxisTables:
    """The same errors, at the positions of the tables and to first order, as those of another
    arrangement.

    An axis that carries the workpiece turns it, and so the tip the other way beside it. The same
    may be told as the turn of an axis that carries the tip: the axis's own way is not turned then,
    which its displacements make up for.

    :raises NotOfAxesError: the axes stand in another order between workpiece and probe.
    """
    own_chain, wanted = tool_chain(tables.arrangement), tool_chain(arrangement)
    if own_chain != wanted:
        raise NotOfAxesError(
            f"from the workpiece to the probe its axes are {', '.join(own_chain)}, not"
            f" {', '.join(wanted)}"
        )
    before, after = set(tables.arrangement.probe_side), set(arrangement.probe_side)
    moved = {"xyz".index(name) for name in before ^ after}

    def values(table: AxisTable) -> Array:
        if table.axis not in moved:
            return table.values
        way = (table.positions - tables.origin[table.axis])[:, None] * np.eye(3)[table.axis]
        turned = np.cross(table.values[:, 3:], way)
        return np.hstack([table.values[:, :3] - turned, -table.values[:, 3:]])

    return replace(tables.changed(values), arrangement=arrangement)


def on_tool_side(tables: AxisTables) -> AxisTables:
    """The same errors with all axes on the probe's side."""
    return in_arrangement(tables, Arrangement(tool_chain(tables.arrangement)))
