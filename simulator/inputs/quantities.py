"""Quantities of an experiment file: exact numbers with units, converted to metres and radians.

A factor is a fraction and multiplied before rounding, so "0.2 um" is the float nearest to 2e-7.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, PlainValidator, WithJsonSchema
from pydantic_core import CoreSchema, core_schema

from .number_arrays import Array
from .settings import describe, hint, shorten

# Sizes of units in SI, by their names.
Factors = Mapping[str, Fraction]
# Units of several columns, or kinds of quantities.
Units = Mapping[str, Factors]

PI = Fraction("3.14159265358979323846264338327950288419716939937510582")

LENGTH_UNITS: Factors = {
    "m": Fraction(1),
    "dm": Fraction(1, 10),
    "cm": Fraction(1, 100),
    "mm": Fraction(1, 10**3),
    "um": Fraction(1, 10**6),
    "nm": Fraction(1, 10**9),
    "pm": Fraction(1, 10**12),
    "in": Fraction(254, 10**4),
}
ANGLE_UNITS: Factors = {
    "rad": Fraction(1),
    "mrad": Fraction(1, 10**3),
    "urad": Fraction(1, 10**6),
    "nrad": Fraction(1, 10**9),
    "deg": PI / 180,
    "arcmin": PI / (180 * 60),
    "arcsec": PI / (180 * 3600),
}
RATIO_UNITS: Factors = {
    "ppm": Fraction(1, 10**6),
    "ppb": Fraction(1, 10**9),
    "%": Fraction(1, 100),
    "m/m": Fraction(1),
    "mm/m": Fraction(1, 10**3),
    "um/m": Fraction(1, 10**6),
    "nm/m": Fraction(1, 10**9),
}
TEMPERATURE_UNITS: Factors = {
    "K": Fraction(1),
    "degC": Fraction(1),
    "mK": Fraction(1, 10**3),
}
EXPANSION_UNITS: Factors = {
    f"{ratio}/{degree}": RATIO_UNITS.get(ratio, Fraction(1))
    for ratio in ("um/m", "ppm", "mm/m", "m/m", "1")
    for degree in ("K", "degC")
}
BENDING_UNITS: Factors = {f"{unit}/m": factor for unit, factor in ANGLE_UNITS.items()}
DURATION_UNITS: Factors = {
    "s": Fraction(1),
    "min": Fraction(60),
    "h": Fraction(3600),
}
# Drifts are kept per hour.
LENGTH_DRIFT_UNITS: Factors = {
    f"{unit}/{time}": LENGTH_UNITS[unit] * 3600 / seconds
    for time, seconds in sorted(DURATION_UNITS.items())
    for unit in ("um", "nm", "mm", "m")
}
RATIO_DRIFT_UNITS: Factors = {
    f"{unit}/{time}": RATIO_UNITS[unit] * 3600 / seconds
    for time, seconds in sorted(DURATION_UNITS.items())
    for unit in ("ppm", "um/m", "nm/m", "m/m")
}
# Beyond these, squares and their sums overflow or vanish.
LARGEST, SMALLEST = 10**6, Fraction(1, 10**18)
SMALLEST_FLOAT = float(SMALLEST)
BASE_UNITS: Mapping[str, str] = {
    "length": "m",
    "angle": "rad",
    "ratio": "m/m",
    "temperature difference": "K",
    "thermal expansion": "m/m/K",
    "angle per length": "rad/m",
    "duration": "s",
    "length per time": "m/h",
    "ratio per time": "m/m/h",
}
# Kind of quantity → its units and an example for the messages.
UNITS: Units = {
    "length": LENGTH_UNITS,
    "angle": ANGLE_UNITS,
    "ratio": RATIO_UNITS,
    "temperature difference": TEMPERATURE_UNITS,
    "thermal expansion": EXPANSION_UNITS,
    "angle per length": BENDING_UNITS,
    "duration": DURATION_UNITS,
    "length per time": LENGTH_DRIFT_UNITS,
    "ratio per time": RATIO_DRIFT_UNITS,
}
EXAMPLES: Mapping[str, str] = {
    "length": "750 mm",
    "angle": "2 arcsec",
    "ratio": "5 ppm",
    "temperature difference": "1.5 degC",
    "thermal expansion": "11 um/m/degC",
    "angle per length": "5 urad/m",
    "duration": "20 min",
    "length per time": "0.5 um/h",
    "ratio per time": "0.3 ppm/h",
}
LENGTH_FUNCTION_EXAMPLE = "0.5 um + L/1000000"

NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,6})?"
QUANTITY = re.compile(rf"({NUMBER})\s*((?:(?<=\s)1/|[^\s0-9.+-]).*)?")
CONSTANT_AND_DIVISOR = re.compile(rf"([^+]*(?:[eE]\+[^+]*)?)\+\s*L\s*/\s*({NUMBER})\s*")
CONSTANT_AND_RATIO = re.compile(
    rf"\s*([+-]?[^+]*(?:[eE]\+[^+]*)?)\+\s*({NUMBER}\s*[^\s0-9+-][^+]*)"
)
WITH_UNIT_OF_LENGTH = re.compile(
    rf"\s*\(\s*({NUMBER})\s*\+\s*L\s*/\s*({NUMBER})\s*\)\s*([^\s0-9()]+)\s+with\s+L\s+in\s+(\S+)\s*"
)
# Too few digits for a number other than zero to vanish.
PLAIN = re.compile(r"[+-]?[0-9]{1,15}(?:\.[0-9]{1,30})?")
# A faster growth comes of a data sheet's L in millimetres.
STEEPEST = Fraction(1, 10**4)


class QuantityError(ValueError):
    """A text is not the expected quantity; the message gives the remedy."""


def exact_number(text: str) -> Fraction:
    """Return a decimal number exactly.

    :raises QuantityError: not a finite decimal number, or one beyond 1e-300 … 1e300.

    >>> exact_number("1e-6")
    Fraction(1, 1000000)
    """
    if len(text) > 200 or re.fullmatch(NUMBER, text) is None:
        raise QuantityError(f'"{shorten(text)}" is not a number; write for example "500.0003"')
    decimal = Decimal(text)
    if decimal and not -300 <= decimal.adjusted() <= 300:
        raise QuantityError(
            f'"{text}" is beyond what can be computed with; write a number of usual size'
        )
    return Fraction(decimal)


def metres_or_radians(number: str, factor: Fraction, kind: str = "length") -> float:
    """Return the float nearest to a decimal number of a unit of `factor` metres or radians.

    :raises QuantityError: not a decimal number, too large or too small.

    >>> metres_or_radians("750", LENGTH_UNITS["mm"])
    0.75
    """
    exact = exact_number(number) * factor
    # Compared as a float, which takes a fraction of the time: tables have millions of numbers.
    value = float(exact)
    if exact and not float(SMALLEST) <= abs(value) <= LARGEST:
        unit = BASE_UNITS[kind]
        raise QuantityError(
            f'"{number}" is beyond what can be computed with; '
            f"write 0, or {_article(kind)} of {float(SMALLEST):g} {unit} to {LARGEST:g} {unit}"
        )
    return value


def power_of_ten(factor: Fraction) -> str:
    """Return the exponent of a unit's factor; empty if it is no power of ten.

    >>> power_of_ten(LENGTH_UNITS["mm"]), power_of_ten(LENGTH_UNITS["in"])
    ('e-3', '')
    """
    exponent = round(math.log10(factor))
    return f"e{exponent}" if factor == Fraction(10) ** exponent else ""


def plain_number(number: str, power: str) -> float | None:
    """Return `metres_or_radians` of digits with or without a decimal point, but sooner.

    `power` is a unit's `power_of_ten`. None for other notations and numbers out of range.

    >>> plain_number("750", "e-3"), plain_number("7.5e2", "e-3")
    (0.75, None)
    """
    if not power or not PLAIN.fullmatch(number):
        return None
    # Adding zero removes its sign.
    value = float(number + power) + 0.0
    return value if value == 0.0 or SMALLEST_FLOAT <= abs(value) <= LARGEST else None


def parse_length(value: object) -> float:
    """Read a length and return it in metres.

    :raises QuantityError: not a number with a unit of length.

    >>> parse_length("750 mm"), parse_length("0.2 µm")
    (0.75, 2e-07)
    """
    return _parse(value, "length")


def parse_positive_length(value: object) -> float:
    """Read a length above zero and return it in metres.

    :raises QuantityError: not a number with a unit of length, or not above zero.

    >>> try:
    ...     parse_positive_length("0 mm")
    ... except QuantityError as error:
    ...     print(error)
    "0 mm" must be above zero; give a small one, such as 1 nm
    """
    return _positive(value, parse_length(value))


def parse_length_uncertainty(value: object) -> float:
    """Return a standard uncertainty of a length in metres; zero for an exact length.

    :raises QuantityError: not a number with a unit of length, or below zero.
    """
    length = parse_length(value)
    return length if length == 0.0 else _positive(value, length)


def parse_angle(value: object) -> float:
    """Read an angle and return it in radians.

    :raises QuantityError: not a number with a unit of angle.

    >>> parse_angle("90 deg") == np.pi / 2
    True
    """
    return _parse(value, "angle")


def parse_positive_angle(value: object) -> float:
    """Read an angle above zero and return it in radians.

    :raises QuantityError: not a number with a unit of angle, or not above zero.
    """
    return _positive(value, parse_angle(value), "angle")


def parse_temperature_difference(value: object) -> float:
    """Read a difference of temperatures and return it in kelvins.

    :raises QuantityError: not a number with K or degC.

    >>> parse_temperature_difference("-1.5 degC")
    -1.5
    """
    return _parse(value, "temperature difference")


def parse_positive_temperature_difference(value: object) -> float:
    """Read a difference of temperatures above zero and return it in kelvins.

    :raises QuantityError: not a number with K or degC, or not above zero.
    """
    return _positive(value, parse_temperature_difference(value), "temperature difference")


def parse_temperature(value: object) -> float:
    """Read a temperature and return it in degrees Celsius.

    :raises QuantityError: not a number with degC.

    >>> parse_temperature("20.3 degC")
    20.3
    """
    temperature = parse_temperature_difference(value)
    if not str(value).strip().endswith("degC") or temperature < -273.15:
        raise QuantityError(f'"{value}" is no temperature; write for example "20.3 degC"')
    return temperature


def parse_expansion(value: object) -> float:
    """Read a coefficient of thermal expansion and return it in 1/K.

    :raises QuantityError: not a number with um/m/K or the like.

    >>> parse_expansion("11.5 um/m/degC")
    1.15e-05
    """
    return _parse(value, "thermal expansion")


def parse_bending(value: object) -> float:
    """Read an angle that grows with a length and return it in radians per metre.

    :raises QuantityError: not a number with urad/m or the like.

    >>> parse_bending("5 urad/m")
    5e-06
    """
    return _parse(value, "angle per length")


def parse_ratio(value: object) -> float:
    """Read a dimensionless ratio.

    :raises QuantityError: not a number with ppm, %, m/m or the like.

    >>> parse_ratio("5 ppm")
    5e-06
    """
    return _parse(value, "ratio")


def parse_duration(value: object) -> float:
    """Read a duration that is not negative and return it in seconds.

    :raises QuantityError: not a number with s, min or h, or below zero.

    >>> parse_duration("1.5 h"), parse_duration("20 min")
    (5400.0, 1200.0)
    """
    seconds = _parse(value, "duration")
    if seconds < 0:
        raise QuantityError(f'"{value}" is below zero; write for example "{EXAMPLES["duration"]}"')
    return seconds


def parse_length_drift(value: object) -> float:
    """Read a length per time and return it in metres per hour.

    :raises QuantityError: not a number with um/h or the like.

    >>> parse_length_drift("0.5 um/h"), parse_length_drift("1 nm/s")
    (5e-07, 3.6e-06)
    """
    return _parse(value, "length per time")


def parse_ratio_drift(value: object) -> float:
    """Read a ratio per time and return it in metres per metre and hour.

    :raises QuantityError: not a number with ppm/h or the like.

    >>> parse_ratio_drift("-0.5 um/m/h")
    -5e-07
    """
    return _parse(value, "ratio per time")


def length_text(length: float) -> str:
    """Return a length in metres with a unit, so that reading it gives the same float.

    >>> length_text(0.75), length_text(2e-7), length_text(1 / 3)
    ('750 mm', '0.2 um', '333.3333333333333 mm')
    """
    unit, shift = ("mm", 3) if length == 0 or abs(length) >= 1e-4 else ("um", 6)
    return f"{Decimal(repr(float(length) + 0.0)).scaleb(shift).normalize():f} {unit}"


def format_duration(seconds: float) -> str:
    """Return a duration with the largest unit in which it is at least one.

    >>> format_duration(5400), format_duration(735), format_duration(0)
    ('1.5 h', '12.25 min', '0 s')
    """
    unit = "h" if seconds >= 3600 else "min" if seconds >= 60 else "s"
    return f"{seconds / float(DURATION_UNITS[unit]):.9g} {unit}"


def typed_length(length: float) -> str:
    """Return a length in metres as typed into a file, with a suitable unit.

    >>> typed_length(0.75), typed_length(2e-7), typed_length(-0.0)
    ('750 mm', '0.2 um', '0 mm')
    """
    unit = "mm" if length == 0 or abs(length) >= 1e-4 else "um" if abs(length) >= 1e-8 else "nm"
    return f"{length / float(LENGTH_UNITS[unit]) + 0.0:.9g} {unit}"


def format_length(length: float) -> str:
    """Return a length in metres as text for people.

    >>> format_length(0.75), format_length(2e-7)
    ('750 mm', '0.2 µm')
    """
    return typed_length(length).replace(" um", " µm")


def _in_microradians(angle: float) -> str:
    return f"{Decimal(repr(angle)).scaleb(6).normalize():f} urad"


def format_angle(angle: float) -> str:
    """Return an angle in radians as text in microradians.

    >>> format_angle(2e-6)
    '2 µrad'
    """
    return f"{1e6 * angle + 0.0:.9g} µrad"


@dataclass(frozen=True)
class LengthFunction:
    """An uncertainty that grows with length: ``constant`` (m) + ``slope`` (m/m) × length."""

    constant: float
    slope: float = 0.0

    def at(self, length: ArrayLike) -> Array:
        """Return the values (m, any shape) at lengths (m, the same shape).

        >>> LengthFunction(0.25, 0.5).at([0.0, 1.0])
        array([0.25, 0.75])
        """
        return np.asarray(self.constant + self.slope * np.asarray(length, dtype=float))

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(parse_length_function)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return _length_function_schema("0.2 um")


@dataclass(frozen=True)
class Target:
    """A target uncertainty: ``coverage_factor`` times the standard uncertainty is at most
    ``stated``.
    """

    stated: LengthFunction
    coverage_factor: float = 1.0

    @property
    def standard(self) -> LengthFunction:
        """Target of the standard uncertainty.

        >>> Target(LengthFunction(1e-6), 2.0).standard
        LengthFunction(constant=5e-07, slope=0.0)
        """
        k = self.coverage_factor
        return LengthFunction(self.stated.constant / k, self.stated.slope / k)

    def at(self, length: ArrayLike) -> Array:
        """Return target standard uncertainties (m, any shape) at lengths (m, the same shape)."""
        return self.standard.at(length)


def parse_length_function(value: object) -> LengthFunction:
    """Read a length that may depend on the measured length.

    ``A`` or ``A + L/K``, with L in metres; ``A + B`` with B a ratio; ``(A + L/K) unit with L in
    unit``.

    :raises QuantityError: written otherwise, negative, zero at every length, or growing by 1e-4 or
        more.

    >>> parse_length_function("0.5 um + L/1000000")
    LengthFunction(constant=5e-07, slope=1e-06)
    >>> in_mm = parse_length_function("(0.9 + L/400) um with L in mm")
    >>> in_mm == parse_length_function("0.9 um + 2.5 ppm")
    True
    """
    if not isinstance(value, str) or "L" not in value and "+" not in value.strip()[1:]:
        return _constant(value)
    if "L" not in value:
        match = CONSTANT_AND_RATIO.fullmatch(value)
        if match is None:
            return _constant(value)
        return _growing(value, match[1], exact_ratio(match[2]))
    if match := WITH_UNIT_OF_LENGTH.fullmatch(value):
        number, divisor, unit, of_length = match.groups()
        # Read for the messages about units.
        parse_length(f"1 {unit}")
        parse_length(f"1 {of_length}")
        per = LENGTH_UNITS[plain_unit(unit)] / LENGTH_UNITS[plain_unit(of_length)]
        return _growing(value, f"{number} {unit}", _inverse(value, divisor) * per)
    match = CONSTANT_AND_DIVISOR.fullmatch(value)
    if match is None:
        raise QuantityError(
            f'"{shorten(value)}" is not a length that grows with L; write for example'
            f' "{LENGTH_FUNCTION_EXAMPLE}", with L in metres, "0.9 um + 2.5 um/m" or "(0.9 + L/400)'
            ' um with L in mm"'
        )
    return _growing(value, match[1], _inverse(value, match[2]), in_metres=True)


def parse_uncertainty_function(value: object) -> LengthFunction:
    """Read a standard uncertainty that may depend on the measured length; "0 um" if exact.

    :raises QuantityError: as for `parse_length_function`, but zero is allowed.

    >>> parse_uncertainty_function("0 um")
    LengthFunction(constant=0.0, slope=0.0)
    """
    is_zero = isinstance(value, str) and "L" not in value and "+" not in value.strip()[1:]
    if is_zero and parse_length(value) == 0.0:
        return LengthFunction(0.0)
    return parse_length_function(value)


def parse_common_part(value: object) -> LengthFunction:
    """Read the part of standard uncertainties that lengths have in common: a ratio, or as for
    `parse_length_function`.

    :raises QuantityError: as for `parse_length_function`.

    >>> parse_common_part("0.5 um/m")
    LengthFunction(constant=0.0, slope=5e-07)
    """
    try:
        parse_ratio(value)
    except QuantityError:
        return parse_length_function(value)
    return parse_length_function(f"0 um + {value}")


def exact_ratio(value: str) -> Fraction:
    """Read a ratio exactly.

    :raises QuantityError: not a number with ppm, um/m or the like.

    >>> exact_ratio("2.5 um/m")
    Fraction(1, 400000)
    """
    parse_ratio(value)
    match = QUANTITY.fullmatch(value.strip())
    assert match is not None
    return exact_number(match[1]) * RATIO_UNITS[plain_unit(match[2])]


def _constant(value: object) -> LengthFunction:
    constant = parse_length(value)
    if constant <= 0:
        _positive(value, constant)
    return LengthFunction(constant)


def _inverse(value: str, divisor: str) -> Fraction:
    number = exact_number(divisor)
    if number <= 0:
        raise QuantityError(
            f'"{shorten(value)}" has a negative part or divides by zero; write for example'
            f' "{LENGTH_FUNCTION_EXAMPLE}"'
        )
    return 1 / number


def _growing(value: str, constant: str, slope: Fraction, in_metres: bool = False) -> LengthFunction:
    """Return a length that grows by `slope` metres per metre; `in_metres` if L has no unit of its
    own.

    :raises QuantityError: negative, too slow, or so fast that a data sheet's L in millimetres is
        meant.
    """
    text = shorten(value)
    at_zero = parse_length(constant.strip())
    if at_zero < 0 or slope < 0:
        raise QuantityError(
            f'"{text}" has a negative part; write for example "{LENGTH_FUNCTION_EXAMPLE}"'
        )
    if slope >= STEEPEST:
        offset = constant.strip() if at_zero else "0 um"
        millimetres = float(1000 * slope)
        grows = f"{millimetres:.4g} mm" if millimetres < 1e6 else f"{millimetres / 1000:.4g} m"
        if not in_metres or slope / 1000 >= STEEPEST:
            raise QuantityError(
                f'"{text}" grows by {grows} per metre of length; give less than 100 um/m'
            )
        raise QuantityError(
            f'"{text}" grows by {grows} per metre of length, since L is in metres; where L is in'
            f' millimetres and the result in micrometres, as on data sheets, write "{offset} +'
            f' {float(slope * 1000):.9g} um/m"'
        )
    if slope and slope < SMALLEST:
        raise QuantityError(
            f'"{text}" grows too slowly; leave out the growth, or give 1e-18 m/m or more'
        )
    if at_zero == 0 and slope == 0:
        _positive(value, at_zero)
    return LengthFunction(at_zero, float(slope))


def with_quantities(value: Any) -> Any:
    """Return data with every text that is a quantity replaced by its value in SI units.

    >>> with_quantities({"pitch": "200 mm", "axes": ["x", "2 ppm"], "count": 3})
    {'pitch': 0.2, 'axes': ['x', 2e-06], 'count': 3}
    """
    if isinstance(value, Mapping):
        return {key: with_quantities(element) for key, element in value.items()}
    if isinstance(value, list | tuple):
        return [with_quantities(element) for element in value]
    if isinstance(value, str) and re.match(r"\s*[+-.0-9]", value):
        for kind in UNITS:
            with suppress(QuantityError):
                return _parse(value, kind)
    return value


def _parse(value: object, kind: str) -> float:
    units, example = UNITS[kind], EXAMPLES[kind]
    if isinstance(value, int | float) and not isinstance(value, bool):
        if value != value or value in (float("inf"), float("-inf")):
            raise QuantityError(f'{value} is not a finite {kind}; write for example "{example}"')
        raise QuantityError(f'"{value}" has no unit; {_with_unit(str(value), kind)}')
    if not isinstance(value, str):
        raise QuantityError(
            f'expected {_article(kind)}, found {describe(value)}; write for example "{example}"'
        )
    text = shorten(value)
    if re.match(r"[+-]?[0-9]+,[0-9]", value.strip()):
        example = shorten(value.replace(",", "."))
        raise QuantityError(
            f'"{text}" has a decimal comma; write a decimal point, for example "{example}"'
        )
    match = QUANTITY.fullmatch(value.strip())
    if match is None:
        raise QuantityError(f'"{text}" is not {_article(kind)}; write for example "{example}"')
    number, unit = match.groups()
    if unit is None:
        raise QuantityError(f'"{text}" has no unit; {_with_unit(text, kind)}')
    plain = plain_unit(unit)
    if plain not in units:
        for other_kind, its_units in UNITS.items():
            if plain in its_units:
                raise QuantityError(
                    f'"{text}" is {_article(other_kind)}; {_article(kind)} is expected, for example'
                    f' "{example}"'
                )
        if factor := re.fullmatch(r"(.+?)\s*\(\s*k\s*=\s*([1-9][0-9]*\.?[0-9]*)\s*\)", plain):
            standard = f"{float(number) / float(factor[2]):.9g} {factor[1]}"
            raise QuantityError(
                f'"{text}" is an expanded uncertainty; write the standard one, "{standard}"'
            )
        raise QuantityError(
            f'"{text}" has the unknown unit "{shorten(unit)}"; {hint(plain, units)}'
        )
    return metres_or_radians(number, units[plain], kind)


def plain_unit(unit: str) -> str:
    """Return a unit with u for the micro sign and the Greek letter."""
    return unit.strip().replace("µ", "u").replace("μ", "u")


def _positive(value: object, number: float, kind: str = "length") -> float:
    if number > 0:
        return number
    small = {"length": "1 nm", "angle": "1 nrad", "temperature difference": "1 mK"}[kind]
    example = "0.2 um" if kind == "length" else EXAMPLES[kind]
    remedy = (
        f"give a small one, such as {small}" if number == 0 else f'write for example "{example}"'
    )
    raise QuantityError(f'"{value}" must be above zero; {remedy}')


def _article(kind: str) -> str:
    return f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"


# Second units to suggest for a number without a unit; suggesting one alone would lead to errors of
# a factor of a thousand.
ALTERNATIVES = {
    "length": "um",
    "angle": "deg",
    "ratio": "m/m",
    "thermal expansion": "m/m/K",
    "duration": "s",
}


# A smaller number without a unit is one of metres or radians, as programs use.
SMALL = 1e-4


def _with_unit(number: str, kind: str) -> str:
    if kind in ("length", "angle") and 0.0 < abs(float(number)) < SMALL:
        unit, text = ("metres", length_text) if kind == "length" else ("radians", _in_microradians)
        return f'write "{text(float(number))}" if it is in {unit}'
    units = [EXAMPLES[kind].split()[1], *([ALTERNATIVES[kind]] if kind in ALTERNATIVES else [])]
    return "write for example " + " or ".join(f'"{number} {unit}"' for unit in units)


def _unit_patterns(kind: str) -> list[str]:
    names = [re.escape(unit) for unit in UNITS[kind]]
    return names + ["[µμ]" + name[1:] for name in names if name.startswith("u")]


def _pattern(kind: str) -> str:
    return f"^ *{NUMBER} *({'|'.join(_unit_patterns(kind))})$"


def _common_part_schema() -> dict[str, Any]:
    schema = _length_function_schema("0.1 um + 0.5 um/m")
    return {
        **schema,
        "pattern": f"{schema['pattern']}|{_pattern('ratio')}",
        "examples": ["0.5 um/m", *schema["examples"]],
    }


def _length_function_schema(*examples: str) -> dict[str, Any]:
    constant, ratio = _pattern("length")[1:-1], _pattern("ratio")[1:-1]
    units = f"({'|'.join(_unit_patterns('length'))})"
    growing = f"{constant}( *\\+( *L */ *{NUMBER}|{ratio}) *)?"
    bracketed = f" *\\( *{NUMBER} *\\+ *L */ *{NUMBER} *\\) *{units} +with +L +in +{units} *"
    return {
        "type": "string",
        "pattern": f"^({growing}|{bracketed})$",
        "examples": [
            *examples,
            LENGTH_FUNCTION_EXAMPLE,
            "0.9 um + 2.5 um/m",
            "(0.9 + L/400) um with L in mm",
        ],
    }


def _schema(kind: str, *examples: str) -> WithJsonSchema:
    return WithJsonSchema({"type": "string", "pattern": _pattern(kind), "examples": list(examples)})


Length = Annotated[
    float, PlainValidator(parse_length), _schema("length", "750 mm", "0.2 um", "12.5 in")
]
PositiveLength = Annotated[
    float, PlainValidator(parse_positive_length), _schema("length", "750 mm", "0.2 um")
]
LengthUncertainty = Annotated[
    float, PlainValidator(parse_length_uncertainty), _schema("length", "0.2 um", "0 um")
]
UncertaintyFunction = Annotated[
    LengthFunction,
    PlainValidator(parse_uncertainty_function),
    WithJsonSchema(_length_function_schema("0.2 um", "0 um")),
]
CommonPart = Annotated[
    LengthFunction,
    PlainValidator(parse_common_part),
    WithJsonSchema(_common_part_schema()),
]
Angle = Annotated[
    float, PlainValidator(parse_angle), _schema("angle", "90 deg", "2 arcsec", "5 urad")
]
PositiveAngle = Annotated[
    float, PlainValidator(parse_positive_angle), _schema("angle", "2 arcsec", "5 urad")
]
TemperatureDifference = Annotated[
    float,
    PlainValidator(parse_temperature_difference),
    _schema("temperature difference", "1.5 degC", "-0.3 K"),
]
PositiveTemperatureDifference = Annotated[
    float,
    PlainValidator(parse_positive_temperature_difference),
    _schema("temperature difference", "0.5 degC"),
]
Temperature = Annotated[
    float,
    PlainValidator(parse_temperature),
    WithJsonSchema({"type": "string", "pattern": f"^ *{NUMBER} *degC$", "examples": ["20.3 degC"]}),
]
Expansion = Annotated[
    float, PlainValidator(parse_expansion), _schema("thermal expansion", "11 um/m/degC")
]
Bending = Annotated[float, PlainValidator(parse_bending), _schema("angle per length", "5 urad/m")]
Ratio = Annotated[
    float, PlainValidator(parse_ratio), _schema("ratio", "5 ppm", "0.1 %", "1.2 um/m")
]
Duration = Annotated[
    float, PlainValidator(parse_duration), _schema("duration", "20 min", "15 s", "1.5 h")
]
LengthDrift = Annotated[
    float, PlainValidator(parse_length_drift), _schema("length per time", "0.5 um/h", "-2 nm/min")
]
RatioDrift = Annotated[
    float, PlainValidator(parse_ratio_drift), _schema("ratio per time", "0.3 ppm/h")
]
