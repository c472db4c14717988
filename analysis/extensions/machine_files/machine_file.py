"""Loading of a machine file and the tables that it names, with all errors in them."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.experiment import VolumeSettings, check_ends
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import (
    UNKNOWN,
    ExperimentError,
    Mapping,
    Message,
    Problems,
    Scalar,
    Steps,
    Trust,
    describe,
    format_angle,
    format_length,
    in_order,
    listing,
    read_tree,
    to_python,
    validated,
)
from ballplate.simulator.machines import arrangement_of
from ballplate.simulator.splines import SplineError, SplineProblem, at_every
from pydantic import ValidationError

from .curves import NAMES, Points
from .description import (
    AxisTemperature,
    MachineDescription,
    ParametricError,
    PowerSeries,
    Squareness,
    Three,
)
from .error_tables import ErrorTable, read_error_table
from .machine_sections import DescribedMachineSettings, SmoothingSettings
from .volumetric import DROOP, SQUARENESS

# Part of a polynomial's coefficients that is rounding.
NOTHING = 1e-12


def load_machine(
    path: str | os.PathLike[str],
    doubts: list[Message] | None = None,
    trust: Trust = UNKNOWN,
) -> MachineDescription:
    """Load a machine file. Tables that it names are read from its folder.

    Statements without effect, which are probably meant otherwise, are added to `doubts`.

    :raises ExperimentError: the file, or a table it names, is invalid; holds all faults found.
    """
    source = Path(path)
    refused: list[Any] = []
    root = read_tree(source, refused)
    problems = Problems(root)
    if not isinstance(root, Mapping):
        problems.add(
            (), f"expected a mapping that begins with title: …, found {describe(to_python(root))}"
        )
    elif "positions" in root.items or "axes" in root.items and "base" in root.items:
        text = (
            "this is an experiment or a sweep; name a machine file, with arrangement, volume and"
            " errors"
        )
        problems.add((), text)
    else:
        problems.add_empty()
        machine = _machine(root, source, problems, trust)
        if machine is not None and not refused:
            if doubts is not None:
                _doubt_what_is_taken_off(machine, problems)
                doubts += problems.doubts
            return machine
    raise ExperimentError(in_order(problems.messages, refused, source))


def _machine(
    root: Mapping, source: Path, problems: Problems, trust: Trust
) -> MachineDescription | None:
    settings = validated(DescribedMachineSettings, root, problems)
    if settings is None:
        _volume_of(root, problems)
        # Tables are told about as well, where the keys that name them can be read.
        _read_tables(root, source, problems, trust)
        return None
    machine = _bare(settings, problems)
    if machine is None:
        _read_tables(root, source, problems, trust)
        return None
    errors = tuple(_errors(settings, machine, source, problems, trust))
    squareness = []
    for name in SQUARENESS:
        stated = getattr(settings.squareness, name, None)
        if isinstance(stated, float):
            squareness.append(Squareness(name, stated))
        elif stated is not None:
            _inside(stated.at, machine, ("squareness", name, "at"), problems)
            squareness.append(
                Squareness(name, stated.value, stated.at, (stated.bandwidth or 0.0) / stated.sigmas)
            )
    return (
        None if problems.messages else replace(machine, errors=errors, squareness=tuple(squareness))
    )


def _bare(settings: DescribedMachineSettings, problems: Problems) -> MachineDescription | None:
    """The machine without its errors."""
    volume = settings.volume
    if isinstance(volume, tuple):
        ends = [(0.0, edge) for edge in volume]
    else:
        if volume.z is None:
            problems.add(("volume", "z"), "missing; a machine file has three axes")
            return None
        ends = [volume.x, volume.y, volume.z]
    check_ends(dict(zip(AXIS_NAMES, ends, strict=True)), ("volume",), problems)
    # What else is wrong is told with the ends exchanged, or without any.
    ends = [
        (min(pair), max(pair)) if pair[0] != pair[1] else (-math.inf, math.inf) for pair in ends
    ]
    name = settings.arrangement if isinstance(settings.arrangement, str) else ""
    droop = {} if settings.droop is None else settings.droop.stated
    if droop and name not in DROOP:
        text = (
            f"only the arm of {listing(DROOP)} droops; leave it out, or name one of them as"
            " arrangement"
        )
        problems.add(("droop",), text, of_key=True)
    bottom, top = (_three(end) for end in zip(*ends, strict=True))
    temperature: dict[str, AxisTemperature] = {
        axis: AxisTemperature(
            excess.expansion, excess.deviation, excess.standard_uncertainty or 0.0
        )
        for axis, excess in (settings.temperature or {}).items()
    }
    machine = MachineDescription(
        title=settings.title,
        arrangement_name=name,
        arrangement=arrangement_of(settings.arrangement),
        lower=bottom,
        upper=top,
        reference=bottom if settings.reference_point is None else settings.reference_point,
        probe=settings.probe or (0.0, 0.0, 0.0),
        interpolation=settings.interpolation,
        criterion=settings.straightness,
        temperature=temperature,
        droop=droop,
        probing=settings.probing or 0.0,
    )
    if _inside(settings.reference_point, machine, ("reference_point",), problems):
        return machine
    return replace(machine, reference=bottom)


def _volume_of(root: Mapping, problems: Problems) -> None:
    """Report faults of the volume of a file that has other faults."""
    try:
        volume = VolumeSettings.model_validate(to_python(root).get("volume"))
    except ValidationError:
        return
    check_ends(volume.stated, ("volume",), problems)


def _three(values: Iterable[float]) -> Three:
    x, y, z = values
    return x, y, z


def _errors(
    settings: DescribedMachineSettings,
    machine: MachineDescription,
    source: Path,
    problems: Problems,
    trust: Trust,
) -> Iterable[ParametricError]:
    for name in NAMES:
        one = getattr(settings.errors, name, None)
        if one is None:
            continue
        steps = ("errors", name)
        random = None if one.bandwidth is None else one.bandwidth / one.sigmas
        error = ParametricError(name, criterion=machine.criterion, deviation=random)
        if one.polynomial is not None:
            line = _line(one.line, machine, error.axis, (*steps, "line"), problems)
            criterion = getattr(one, "straightness", None) or machine.criterion
            shape = PowerSeries(one.polynomial)
            probe = one.probe or (0.0, 0.0, 0.0)
            on_table = getattr(one, "straightedge", None) is not None
            _check_table(on_table, machine, error.axis, (*steps, "straightedge"), problems)
            yield replace(
                error, shape=shape, line=line, probe=probe, criterion=criterion, on_table=on_table
            )
        elif one.file is not None:
            ends = machine.lower[error.axis], machine.upper[error.axis]
            covered = ends if math.isfinite(ends[0]) else None
            table = _table(source, one.file, name, covered, (*steps, "file"), problems, trust)
            if table is None:
                continue
            line = _complete(table.line, machine, error.axis)
            _inside(line, machine, (*steps, "file"), problems)
            if table.bandwidth is not None:
                if random is not None:
                    problems.add(
                        (*steps, "bandwidth"),
                        "the file has a bandwidth as well; leave one of the two out",
                    )
                deviations = tuple(value / one.sigmas for value in table.bandwidth.values)
                error = replace(error, deviation=Points(table.bandwidth.positions, deviations))
            _check_table(table.on_table, machine, error.axis, (*steps, "file"), problems)
            error = replace(error, line=line, probe=table.probe, on_table=table.on_table)
            points = table.points
            if one.fit is not None:
                points = _smoothed(points, one.fit, (*steps, "fit"), problems)
            yield replace(error, shape=points, criterion=table.criterion or machine.criterion)
        else:
            yield error


def _smoothed(
    points: Points, settings: SmoothingSettings, steps: Steps, problems: Problems
) -> Points:
    """Return the requested least-squares spline, or the points after reporting why it is
    impossible.
    """
    x = np.asarray(points.positions)
    knots = tuple(sorted(settings.knots or ()))
    if settings.every is not None:
        knots = at_every(x, settings.every, float(x[0]), float(x[-1]))
    smoothed = Points(points.positions, points.values, settings.order, knots)
    try:
        if len(x) < settings.order + len(knots):
            text = f"{len(x)} points do not determine {settings.order + len(knots)} coefficients"
            raise SplineError([SplineProblem(f"{text}; lower the order, or leave knots out")])
        smoothed.fitted  # noqa: B018
    except SplineError as error:
        for problem in error.problems:
            problems.add(steps, problem.told(format_length))
        return points
    return smoothed


def _doubt_what_is_taken_off(machine: MachineDescription, problems: Problems) -> None:
    """Say what of stated polynomials makes no difference: a straight line through end points, and a
    constant.
    """
    for error in machine.errors:
        if not isinstance(error.shape, PowerSeries):
            continue
        steps, show = (
            ("errors", error.name, "polynomial"),
            format_angle if error.is_rotation else format_length,
        )
        t0 = float(machine.scaled(error.axis, machine.reference[error.axis]))
        start, end, there = error.shape.values(np.array([0.0, 1.0, t0]))[:, 0].tolist()
        if error.is_straightness and error.criterion == "end points":
            if max(abs(start), abs(end)) > NOTHING * sum(map(abs, error.shape.coefficients)):
                problems.doubt(
                    steps,
                    f"the straight line through its end points, from {show(start)} to {show(end)},"
                    " is subtracted, because it is not straightness; let the polynomial begin"
                    " and end at zero, and state a slope as squareness",
                )
        elif not error.is_straightness and abs(there) > NOTHING * sum(
            map(abs, error.shape.coefficients)
        ):
            text = (
                f"{show(there)} is subtracted, because errors are zero at the reference point;"
                " correct the constant"
            )
            problems.doubt(steps, text)


def _table(
    source: Path,
    file: str,
    name: str,
    ends: tuple[float, float] | None,
    steps: Steps,
    problems: Problems,
    trust: Trust,
) -> ErrorTable | None:
    try:
        table = read_error_table(trust.file(source.parent, file), name, ends)
    except ExperimentError as error:
        problems.take(error, steps)
        return None
    if table.note:
        problems.doubt(steps, f"{file}: {table.note}")
    return table


def _read_tables(root: Mapping, source: Path, problems: Problems, trust: Trust) -> None:
    """Report faults of the tables of a file that has other faults."""
    errors = root.items.get("errors")
    for name, node in errors.items.items() if isinstance(errors, Mapping) else ():
        file = node.items.get("file") if isinstance(node, Mapping) else None
        if name in NAMES and isinstance(file, Scalar) and isinstance(file.value, str):
            steps = ("errors", name, "file")
            _table(source, file.value, name, None, steps, problems, trust)


def _line(
    values: dict[str, float] | None,
    machine: MachineDescription,
    axis: int,
    steps: Steps,
    problems: Problems,
) -> Three | None:
    if values is None:
        return None
    if AXIS_NAMES[axis] in values:
        problems.add(
            (*steps, AXIS_NAMES[axis]),
            f"the line runs along {AXIS_NAMES[axis]}; leave it out",
            of_key=True,
        )
        return None
    line = _complete(values, machine, axis)
    _inside(line, machine, steps, problems)
    return line


def _complete(values: dict[str, float], machine: MachineDescription, axis: int) -> Three | None:
    """Positions of all axes, those not stated being the reference point's."""
    if not values:
        return None
    x, y, z = (
        values.get(key, machine.reference[k]) if k != axis else machine.reference[k]
        for k, key in enumerate(AXIS_NAMES)
    )
    return x, y, z


def _inside(
    point: Three | None, machine: MachineDescription, steps: Steps, problems: Problems
) -> bool:
    is_inside = True
    for k, value in enumerate(point or ()):
        if not machine.lower[k] <= value <= machine.upper[k]:
            text = (
                f"{AXIS_NAMES[k]} = {format_length(value)} is outside the volume"
                f" ({format_length(machine.lower[k])} to {format_length(machine.upper[k])});"
                " correct one of the two"
            )
            problems.add(steps, text)
            is_inside = False
    return is_inside


def _check_table(
    on_table: bool, machine: MachineDescription, axis: int, steps: Steps, problems: Problems
) -> None:
    if on_table and AXIS_NAMES[axis] not in machine.arrangement.workpiece_side:
        problems.add(
            steps, f"the {AXIS_NAMES[axis]} axis moves no table; leave straightedge: table out"
        )
