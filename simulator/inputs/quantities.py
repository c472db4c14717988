"""Quantities of an experiment file: exact numbers with units, converted to metres and radians.

A factor is a fraction and multiplied before rounding, so "0.2 um" is the float nearest to 2e-7.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .number_arrays import Array
from .settings import describe, hint, shorten
from .units import KINDS, plain_unit

# Beyond these, squares and their sums overflow or vanish.
LARGEST, SMALLEST = 10**6, Fraction(1, 10**18)
SMALLEST_FLOAT = float(SMALLEST)
LENGTH_FUNCTION_EXAMPLE = "0.5 um + L/1000000"
NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,6})?"
# A unit begins with a character that no number has, or with 1/ after a space.
QUANTITY = re.compile(rf"({NUMBER})\s*((?:(?<=\s)1/|[^\s0-9.+-]).*)?")
# A constant, and what is added for each metre: a divisor of L, or a ratio.
GROWING = re.compile(rf"(.+?)\+\s*(?:L\s*/\s*({NUMBER})|({NUMBER}\s*[^\s0-9.+-][^+]*))\s*")
# A faster growth comes of a data sheet's L in millimetres.
STEEPEST = Fraction(1, 10**4)
# A smaller number without a unit is one of the base unit, as programs use.
SMALL = 1e-4


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
    # Before it becomes a fraction, which has as many digits as the exponent says.
    if decimal and not -300 <= decimal.adjusted() <= 300:
        raise QuantityError(
            f'"{text}" is beyond what can be computed with; write a number of usual size'
        )
    return Fraction(decimal)


def metres_or_radians(number: str, factor: Fraction, kind: str = "length") -> float:
    """Return the float nearest to a decimal number of a unit of `factor` metres or radians.

    :raises QuantityError: not a decimal number, too large or too small.

    >>> metres_or_radians("750", Fraction("0.001"))
    0.75
    """
    exact = exact_number(number) * factor
    # Compared as a float, which takes a fraction of the time: tables have millions of numbers.
    value = float(exact)
    if exact and not SMALLEST_FLOAT <= abs(value) <= LARGEST:
        unit = KINDS[kind].base
        raise QuantityError(
            f'"{number}" is beyond what can be computed with; '
            f"write 0, or {_article(kind)} of {SMALLEST_FLOAT:g} {unit} to {LARGEST:g} {unit}"
        )
    return value


def parse_quantity(
    value: object, kind: str, above_zero: bool = False, or_zero: bool = False
) -> float:
    """Read a number with a unit of a kind and return it in the kind's base unit.

    It must be `above_zero`, or be that `or_zero`, if asked.

    :raises QuantityError: not a number with a unit of the kind, or below the least.

    >>> parse_quantity("-1.5 degC", "temperature difference"), parse_quantity("5 ppm", "ratio")
    (-1.5, 5e-06)
    >>> try:
    ...     parse_quantity("0 mm", "length", above_zero=True)
    ... except QuantityError as error:
    ...     print(error)
    "0 mm" must be above zero; give a small one, such as 1 nm
    """
    number = metres_or_radians(*_number_and_factor(value, kind), kind)
    if not above_zero or number > 0 or or_zero and number == 0:
        return number
    about = KINDS[kind]
    small, example = f"give a small one, such as {about.small}", about.above_zero or about.example
    remedy = small if number == 0 else f'write for example "{example}"'
    raise QuantityError(f'"{value}" must be above zero; {remedy}')


def parse_length(value: object) -> float:
    """Read a length and return it in metres.

    :raises QuantityError: not a number with a unit of length.

    >>> parse_length("750 mm"), parse_length("0.2 µm")
    (0.75, 2e-07)
    """
    return parse_quantity(value, "length")


parse_angle = partial(parse_quantity, kind="angle")
parse_ratio = partial(parse_quantity, kind="ratio")
# Parsers of values in metres, radians and ratios, by the names of these units in results.
PARSERS: Mapping[str, Callable[[object], float]] = {
    "m": parse_length,
    "rad": parse_angle,
    "1": parse_ratio,
}
parse_positive_length = partial(parse_quantity, kind="length", above_zero=True)
parse_positive_angle = partial(parse_quantity, kind="angle", above_zero=True)
parse_positive_temperature_difference = partial(
    parse_quantity, kind="temperature difference", above_zero=True
)


def parse_temperature(value: object) -> float:
    """Read a temperature and return it in degrees Celsius.

    :raises QuantityError: not a number with degC.

    >>> parse_temperature("20.3 degC")
    20.3
    """
    temperature = parse_quantity(value, "temperature difference")
    if not str(value).strip().endswith("degC") or temperature < -273.15:
        raise QuantityError(f'"{value}" is no temperature; write for example "20.3 degC"')
    return temperature


def parse_duration(value: object) -> float:
    """Read a duration that is not negative and return it in seconds.

    :raises QuantityError: not a number with s, min or h, or below zero.

    >>> parse_duration("1.5 h"), parse_duration("20 min")
    (5400.0, 1200.0)
    """
    seconds = parse_quantity(value, "duration")
    if seconds < 0:
        raise QuantityError(f'"{value}" is below zero; write for example "20 min"')
    return seconds


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


def parse_length_function(value: object, or_zero: bool = False) -> LengthFunction:
    """Read a length that may depend on the measured length: ``A``, ``A + L/K`` with L in metres, or
    ``A + B`` with B a ratio. It may be zero at every length if `or_zero`.

    :raises QuantityError: written otherwise, negative, zero at every length, or growing by 1e-4 or
        more.

    >>> parse_length_function("0.5 um + L/1000000")
    LengthFunction(constant=5e-07, slope=1e-06)
    >>> parse_length_function("0.9 um + 2.5 ppm")
    LengthFunction(constant=9e-07, slope=2.5e-06)
    """
    match = GROWING.fullmatch(value) if isinstance(value, str) else None
    text = shorten(str(value))
    if match is None:
        if "L" in text:
            raise QuantityError(
                f'"{text}" is not a length that grows with L; write for example'
                f' "{LENGTH_FUNCTION_EXAMPLE}", with L in metres, or "0.9 um + 2.5 um/m"'
            )
        return LengthFunction(parse_quantity(value, "length", above_zero=True, or_zero=or_zero))
    constant, divisor, ratio = match.groups()
    at_zero = parse_length(constant)
    if divisor is None:
        number, factor = _number_and_factor(ratio, "ratio")
        slope = exact_number(number) * factor
    else:
        by = exact_number(divisor)
        if by <= 0:
            raise QuantityError(
                f'"{text}" has a negative part or divides by zero; write for example'
                f' "{LENGTH_FUNCTION_EXAMPLE}"'
            )
        slope = 1 / by
    if at_zero < 0 or slope < 0:
        raise QuantityError(
            f'"{text}" has a negative part; write for example "{LENGTH_FUNCTION_EXAMPLE}"'
        )
    if slope >= STEEPEST:
        advice = "; give less than 100 um/m"
        if divisor is not None and slope / 1000 < STEEPEST:
            offset = constant.strip() if at_zero else "0 um"
            advice = (
                ", since L is in metres; where L is in millimetres and the result in micrometres,"
                f' as on data sheets, write "{offset} + {float(slope * 1000):.9g} um/m"'
            )
        raise QuantityError(f'"{text}" grows by {float(slope * 10**6):.4g} um/m{advice}')
    if slope and slope < SMALLEST:
        raise QuantityError(
            f'"{text}" grows too slowly; leave out the growth, or give 1e-18 m/m or more'
        )
    if not at_zero and not slope and not or_zero:
        raise QuantityError(f'"{text}" must be above zero; give a small one, such as 1 nm')
    return LengthFunction(at_zero, float(slope))


def parse_common_part(value: object) -> LengthFunction:
    """Read the part of standard uncertainties that lengths have in common: a ratio, or as for
    `parse_length_function`.

    :raises QuantityError: as for `parse_length_function`.

    >>> parse_common_part("0.5 um/m")
    LengthFunction(constant=0.0, slope=5e-07)
    """
    with suppress(QuantityError):
        parse_ratio(value)
        value = f"0 um + {value}"
    return parse_length_function(value)


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
        for kind in KINDS:
            with suppress(QuantityError):
                return parse_quantity(value, kind)
    return value


def _number_and_factor(value: object, kind: str) -> tuple[str, Fraction]:
    """Return the number and the factor of the unit of a text.

    :raises QuantityError: it has no number, or no unit of the kind.
    """
    about = KINDS[kind]
    write = f'write for example "{about.example}"'
    if isinstance(value, int | float) and not isinstance(value, bool):
        # Of any integer, also one that is no float.
        if not -math.inf < value < math.inf:
            raise QuantityError(f"{value} is not a finite {kind}; {write}")
        raise QuantityError(f'"{value}" has no unit; {_with_unit(str(value), kind)}')
    if not isinstance(value, str):
        raise QuantityError(f"expected {_article(kind)}, found {describe(value)}; {write}")
    text = shorten(value)
    if re.match(r"[+-]?[0-9]+,[0-9]", value.strip()):
        example = shorten(value.replace(",", "."))
        raise QuantityError(
            f'"{text}" has a decimal comma; write a decimal point, for example "{example}"'
        )
    match = QUANTITY.fullmatch(value.strip())
    if match is None:
        raise QuantityError(f'"{text}" is not {_article(kind)}; {write}')
    number, unit = match.groups()
    if unit is None:
        raise QuantityError(f'"{text}" has no unit; {_with_unit(text, kind)}')
    plain = plain_unit(unit)
    if plain in about.units:
        return number, about.units[plain]
    for other, other_kind in KINDS.items():
        if plain in other_kind.units:
            raise QuantityError(
                f'"{text}" is {_article(other)}; {_article(kind)} is expected, for example'
                f' "{about.example}"'
            )
    if expanded := re.fullmatch(r"(.+?)\s*\(\s*k\s*=\s*([1-9][0-9]*\.?[0-9]*)\s*\)", plain):
        standard = f"{float(number) / float(expanded[2]):.9g} {expanded[1]}"
        raise QuantityError(
            f'"{text}" is an expanded uncertainty; write the standard one, "{standard}"'
        )
    raise QuantityError(
        f'"{text}" has the unknown unit "{shorten(unit)}"; {hint(plain, about.units)}'
    )


def _article(kind: str) -> str:
    return f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"


def _with_unit(number: str, kind: str) -> str:
    about = KINDS[kind]
    if 0.0 < abs(float(number)) < SMALL:
        return f'write "{number} {about.base}" if it is in {about.base}'
    units = (about.example.split()[1], about.alternative)
    return "write for example " + " or ".join(f'"{number} {unit}"' for unit in units if unit)
