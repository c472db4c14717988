"""Tables of a machine's errors, and how far what a controller makes of them is from the machine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.geometry import grid_points
from ballplate.simulator.machines import Array, ErrorModel

from .axis_tables import (
    AxisTable,
    AxisTables,
    NotOfAxesError,
    axis_functions,
    on_tool_side,
    tabulated,
)
from .table_formats import MOST_GRID_NODES, MOST_NODES, Table, TableFormat, rounded
from .volume_tables import VolumeTable, volume_table

# Distances between nodes of an axis where no pitch is chosen.
INTERVALS = 20
# A node is where an axis ends if it is nearer than this part of the pitch.
SAME = 1e-6
# Places along an axis at which a table is compared with the machine, and at random besides.
PLACES, RANDOM = 33, 4000


class CannotMakeError(ValueError):
    """No table of the machine can be made as asked; the `reasons` say why and what would do."""

    def __init__(self, *reasons: str) -> None:
        super().__init__("; ".join(reasons))
        self.reasons = reasons


@dataclass(frozen=True, eq=False)
class TabledMachine:
    """Errors of a machine in a volume from `lower` to `upper` (d,): a `model` with parameters `a`.

    `zero` (d,) is where its errors are zero, and `offsets` (k, d) are those of its probes, all in
    metres; `bends` are positions of each axis where errors bend, and `verdict` that on the fit of a
    map.
    """

    title: str
    model: ErrorModel
    a: Array
    lower: Array
    upper: Array
    zero: Array
    offsets: Array
    bends: tuple[Array, ...] = ()
    verdict: str = ""

    @property
    def dimension(self) -> int:
        return len(self.lower)


@dataclass(frozen=True, eq=False)
class MadeTable:
    """A table as it is written, and its largest differences in the volume from the machine.

    `interpolation` is that of the exact values, `rounding` what rounding them changes and `written`
    that of the table as written, each as the length of a vector in metres, over `places` points
    with each of the `offsets` (k, d): those of the probes, and none, to which a table without
    rotations refers. `left_out` is how far these tips are moved by rotations that the format has no
    room for.
    """

    table: Table
    zero: Array
    interpolation: float
    rounding: float
    written: float
    left_out: float
    places: int
    offsets: Array


def nodes_along(lower: float, upper: float, start: float, pitch: float, even: bool) -> Array:
    """Positions from `start` in steps of `pitch`, in metres, with both ends of an axis; with `even`
    distances the last ones may be beyond its ends.

    >>> nodes_along(0.0, 1.0, 0.0, 0.4, even=False).tolist()
    [0.0, 0.4, 0.8, 1.0]
    """
    first = int(np.ceil((lower - start) / pitch - SAME))
    last = int(np.floor((upper - start) / pitch + SAME))
    if even:
        first -= start + first * pitch - lower > SAME * pitch
        last += upper - start - last * pitch > SAME * pitch
        return np.round(start + pitch * np.arange(first, last + 1), 10)
    inner = start + pitch * np.arange(first, last + 1)
    inner = inner[(inner - lower > SAME * pitch) & (upper - inner > SAME * pitch)]
    return np.round(np.concatenate([[lower], inner, [upper]]), 10)


def made_table(
    machine: TabledMachine,
    made: TableFormat,
    pitch: Array | None = None,
    zero: Array | None = None,
    volumetric: bool = False,
    without_rotations: bool = False,
) -> MadeTable:
    """A table of the machine in a format.

    `pitch` (d,) is the distance of nodes, by default a twentieth of each axis; they are counted
    from `zero` (d,), where the table is zero, by default where the machine's errors are.
    `volumetric` tables hold the errors of the whole machine on a grid. Rotations that the format
    has no room for are left out only if so asked.

    :raises CannotMakeError: the format cannot hold the machine's errors, with all reasons.
    """
    origin = machine.zero if zero is None else zero
    usual = (machine.upper - machine.lower) / INTERVALS
    steps = usual if pitch is None else pitch
    reasons = [*_beyond(machine, made, steps, origin)]
    if not (volumetric or made.has_rotations or without_rotations):
        # At nodes that any format has room for.
        nodes = _nodes(machine, made, usual, machine.zero)
        reasons += _refused_rotations(_of_axes(machine, made, nodes, machine.zero), made)
    if reasons:
        raise CannotMakeError(*reasons)
    nodes = _nodes(machine, made, steps, origin)
    exact: Table
    if volumetric:
        exact = _volumetric(machine, made, nodes, origin)
    else:
        exact = _of_axes(machine, made, nodes, origin)
    written = _rounded(exact, made)
    return _compared(machine, exact, written, made, origin)


def _beyond(
    machine: TabledMachine, made: TableFormat, steps: Array, origin: Array
) -> Iterator[str]:
    """What is beyond the volume, or the room of the format."""
    outside = (origin < machine.lower - SAME) | (origin > machine.upper + SAME)
    if outside.any():
        named = " and ".join("xyz"[k] for k in np.flatnonzero(outside))
        yield f"the origin is outside the volume in {named}"
    most = made.most_points or MOST_NODES
    for k in range(machine.dimension):
        count = float(machine.upper[k] - machine.lower[k]) / float(steps[k])
        if count <= most:
            count = len(_along(machine, made, steps, origin, k))
        if count > most:
            yield (
                f"the pitch along {'xyz'[k]} takes {count:.0f} positions, and {made.name} has at"
                f" most {most}; choose a larger one"
            )


def _along(machine: TabledMachine, made: TableFormat, steps: Array, origin: Array, k: int) -> Array:
    ends = float(machine.lower[k]), float(machine.upper[k])
    return nodes_along(*ends, float(origin[k]), float(steps[k]), made.even)


def _nodes(
    machine: TabledMachine, made: TableFormat, steps: Array, origin: Array
) -> tuple[Array, ...]:
    return tuple(_along(machine, made, steps, origin, k) for k in range(machine.dimension))


def _volumetric(
    machine: TabledMachine, made: TableFormat, nodes: tuple[Array, ...], origin: Array
) -> VolumeTable:
    if not made.has_volumes:
        raise CannotMakeError(f"{made.name} has tables of single axes only; isg has others")
    count = int(np.prod([len(node) for node in nodes]))
    if count > MOST_GRID_NODES:
        raise CannotMakeError(
            f"{count} nodes are too many; at most {MOST_GRID_NODES} are possible: choose a larger"
            " pitch"
        )
    return volume_table(machine.model, machine.a, nodes, origin)


def _of_axes(
    machine: TabledMachine,
    made: TableFormat,
    nodes: tuple[Array, ...],
    origin: Array,
) -> AxisTables:
    try:
        functions = axis_functions(machine.model, machine.a)
    except NotOfAxesError as error:
        more = "; a volumetric table can hold them" if made.has_volumes else ""
        more += "; a map that is converted to a kinematic model may have such errors"
        raise CannotMakeError(
            f"a table of single axes cannot hold its errors: {error}{more}"
        ) from None
    zero = functions.origin.copy()
    zero[: machine.dimension] = origin
    levers = np.zeros(3) if made.from_zero else zero
    within = tuple(
        np.clip(node, low, high)
        for node, low, high in zip(nodes, machine.lower, machine.upper, strict=True)
    )
    exact = tabulated(functions, within, zero, tuple(levers.tolist()))
    exact = _continued(exact, nodes)
    if made.from_zero or not made.has_rotations:
        exact = on_tool_side(exact)
    return exact


def _refused_rotations(exact: AxisTables, made: TableFormat) -> Iterator[str]:
    """Rotations of axes that a format has no room for."""
    largest = max(float(np.abs(axis.values[:, 3:]).max()) for axis in exact.axes)
    if largest > made.angle_step:
        yield (
            f"its axes turn by up to {1e6 * largest:.4g} µrad, for which {made.name} tables have no"
            " room; say that they are to be left out (without rotations), or choose another format"
        )


def _continued(tables: AxisTables, nodes: tuple[Array, ...]) -> AxisTables:
    """Tables whose first and last nodes lie beyond the ends of an axis, with the values on the line
    through the node before and that at the end.
    """
    tables_continued = []
    for axis_nodes, table in zip(nodes, tables.axes, strict=True):
        values = table.values.copy()
        for end, inner in ((0, 1), (-1, -2)):
            if axis_nodes[end] != table.positions[end]:
                part = (axis_nodes[end] - axis_nodes[inner]) / (
                    table.positions[end] - axis_nodes[inner]
                )
                values[end] = values[inner] + part * (values[end] - values[inner])
        tables_continued.append(AxisTable(table.axis, axis_nodes, values))
    return AxisTables(tables.arrangement, tables.origin, tuple(tables_continued))


def _rounded(table: Table, made: TableFormat) -> Table:
    if isinstance(table, VolumeTable):
        return VolumeTable(table.nodes, rounded(table.values, made))
    return table.changed(lambda table: rounded(table.values, made))


def correction(table: Table, x: Array, p: Array) -> Array:
    """Corrections (m, d) that a table makes at scale readings x (m, d) with probe offsets p (m,
    d), interpolated linearly.
    """
    if isinstance(table, VolumeTable):
        return table.error(x, p)
    machine = table.machine()
    return machine.model.error(x, machine.a, p)


@single_threaded
def _compared(
    machine: TabledMachine, exact: Table, written: Table, made: TableFormat, origin: Array
) -> MadeTable:
    """Compare table and machine at places on a grid and at random, less their values at the origin
    with the same probe.
    """
    d = machine.dimension
    probes = np.unique(np.concatenate([np.zeros((1, d)), machine.offsets]), axis=0)
    without = exact
    if not made.has_rotations:
        assert isinstance(exact, AxisTables)
        without = exact.changed(lambda table: table.values * (np.arange(6) < 3))
    sides = [_places(machine, exact, k, origin, probes) for k in range(d)]
    grid = grid_points(sides)
    generator = np.random.default_rng(np.random.SeedSequence(0))
    x = np.concatenate([grid, generator.uniform(machine.lower, machine.upper, (RANDOM, d))])
    # The origin last.
    x = np.concatenate([x, origin[None]])
    largest = np.zeros(4)
    for offset in probes:
        p = np.broadcast_to(offset, x.shape)
        true = machine.model.error(x, machine.a, p)
        ideal, corrections, rough = (
            correction(written_model, x, p) for written_model in (exact, without, written)
        )
        pairs = ((ideal, true), (corrections, rough), (rough, true), (corrections, ideal))
        apart = [
            correction_values - reference_values for correction_values, reference_values in pairs
        ]
        largest = np.maximum(
            largest,
            [np.linalg.norm(difference - difference[-1], axis=1).max() for difference in apart],
        )
    interpolation, rounding, total, left_out = largest.tolist()
    return MadeTable(written, origin, interpolation, rounding, total, left_out, len(x) - 1, probes)


def _places(machine: TabledMachine, table: Table, axis: int, origin: Array, probes: Array) -> Array:
    """Positions along an axis at which table and machine are compared: nodes, halfway between, and
    where the machine's errors bend; of many, those where the two differ most beside three lines,
    with all probes.
    """
    axis_nodes = table.nodes[axis] if isinstance(table, VolumeTable) else table.axes[axis].positions
    low, high = float(machine.lower[axis]), float(machine.upper[axis])
    bends = machine.bends[axis] if machine.bends else np.zeros(0)
    every = np.concatenate([axis_nodes, 0.5 * (axis_nodes[:-1] + axis_nodes[1:]), bends])
    every = np.unique(np.clip(every, low, high))
    if len(every) <= PLACES:
        return every
    differs = np.zeros(len(every))
    for corner, offset in product((machine.lower, machine.upper, origin), probes):
        x = np.tile(corner, (len(every), 1))
        x[:, axis] = every
        p = np.broadcast_to(offset, x.shape)
        apart = correction(table, x, p) - machine.model.error(x, machine.a, p)
        differs += np.linalg.norm(apart - np.median(apart, axis=0), axis=1)
    chosen = np.argsort(-differs, kind="stable")[: PLACES - 2]
    return np.unique(np.concatenate([[low, high], every[chosen]]))
