"""Compensation tables as they show themselves: made of a machine or a map, and read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.presentation import (
    Data,
    MainTable,
    Result,
    aligned,
    by_axis,
    given,
    picked,
    table_lines,
)
from ballplate.simulator.experiment import is_map_file, load_machine, read_map
from ballplate.simulator.geometry import grid_points
from ballplate.simulator.inputs import (
    Message,
    format_length,
    listing,
    parse_length,
    refused,
)
from ballplate.simulator.machines import AXES, AXIS_ERRORS, Array, Points, true_volumetric
from ballplate.simulator.maps import FittedMap, verdict_line

from .axis_tables import AxisTable, AxisTables, NotOfAxesError, names_of, tool_chain
from .formats import FORMATS
from .making import CannotMakeError, MadeTable, TabledMachine, correction, made_table
from .reading import machine_files, read_table_files
from .table_formats import MEANING, Sense, Table, TableFormat, parse_arrangement, with_sense
from .volume_tables import VolumeTable

NOT_LOADED = "not loaded into a controller: test it on the machine before you rely on it"
# Of what a map leaves open: places along each axis, and probe offsets in metres.
CHECKED, OFFSET = 5, 0.1


@dataclass(frozen=True, eq=False, repr=False)
class CompensationTable(Result):
    """A table as corrections to be added to scale readings, in metres and radians."""

    label: str
    title: str
    format: TableFormat
    sense: Sense
    table: Table
    remarks: tuple[str, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        return self.remarks

    def headline(self) -> str:
        if isinstance(self.table, VolumeTable):
            counts = " x ".join(str(len(nodes)) for nodes in self.table.nodes)
            return f"{self.format.name}, {counts} nodes"
        counts = ", ".join(str(len(axis.positions)) for axis in self.table.axes)
        return f"{self.format.name}, {counts} positions"

    def correction(self, points: Any, offset: Any = None) -> Array:
        """Corrections (m, d) of scale readings `points` (m, d), interpolated linearly, in metres;
        `offset` (d,) is that of the probe.
        """
        x = np.atleast_2d(np.asarray(points, float))
        p = np.zeros(x.shape) if offset is None else np.broadcast_to(offset, x.shape)
        return correction(self.table, x, np.asarray(p, float)) - p

    def columns(self) -> MainTable:
        """One row for each node of an axis, or of the volume."""
        if isinstance(self.table, VolumeTable):
            places = by_axis("{}, mm", grid_points(self.table.nodes))
            values = self.table.values.reshape(-1, 6)
        else:
            axes = self.table.axes
            places = {
                "axis": [AXES[table.axis] for table in axes for _ in table.positions],
                "position, mm": np.concatenate([table.positions for table in axes]),
            }
            values = np.concatenate([table.values for table in axes])
        moved = by_axis("displacement {}, µm", values[:, :3])
        return {**places, **moved, **by_axis("turn about {}, µrad", values[:, 3:])}, ()

    def data(self) -> Data:
        result_data = {
            "title": self.title,
            "format": self.format.name,
            "states": self.sense,
            "dimension": self.table.dimension,
        }
        if isinstance(self.table, AxisTables):
            result_data |= {
                "probe_side": self.table.arrangement.probe_side,
                "workpiece_side": self.table.arrangement.workpiece_side,
                "levers_from": self.table.origin,
            }
        return {**result_data, "corrections": self.rows(), "warnings": self.remarks}

    def table_lines(self) -> list[str]:
        """What the table is and how large its corrections are."""
        words = f"{self.format.words}; states {self.sense}, {MEANING[self.sense]}"
        if isinstance(self.table, VolumeTable):
            return [words, *_volume_lines(self.table)]
        origin = ", ".join(format_length(value) for value in self.table.origin)
        chain = ", ".join(tool_chain(self.table.arrangement))
        side = self.table.arrangement.workpiece_side
        sides = f"{listing(side)} on the workpiece's side" if side else "all on the tool's side"
        return [
            words,
            f"axes from the workpiece to the tool: {chain}; {sides}; levers from {origin}",
            "",
            *_axis_lines(self.table),
        ]


def _axis_lines(table: AxisTables) -> list[str]:
    columns = {
        "": lambda axis_table: AXES[axis_table.axis],
        "positions": lambda axis_table: len(axis_table.positions),
        "from": (lambda axis_table: float(axis_table.positions[0]), format_length),
        "to": (lambda axis_table: float(axis_table.positions[-1]), format_length),
        "largest correction": _largest,
    }
    return table_lines(columns, table.axes)


def _largest(axis_table: AxisTable) -> str:
    """The largest correction of each error of an axis, as text."""
    parts = [
        f"{name} {1e6 * value:.3g} {'µrad' if AXIS_ERRORS[name].is_rotation else 'µm'}"
        for name, value in zip(
            names_of(axis_table.axis), np.abs(axis_table.values).max(axis=0), strict=True
        )
        if value > 0.0
    ]
    return ", ".join(parts) or "none"


def _volume_lines(table: VolumeTable) -> list[str]:
    ends = "; ".join(
        f"{axis} {len(nodes)} from {format_length(float(nodes[0]))} to"
        f" {format_length(float(nodes[-1]))}"
        for axis, nodes in zip(AXES, table.nodes, strict=False)
    )
    d = table.dimension
    moved = np.linalg.norm(table.values[..., :d], axis=-1).max()
    turned = np.linalg.norm(table.values[..., 3:], axis=-1).max()
    return [
        f"errors of the whole machine on a grid: {ends}",
        f"largest correction {1e6 * moved:.3g} µm; the tool turns by up to {1e6 * turned:.3g} µrad",
    ]


@dataclass(frozen=True, eq=False, repr=False)
class MadeCompensation(CompensationTable):
    """A table made of a machine, how far it is from the machine at most, `made`, and the `verdict`
    on the fit of a map.
    """

    made: MadeTable
    verdict: str

    def files(self, stem: str) -> dict[str, str]:
        """The texts of the table's files by their names, which begin with `stem`."""
        table = with_sense(self.table, self.sense)
        texts = self.format.write(table, self.sense, stem)
        return {f"{stem}{ending}": text for ending, text in texts.items()}

    def lines(self) -> list[str]:
        made, step = self.made, f"{1e6 * self.format.length_step:.4g} µm"
        if self.format.has_rotations:
            step += f" and {1e6 * self.format.angle_step:.4g} µrad"
        rows = [
            ["linear interpolation between positions", _at_most(made.interpolation)],
            [f"rounding to {step}", _at_most(made.rounding)],
        ]
        if made.left_out:
            rows.append(["rotations, which the format has no room for", _at_most(made.left_out)])
        rows.append(["all of it", _at_most(made.written)])
        zero = ", ".join(format_length(value) for value in made.zero.tolist())
        tips = listing(f"({', '.join(f'{1e3 * v + 0.0:.6g}' for v in p)}) mm" for p in made.offsets)
        return [
            self.title,
            *([self.verdict] if self.verdict else []),
            *self.table_lines(),
            "",
            f"errors are zero at {zero}; largest differences from the machine in the volume, at"
            f" {made.places} points with probe offsets {tips}:",
            *aligned(rows, [False, True]),
            NOT_LOADED,
        ]

    def data(self) -> Data:
        made = self.made
        return super().data() | {
            **given(fit=self.verdict),
            "zero_at": made.zero,
            "largest_differences": {
                **picked(made, "interpolation", "rounding"),
                "rotations_left_out": made.left_out,
                "all": made.written,
                "places": made.places,
                "probe_offsets": made.offsets,
            },
        }


