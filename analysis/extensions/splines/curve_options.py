"""Options of an error curve, as texts with units, and the fitted curve."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields

from ballplate.simulator.inputs import (
    KINDS,
    QuantityError,
    hint,
    metres_or_radians,
    parse_angle,
    parse_length,
    parse_ratio,
)

from .error_curve import EVERY, CurveSettings, Hold, Place
from .read_points import Column, CurvePoints

# A polynomial through so many points keeps seven digits; with each further order it loses nearly
# one.
MOST_ORDER = 16


class OptionError(ValueError):
    """An option's value cannot be used."""


@dataclass(frozen=True)
class Asked:
    """What is asked for, as the options of `ballplate spline` have it; texts have units.

    `at` has places, the word value or slope, and what it is there.
    """

    every: int | None = None
    knots: str | None = None
    order: int = 4
    start: str = "start"
    end: str = "end"
    boundary: Sequence[str] = ()
    corner: Sequence[str] = ()
    straight: Sequence[int] = ()
    start_value: str | None = None
    start_slope: str | None = None
    end_value: str | None = None
    end_slope: str | None = None
    at: Sequence[tuple[str, str, str]] = ()
    periodic: bool = False
    period: str | None = None
    uncertainty: str | None = None
    evaluate: str | None = None


# Types of what is asked for that is no text.
TYPES = {"every": int, "order": int, "periodic": bool}
LISTS = ("boundary", "corner", "straight", "at")


def ensure_asked(options: Mapping[str, object]) -> None:
    """Refuse what cannot be asked for of a curve.

    :raises TypeError: an unknown name, or another kind of value.
    """
    names = [field.name for field in fields(Asked)]
    for name, value in options.items():
        if name not in names:
            raise TypeError(f'"{name}" is unknown; {hint(name, names)}')
        kind = TYPES.get(name, str)
        if name in LISTS:
            if isinstance(value, str) or not isinstance(value, Sequence):
                raise TypeError(f"{name}={value!r}; give a list")
        elif value is not None and not isinstance(value, kind):
            words = {int: "a whole number", bool: "True or False", str: "a text with a unit"}
            raise TypeError(f"{name}={value!r}; give {words[kind]}")


def curve_settings(options: Asked, points: CurvePoints) -> CurveSettings:
    """What the options ask for.

    :raises OptionError: a value that is no length, angle or slope.
    """
    x, y = points.x_column, points.y_column
    holds = []
    for end in ("start", "end"):
        for derivative, quantity_name in enumerate(("value", "slope")):
            text = getattr(options, f"{end}_{quantity_name}")
            if text is not None:
                holds.append(
                    Hold(
                        end, derivative, _value(f"--{end}-{quantity_name}", text, derivative, x, y)
                    )
                )
    for place, quantity_name, text in options.at:
        if quantity_name not in ("value", "slope"):
            raise OptionError(
                f'--at: "{quantity_name}" should be value or slope, as in --at "30 mm" slope 0'
            )
        derivative = ("value", "slope").index(quantity_name)
        holds.append(
            Hold(_place("--at", place, x), derivative, _value("--at", text, derivative, x, y))
        )
    knots = None
    if options.knots is not None:
        knots = (
            ()
            if options.knots.strip() == "none"
            else tuple(sorted(listed("--knots", options.knots, x)))
        )
    if not 2 <= options.order <= MOST_ORDER:
        raise OptionError(f"--order should be 2 to {MOST_ORDER}; 4 is a cubic spline")
    period = None
    if options.period is not None:
        period = positive(options.period, x, "--period")
    elif options.periodic:
        if x.kind == "length":
            raise OptionError(
                '--periodic: the abscissa is a length; state the period, as in --period "10 mm"'
            )
        period = positive("360 deg", x)
    if options.start.strip() == "end" or options.end.strip() == "start":
        raise OptionError(
            "the curve starts at its start and ends at its end; give other values of --start and"
            " --end"
        )
    return CurveSettings(
        order=options.order,
        every=options.every or EVERY,
        knots=knots,
        start=_place("--start", options.start, x),
        end=_place("--end", options.end, x),
        boundaries=tuple(_place("--boundary", text, x) for text in options.boundary),
        corners=tuple(_place("--corner", text, x) for text in options.corner),
        straight=tuple(options.straight),
        holds=tuple(holds),
        period=period,
    )


def _parser(kind: str) -> Callable[[object], float]:
    return parse_length if kind == "length" else parse_angle


def _quantity(option: str, text: str, kind: str) -> float:
    if text.strip() in ("0", "-0", "0.0"):
        return 0.0
    try:
        return _parser(kind)(text)
    except QuantityError as error:
        raise OptionError(f"{option}: {error}") from None


def positive(text: str, column: Column, option: str = "--uncertainty") -> float:
    value = _quantity(option, text, column.kind)
    if value <= 0:
        raise OptionError(f'{option}: "{text}" must be above zero')
    return value


def listed(option: str, text: str, column: Column) -> list[float]:
    return [_quantity(option, part, column.kind) for part in text.split(",")]


def _place(option: str, text: str, column: Column) -> Place:
    plain = text.strip()
    if plain in ("start", "end"):
        return "start" if plain == "start" else "end"
    parts = plain.split(",")
    if len(parts) > 2 or len(parts) == 2 and column.kind != "length":
        raise OptionError(
            f'{option}: "{text}" should be one abscissa, or two nominal co-ordinates on a profile'
        )
    if len(parts) == 2:
        return _quantity(option, parts[0], "length"), _quantity(option, parts[1], "length")
    return _quantity(option, plain, column.kind)


def _value(option: str, text: str, derivative: int, x: Column, y: Column) -> float:
    """A value of the error, or a slope as a unit of the error over one of the abscissa."""
    if derivative == 0:
        return _quantity(option, text, y.kind)
    plain = text.strip().replace("µ", "u").replace("μ", "u")
    if plain in ("0", "-0", "0.0"):
        return 0.0
    if re.match("[+-]?[0-9]+,[0-9]", plain):
        raise OptionError(
            f'{option}: "{text}" has a decimal comma; write for example "{text.replace(",", ".")}"'
        )
    match = re.fullmatch(r"([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([a-z]+)\s*/\s*([a-z]+)", plain)
    x_units, y_units = KINDS[x.kind].units, KINDS[y.kind].units
    with suppress(QuantityError):
        if match and match[2] in y_units and match[3] in x_units:
            return metres_or_radians(match[1], y_units[match[2]] / x_units[match[3]])
        if x.kind == y.kind == "length":
            return parse_ratio(plain)
    raise OptionError(
        f'{option}: "{text}" is not a slope; write for example "2 {y.unit}/{x.unit}", or 0'
    )
