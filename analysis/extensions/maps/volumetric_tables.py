"""Volumetric errors as text for people, as CSV and as plain data for programs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from ballplate.presentation import (
    SHOWN,
    Data,
    aligned,
    by_axis,
    fixed,
    given,
    number,
    picked,
    records,
    table_csv,
    table_lines,
)
from ballplate.simulator.computing import comparable
from ballplate.simulator.inputs import format_length
from ballplate.simulator.machines import (
    AXES,
    SQUARENESS,
    Arrangement,
    Array,
    Parameter,
    SmoothedPoints,
    meaning,
    symbol,
)

from .realisations import Realisations
from .volumetric_errors import (
    AlongAxis,
    LengthErrors,
    Volumetric,
    VolumetricErrors,
    along_axes,
)

CONVENTION = (
    "errors are the tip's position less that of the scales: corrections, to be added to readings"
)
RANDOM = (
    "random: one standard deviation; parts new at each approach and lasting ones, in quadrature"
)


def machine_lines(built: Volumetric) -> list[str]:
    """Return a description of the machine and its parametric errors."""
    machine = built.machine
    name = f"{machine.arrangement_name}: " if machine.arrangement_name else ""
    lines = [machine.title, f"{name}{_chain(machine.arrangement)}; {CONVENTION}", ""]
    rows = [["", "symbol", "error", "range", "random", "unit", "stated as"]]
    for function in along_axes(machine):
        name = function.error.name
        random = "" if function.deviation is None else number(1e6 * function.deviation.max())
        range_text = "" if function.values is None else number(1e6 * function.range)
        rows.append(
            [
                name,
                symbol(name),
                meaning(name),
                range_text,
                random,
                _unit(function),
                _stated_as(function),
            ]
        )
    lines += (
        aligned(rows, [False, False, False, True, True, False, False])
        if len(rows) > 1
        else ["no errors of axes"]
    )
    other_rows = [
        [
            parameter.name,
            symbol(parameter.name) if parameter.name in SQUARENESS else "",
            _meaning_text(parameter),
            number(1e6 * value),
            "ppm" if parameter.unit == "1" else SHOWN[parameter.unit],
        ]
        for parameter, value in built.numbers
    ]
    lines += ["", *aligned(other_rows, [False, False, False, True, False])] if other_rows else []
    return [*lines, *(["", RANDOM] if built.is_random else [])]


def _chain(arrangement: Arrangement) -> str:
    sides = []
    for side, load in (
        (arrangement.probe_side, "the probe"),
        (arrangement.workpiece_side, "the workpiece"),
    ):
        if side:
            sides.append(" carries ".join([*side, load]))
    return ", ".join(sides)


def _stated_as(along: AlongAxis) -> str:
    error = along.error
    if along.values is None:
        return "random"
    form = "polynomial"
    if along.measured is not None:
        form = f"table of {len(along.measured.positions)} points"
    if isinstance(along.measured, SmoothedPoints):
        sigma = number(1e6 * along.measured.fitted.sigma, 2)
        curve = "spline" if along.measured.knots else "polynomial"
        form = f"{curve} fitted to the {form}, sigma {sigma} {_unit(along)}"
    if error.line is not None and not error.is_rotation:
        fixed_axes = [k for k in range(3) if k != error.axis]
        form += " at " + ", ".join(
            f"{AXES[k]} = {format_length(error.line[k])}" for k in fixed_axes
        )
    return form + (f", {error.criterion}" if error.is_straightness else "")


def _meaning_text(parameter: Parameter) -> str:
    is_droop = parameter.name in ("phi1", "phi2")
    return parameter.meaning + (", over the whole axis" if is_droop else "")


def diagonal_lines(errors: LengthErrors) -> list[str]:
    """Length errors of the body diagonals."""
    columns = {
        "body diagonal": [str(k + 1) for k in range(len(errors.errors))],
        "from": list(map(point_text, errors.starts)),
        "to": list(map(point_text, errors.ends)),
        "length, mm": (errors.nominal, lambda value: f"{1e3 * value:.3f}"),
        "error, µm": errors.errors,
        "random, µm": errors.uncertainties,
    }
    return table_lines(columns, without=None if errors.uncertainties.any() else "random, µm")


def length_line(errors: LengthErrors) -> str:
    """The length error of a single line."""
    u = errors.uncertainties
    random = f", random {number(1e6 * u[0])} µm" if u.any() else ""
    return (
        f"length {1e3 * errors.nominal[0]:.3f} mm, length error"
        f" {number(1e6 * errors.errors[0])} µm{random}"
    )


def error_lines(errors: VolumetricErrors) -> list[str]:
    """Errors point by point, and their extremes."""
    columns = [
        *by_axis("{}, mm", errors.points, millimetres).items(),
        *by_axis("{}, µm", errors.errors, _two_decimals, "XYZ").items(),
        ("resultant", (errors.resultant, _two_decimals)),
    ]
    if errors.uncertainties.any():
        random = by_axis("{}", errors.uncertainties, _two_decimals, ("random X", "Y", "Z"))
        columns += random.items()
    return [*table_lines(columns), *extreme_lines(errors)]


def extreme_lines(errors: VolumetricErrors) -> list[str]:
    """Ranges of the components, and the largest resultant."""
    worst = int(comparable(errors.resultant).argmax())
    location = ", ".join(
        f"{axis} = {format_length(v)}"
        for axis, v in zip(AXES, errors.points[worst].tolist(), strict=True)
    )
    bands = ", ".join(
        f"{axis.upper()} {number(1e6 * np.ptp(errors.errors[:, k]))}" for k, axis in enumerate(AXES)
    )
    resultant = errors.resultant
    return [
        (
            f"range in µm: {bands}, resultant {number(1e6 * np.ptp(resultant))}; "
            f"largest resultant {number(1e6 * resultant[worst])} µm at {location}"
        ),
    ]


def _two_decimals(value: float) -> str:
    return fixed(1e6 * value, 2)


def errors_csv(
    errors: VolumetricErrors,
    realisations: Realisations | None,
    columns: Callable[[VolumetricErrors], Data],
    names: Sequence[str] = (),
) -> Iterator[str]:
    """Yield the columns of errors as lines of a CSV file, with `names` of points; with
    realisations, which have no uncertainties, the first column numbers them, 0 for the estimate.
    """
    none = np.full_like(errors.uncertainties, np.nan)
    drawn = [] if realisations is None else list(realisations.errors)
    tables = [errors, *(VolumetricErrors(errors.points, values, none) for values in drawn)]
    points = given(point=list(names))
    for i, table in enumerate(tables):
        numbers = {"realisation": [i] * len(table.points)} if len(tables) > 1 else {}
        # The headings stand above the first table alone.
        yield from table_csv({**numbers, **points, **columns(table)})[int(i > 0) :]


def _unit(along: AlongAxis) -> str:
    return SHOWN[along.unit]


def machine_data(built: Volumetric) -> Data:
    """Return the machine and its parametric errors, in metres and radians."""
    machine = built.machine
    functions = {
        function.error.name: {
            "symbol": symbol(function.error.name),
            "unit": function.unit,
            "range": None if function.values is None else function.range,
            "random": None if function.deviation is None else function.deviation.max(),
        }
        for function in along_axes(machine)
    }
    return {
        "machine": machine.title,
        "arrangement": machine.arrangement_name or None,
        **picked(machine.arrangement, "probe_side", "workpiece_side"),
        "convention": CONVENTION,
        "parametric_errors": functions,
        "other_errors": {
            parameter.name: {
                "value": value,
                "unit": parameter.unit,
                "meaning": _meaning_text(parameter),
            }
            for parameter, value in built.numbers
        },
    }


def error_columns(errors: VolumetricErrors) -> Data:
    """Columns of errors point by point."""
    return {
        **by_axis("{}, mm", errors.points),
        **by_axis("error {}, µm", errors.errors),
        "resultant, µm": errors.resultant,
        **by_axis("random {}, µm", errors.uncertainties),
    }


def length_data(errors: LengthErrors) -> list[Data]:
    """Length errors, in metres."""
    ends = {"from": errors.starts, "to": errors.ends}
    return records(**ends, length=errors.nominal, error=errors.errors, random=errors.uncertainties)


def error_data(errors: VolumetricErrors) -> list[Data]:
    """Errors point by point, in metres."""
    return records(
        position=errors.points,
        error=errors.errors,
        resultant=errors.resultant,
        random=errors.uncertainties,
    )


def millimetres(value: float) -> str:
    """A length in millimetres."""
    return f"{1e3 * value + 0.0:.10g}"


def point_text(point: Array) -> str:
    """A point, in millimetres."""
    return f"({', '.join(map(millimetres, point))})"
