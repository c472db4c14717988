"""Numbers, units and columns as text."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

from ballplate.simulator.computing.numerics import printable

if TYPE_CHECKING:
    pass


# Plain data, as JSON has it once `as_data` has made it so.
Data = dict[str, Any]
# Unit of small values → unit in which tables show them, 1e-6 as large.
SHOWN = {
    "m": "µm",
    "rad": "µrad",
    "1": "ppm",
    "1/K": "ppm/K",
    "K": "µK",
    "m/h": "µm/h",
    "1/h": "ppm/h",
    "": "",
}


def amount_of(value: float, unit: str) -> tuple[float, str]:
    """Return a small value with its unit in tables.

    >>> amount_of(0.02, "K")
    (20.0, 'mK')
    """
    return (1e3 * value, "mK") if unit == "K" else (1e6 * value, shown_unit(unit))


def unit_of(unit: str) -> str:
    """Return the unit in which `amount_of` shows values of a unit.

    >>> unit_of("m"), unit_of("K")
    ('µm', 'mK')
    """
    return amount_of(0.0, unit)[1]


def shown_unit(unit: str) -> str:
    """Return the unit in which tables show values of a unit.

    >>> shown_unit("m, rad")
    'µm, µrad'
    """
    return ", ".join(SHOWN[part] for part in unit.split(", "))


def micro(text: str) -> str:
    """Return text with µ in units of micrometres and microradians.

    >>> micro("U2 maximum, um or urad"), micro("um")
    ('U2 maximum, µm or µrad', 'µm')
    """
    return re.sub(r"(^|, | or )u(m|rad)\b", r"\1µ\2", text)


def ascii_units(text: str) -> str:
    """Return text with u for µ in units, as programs read them.

    >>> ascii_units("U4 average, µm"), ascii_units("µm or µrad"), ascii_units("at 0.5 µm")
    ('U4 average, um', 'um or urad', 'at 0.5 µm')
    """
    return re.sub(r"(^|, | or |/)[µμ](m|rad)\b", r"\1u\2", text)


def number(value: float, digits: int = 4) -> str:
    """Return a number with significant digits, or a dash for NaN.

    >>> number(0.123456), number(12345.678), number(1.23456e-10), number(float("nan"))
    ('0.1235', '12350', '1.235e-10', '-')
    """
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    if value == 0:
        return "0"
    value = printable(value, digits + 5)
    decimals = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    magnitude = round(value, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{magnitude:.{decimals}f}" if decimals < 12 else f"{value:.{digits - 1}e}"


# P-values below this are shown as a bound.
LEAST_CHANCE_SHOWN = 1e-6


def chance_words(chance: float) -> str:
    """Return a p-value in two digits, a bound of a tiny one, or a dash for NaN.

    >>> chance_words(0.0345), chance_words(1e-300), chance_words(float("nan"))
    ('0.035', '<1e-06', '-')
    """
    if math.isnan(chance):
        return "-"
    return f"{chance:.2g}" if chance >= LEAST_CHANCE_SHOWN else f"<{LEAST_CHANCE_SHOWN:.0e}"


def fixed(value: float, decimals: int) -> str:
    """Return a number with `decimals` decimals; zero has no sign.

    >>> fixed(-1e-9, 2), fixed(1.005e3, 1)
    ('0.00', '1005.0')
    """
    return f"{round(float(value), decimals) + 0.0:.{decimals}f}"


def percent(share: float) -> str:
    """Return a share as text, never rounded up.

    >>> percent(0.99999), percent(0.125)
    ('99.99 %', '12.5 %')
    """
    return f"{math.floor(1e4 * share + 1e-9) / 100:g} %"


def uncertainty_words(coverage_factor: float) -> str:
    """Return the name of the uncertainty that a target is compared with.

    >>> uncertainty_words(1.0), uncertainty_words(2.0)
    ('standard uncertainty u', 'expanded uncertainty U = 2 u')
    """
    return (
        "standard uncertainty u"
        if coverage_factor == 1.0
        else f"expanded uncertainty U = {coverage_factor:g} u"
    )


def to_uncertainty(value: float, uncertainty: float) -> str:
    """Return a value to the third digit of its standard uncertainty; zero has no sign.

    >>> to_uncertainty(50000.2134, 0.169), to_uncertainty(-0.0421495, 0.597)
    ('50000.213', '-0.042')
    >>> to_uncertainty(-1e-9, 30.0)
    '0.0'
    >>> to_uncertainty(12.0, float("nan"))
    '12.0000'
    """
    if math.isnan(value) or not uncertainty > 0.0:
        return number(value, 6)
    return f"{value:z.{max(2 - math.floor(math.log10(uncertainty)), 0)}f}"


def aligned(rows: Sequence[Sequence[str]], right: Sequence[bool]) -> list[str]:
    """Return rows of cells as lines of text with aligned columns.

    >>> aligned([["a", "1"], ["bb", "22"]], [False, True])
    ['a    1', 'bb  22']
    """
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            cell.rjust(width) if to_right else cell.ljust(width)
            for cell, width, to_right in zip(row, widths, right, strict=True)
        ]
        lines.append("  ".join(cells).rstrip())
    return lines


def finite(value: float) -> float | None:
    """Return a value for JSON: None for NaN and infinity."""
    return value if math.isfinite(value) else None


def as_data(value: Any) -> Any:
    """Return a result for JSON: objects as mappings of fields, arrays as lists, NaN as None.

    >>> as_data({"u": (0.5, math.nan)})
    {'u': [0.5, None]}
    """
    if is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in fields(value)}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, dict):
        return {key: as_data(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [as_data(item) for item in value]
    return finite(value) if isinstance(value, float) else value


def records(**columns: Any) -> list[Data]:
    """Return columns of equal length as one mapping per row.

    >>> records(x=(1, 2), y="ab")
    [{'x': 1, 'y': 'a'}, {'x': 2, 'y': 'b'}]
    """
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def by_name(items: Iterable[Any], *names: str) -> dict[str, Data]:
    """Return some attributes of objects, by the objects' names."""
    return {item.name: picked(item, *names) for item in items}


def given(**values: Any) -> Data:
    """Return the values that are not empty.

    >>> given(tasks=[], title="plate")
    {'title': 'plate'}
    """
    return {name: value for name, value in values.items() if value}


def picked(source: object, *names: str) -> Data:
    """Return some attributes of an object by their names.

    >>> picked(1 + 2j, "real", "imag")
    {'real': 1.0, 'imag': 2.0}
    """
    return {name: getattr(source, name) for name in names}