@dataclass(frozen=True, eq=False, repr=False)
class ReadCompensation(CompensationTable):
    """A table read from files."""

    def lines(self) -> list[str]:
        return [self.title, *self.table_lines()]

    def machine_files(self, stem: str) -> dict[str, str]:
        """The texts of a machine file and the tables that it names, by their names, which begin
        with `stem`.

        :raises ValueError: a machine file cannot hold the table.
        """
        if isinstance(self.table, VolumeTable):
            raise ValueError(
                "a table of the whole volume is no machine file, which has errors of single axes"
            )
        try:
            texts = machine_files(self.table, f"compensation table {self.title}", stem)
        except NotOfAxesError as error:
            raise ValueError(str(error)) from None
        return {f"{stem}{ending}": text for ending, text in texts.items()}


def _at_most(value: float) -> str:
    """A length in micrometres with two digits, rounded up."""
    micrometres = 1e6 * value
    if micrometres < 1e-6:
        return "0 µm"
    step = 10.0 ** (math.floor(math.log10(micrometres)) - 1)
    return f"{math.ceil(micrometres / step - 1e-9) * step:.2g} µm"


def tabled_machine(
    path: Path, allow_lack_of_fit: bool = False
) -> tuple[TabledMachine, tuple[str, ...]]:
    """The machine of a machine file or of a map, and what is to be said of it.

    :raises ExperimentError: the file is invalid, what it says of corrections is undetermined, or
        the lack of fit is beyond the limit and not allowed.
    """
    if is_map_file(path):
        return of_map(read_map(path), path, allow_lack_of_fit)
    doubts: list[Message] = []
    machine = load_machine(path, doubts)
    truth = true_volumetric(machine)
    bends = tuple(
        np.array(
            [
                position
                for error in machine.errors
                if error.axis == axis and isinstance(error.shape, Points)
                for position in error.shape.positions
            ]
        )
        for axis in range(3)
    )
    lower, upper, zero = (
        np.array(vector) for vector in (machine.lower, machine.upper, machine.reference)
    )
    offsets = np.array([machine.probe])
    tabled = TabledMachine(machine.title, truth.model, truth.a, lower, upper, zero, offsets, bends)
    return tabled, tuple(map(str, doubts))


