"""Error functions of a machine along their axes, squareness errors, and other numbers, with the
uncertainties of a fit or the random parts that a machine file states.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.presentation import SHOWN, number
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import format_length, hint
from ballplate.simulator.machines import SQUARENESS_ERRORS, Array, HasLines, SquarenessError, Unit

from ..machine_files import FittedMap, meaning
from .volumetric_errors import AlongAxis, Volumetric, along_axes

# Positions along each line.
POSITIONS = 41

OF_MODEL = "a parameter of the model"
OF_FILE = "stated, at the reference point"
OF_ENDS = "from the ends of the volume's edges at its lower corner"


@dataclass(frozen=True, eq=False)
class FunctionCurve:
    """An error function along a line: `values` and standard `uncertainties` (m,) in `unit` at
    `positions` (m,) in metres of its `axis`; NaN where undetermined.

    Without an axis, positions are fractions of the line; `line` names one of several. `source` is
    how a machine file states it.
    """

    name: str
    meaning: str
    unit: Unit
    line: str
    axis: int | None
    positions: Array
    values: Array
    uncertainties: Array
    source: str = ""

    @property
    def is_undetermined(self) -> bool:
        """True if the curve is undetermined except where the frame fixes it at zero."""
        return not (self.uncertainties > 0.0).any() and bool(np.isnan(self.uncertainties).any())


@dataclass(frozen=True)
class EstimatedNumber:
    """An error that is a single number in `unit`, with its standard uncertainty and `source`; NaN
    if undetermined.
    """

    name: str
    meaning: str
    unit: Unit
    value: float
    standard_uncertainty: float
    source: str = OF_MODEL


@dataclass(frozen=True, eq=False)
class ErrorFunctions:
    """All error functions of a map, its squareness errors, and its other numbers."""

    curves: tuple[FunctionCurve, ...]
    squareness: tuple[EstimatedNumber, ...]
    numbers: tuple[EstimatedNumber, ...]


@single_threaded
def error_functions(
    fitted: FittedMap, names: Collection[str] = (), positions: int = POSITIONS
) -> ErrorFunctions:
    """Return the error functions of a map at a number of positions, or those named.

    :raises ValueError: there is none of a name.
    """
    curves = []
    numbers: list[EstimatedNumber] = []
    functions = dict.fromkeys(parameter.function for parameter in fitted.model.parameters)
    for name in functions:
        own_curves = list(_curves(fitted, name, positions))
        curves += own_curves
        numbers += [] if own_curves else _numbers(fitted, name)
    own_names = {error.name for error in numbers}
    numbers += [end for end in _by_ends(fitted) if end.name not in own_names]
    return _named("map", curves, numbers, names, functions)


def stated_functions(
    built: Volumetric, names: Collection[str] = (), positions: int = POSITIONS
) -> ErrorFunctions:
    """Return the errors that a machine file states, zero where only their random part is stated.

    :raises ValueError: there is none of a name.
    """
    curves = []
    for along in along_axes(built.machine, positions):
        error, none = along.error, np.zeros(len(along.positions))
        values = none if along.values is None else along.values
        deviation = none if along.deviation is None else along.deviation
        description = error.name, meaning(error.name), along.unit, "", error.axis
        stated = _stated_as(along)
        curves.append(FunctionCurve(*description, along.positions, values, deviation, stated))
    names_of_lasting, sizes = built.random.names[1], built.random.sizes.tolist()
    deviations = dict(zip(names_of_lasting, sizes, strict=True))
    numbers = [
        EstimatedNumber(
            *(parameter.name, parameter.meaning, parameter.unit, value),
            deviations.get(parameter.name, 0.0),
            OF_FILE,
        )
        for parameter, value in built.numbers
    ]
    return _named("machine", curves, numbers, names)


def _stated_as(along: AlongAxis) -> str:
    error, measured = along.error, along.measured
    if along.values is None:
        return "random"
    form = "polynomial" if measured is None else f"table of {len(measured.positions)} points"
    if measured is not None and measured.order:
        sigma = number(1e6 * measured.fitted.sigma, 2)
        curve = "spline" if measured.knots else "polynomial"
        form = f"{curve} fitted to the {form}, sigma {sigma} {SHOWN[along.unit]}"
    if error.line is not None and not error.is_rotation:
        fixed_axes = [k for k in range(3) if k != error.axis]
        form += " at " + ", ".join(
            f"{AXIS_NAMES[k]} = {format_length(error.line[k])}" for k in fixed_axes
        )
    return form + (f", {error.criterion}" if error.is_straightness else "")


def _named(
    source: str,
    curves: Sequence[FunctionCurve],
    numbers: Sequence[EstimatedNumber],
    names: Collection[str],
    others: Iterable[str] = (),
) -> ErrorFunctions:
    """Return all errors, or those of the names, numbers of squareness separately.

    :raises ValueError: there is none of a name.
    """
    every = [*others, *(curve.name for curve in curves), *(error.name for error in numbers)]
    known = dict.fromkeys(every)
    for name in names:
        if name not in known:
            raise ValueError(f'the {source} has no error "{name}"; {hint(name, known)}')
    chosen = [error for error in numbers if not names or error.name in names]
    return ErrorFunctions(
        tuple(curve for curve in curves if not names or curve.name in names),
        tuple(error for error in chosen if error.name in SQUARENESS_ERRORS),
        tuple(error for error in chosen if error.name not in SQUARENESS_ERRORS),
    )


def _columns(fitted: FittedMap, name: str) -> list[int]:
    return [k for k, parameter in enumerate(fitted.model.parameters) if parameter.function == name]


def _curves(fitted: FittedMap, name: str, positions: int) -> Iterator[FunctionCurve]:
    """Yield the function along its lines; empty for a single number."""
    model, t = fitted.model, np.linspace(0.0, 1.0, positions)
    if not isinstance(model, HasLines) or name in SQUARENESS_ERRORS:
        return
    columns = _columns(fitted, name)
    parameter = model.parameters[columns[0]]
    lower, size = fitted.volume.lower, fitted.volume.size
    for line in model.lines(name, t):
        if not np.ptp(line.basis, axis=0).any():
            continue
        rows = np.zeros((len(t), len(fitted.scale)))
        rows[:, columns] = line.basis
        u = fitted.standard_uncertainties(rows)
        values = np.where(np.isnan(u), np.nan, rows[:, columns] @ fitted.values[columns])
        where = t if line.axis is None else lower[line.axis] + t * size[line.axis]
        description = name, parameter.meaning, parameter.unit, line.words, line.axis
        yield FunctionCurve(*description, where, values, u)


def _numbers(fitted: FittedMap, name: str) -> Iterator[EstimatedNumber]:
    """The parameters of a function that is no curve."""
    for k in _columns(fitted, name):
        parameter = fitted.model.parameters[k]
        u = float(fitted.standard_uncertainties(np.eye(len(fitted.scale))[k]))
        value = float("nan") if np.isnan(u) else float(fitted.values[k])
        yield EstimatedNumber(parameter.name, parameter.meaning, parameter.unit, value, u)


def _by_ends(fitted: FittedMap) -> Iterator[EstimatedNumber]:
    """Squareness errors from the straight lines through the ends of two edges, with the tip at the
    machine's own point; those that the model holds at zero are left out.
    """
    volume, d = fitted.volume, fitted.dimension
    for squareness in SQUARENESS_ERRORS.values():
        if d == 2 and not squareness.in_plane:
            continue
        points = np.tile(volume.lower, (3, 1))
        points[1, squareness.axis], points[2, squareness.to] = (
            volume.upper[squareness.axis],
            volume.upper[squareness.to],
        )
        none = np.zeros_like(points)
        value = _angle(squareness, fitted.model.error(points, fitted.values, none), volume.size)
        rows = np.zeros((2, len(fitted.scale)))
        for row, a in zip(rows, (fitted.values, np.zeros_like(fitted.values)), strict=True):
            slopes = fitted.model.jacobian(points, a, none)
            row[: len(a)] = _angle(squareness, slopes, volume.size)
        u = float(fitted.standard_uncertainties(*rows))
        if np.isnan(u):
            yield EstimatedNumber(
                squareness.name, squareness.meaning, "rad", np.nan, np.nan, OF_ENDS
            )
        elif u > 0.0 or value:
            yield EstimatedNumber(
                squareness.name, squareness.meaning, "rad", float(value), u, OF_ENDS
            )


def _angle(squareness: SquarenessError, errors: Array, size: Array) -> Array:
    """The turn of an axis, from errors (3, d, ...) at the corner and at the ends of both edges."""
    of_axis = (errors[1, squareness.to] - errors[0, squareness.to]) / size[squareness.axis]
    of_other = (errors[2, squareness.axis] - errors[0, squareness.axis]) / size[squareness.to]
    return squareness.sign * (of_axis + of_other)