def of_map(
    fitted: FittedMap, source: object, allow_lack_of_fit: bool = False
) -> tuple[TabledMachine, tuple[str, ...]]:
    """The machine of a fitted map, the caution of its fit, and what of it is undetermined with
    other probes than its own.

    :raises ExperimentError: corrections with its own probes are undetermined, or the lack of fit is
        beyond the limit and not allowed.
    """
    lack = fitted.known_lack_of_fit
    if lack.is_beyond_limit and not allow_lack_of_fit:
        text = f"{lack.complaint}; only --allow-lack-of-fit (allow_lack_of_fit=True) makes a table"
        raise refused(source, f"{text} of this map")
    lower, upper = fitted.volume.lower, fitted.volume.upper
    offsets = fitted.probes.offsets
    machine = TabledMachine(
        fitted.title,
        fitted.model,
        fitted.values,
        lower,
        upper,
        lower,
        offsets,
        verdict=verdict_line(fitted.lack_of_fit),
    )
    remarks = (lack.caution,) if lack.caution else ()
    if _open_with(fitted, np.concatenate([np.zeros((1, len(lower))), offsets])):
        names = _open_functions(fitted)
        raise refused(
            source,
            f"leaves corrections undetermined, which a table cannot state ({listing(names)});"
            " measure the machine so that they are determined",
        )
    if _open_with(fitted, OFFSET * np.eye(len(lower))):
        named = listing(_open_functions(fitted))
        text = f"{named} are undetermined: the table is right for tools like the map's probes only"
        return machine, (*remarks, text)
    return machine, remarks


def _open_with(fitted: FittedMap, offsets: Array) -> bool:
    """True if corrections less those at the lower corner are undetermined with a probe of one of
    the offsets (k, d).
    """
    if not fitted.undetermined.shape[1]:
        return False
    x = grid_points(np.linspace(fitted.volume.lower, fitted.volume.upper, CHECKED).T)
    for offset in offsets:
        p = np.broadcast_to(offset, x.shape)
        by_parameter = fitted.model.jacobian(x, fitted.values, p)
        rows = np.zeros((*x.shape, len(fitted.scale)))
        rows[:, :, : len(fitted.values)] = by_parameter - by_parameter[:1]
        if np.isnan(fitted.standard_uncertainties(rows)).any():
            return True
    return False


def _open_functions(fitted: FittedMap) -> list[str]:
    touched = np.abs(fitted.undetermined / fitted.scale[:, None]).max(axis=1) > 1e-6
    return list(
        dict.fromkeys(
            parameter.function
            for parameter, is_open in zip(fitted.parameters, touched, strict=True)
            if is_open
        )
    )


def parse_lengths(text: str) -> tuple[float, ...]:
    """Lengths in metres, written with commas between them.

    :raises QuantityError: one is none.

    >>> parse_lengths("50 mm, 0.1 m")
    (0.05, 0.1)
    """
    return tuple(parse_length(part.strip()) for part in text.split(","))


def made_compensation(
    machine: TabledMachine,
    label: str,
    name: str,
    pitch: Sequence[float] | None = None,
    origin: Sequence[float] | None = None,
    sense: Sense | None = None,
    volumetric: bool = False,
    without_rotations: bool = False,
    remarks: tuple[str, ...] = (),
) -> MadeCompensation:
    """A table of a machine in the format of that name; lengths are in metres.

    :raises ValueError: the format cannot hold it, or the sense is not said.
    """
    made, d, reasons = FORMATS[name], machine.dimension, list[str]()
    meant = sense or made.sense
    if meant is None:
        reasons.append(
            f"{name} tables do not say which sign they have; choose the sense, corrections or"
            " errors of indication, as your controller takes them"
        )
    steps = zero = None
    if pitch is not None and len(pitch) not in (1, d):
        reasons.append(f"the pitch has {len(pitch)} lengths; give one, or {d}")
    elif pitch is not None and not min(pitch) > 0.0:
        reasons.append("the pitch should be above zero, such as 50 mm")
    elif pitch is not None:
        steps = np.broadcast_to(np.asarray(pitch, float), (d,))
    if origin is not None and len(origin) != d:
        reasons.append(f"the origin has {len(origin)} co-ordinates; give {d}")
    elif origin is not None:
        zero = np.asarray(origin, float)
    try:
        table = made_table(machine, made, steps, zero, volumetric, without_rotations)
    except CannotMakeError as error:
        reasons += error.reasons
    if reasons or meant is None:
        raise CannotMakeError(*reasons)
    return MadeCompensation(
        label, machine.title, made, meant, table.table, remarks, table, machine.verdict
    )


def read_compensation_files(
    paths: Sequence[Path],
    name: str,
    sense: Sense | None = None,
    arrangement: str | None = None,
    origin: Sequence[float] | None = None,
) -> ReadCompensation:
    """The table that files in the format of that name hold.

    :raises ExperimentError: the files are invalid, or leave open what nobody says.
    :raises ValueError: no arrangement.
    """
    own_arrangement = None if arrangement is None else parse_arrangement(arrangement)
    point = None if origin is None else tuple(origin)
    table, stated, notes = read_table_files(FORMATS[name], paths, sense, own_arrangement, point)
    title = listing(path.name for path in paths)
    return ReadCompensation(paths[0].stem, title, FORMATS[name], stated, table, notes)
