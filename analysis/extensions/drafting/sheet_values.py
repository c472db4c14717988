"""Values as data sheets and certificates write them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ballplate.simulator.inputs import (
    LengthFunction,
    Target,
    format_length,
    number_of,
    parse_duration,
    parse_length_function,
    parse_positive_length,
    parse_positive_temperature_difference,
    typed_length,
)

from .machine_tables import known, table

NUMBER = r"((?:[0-9]+\.?[0-9]*|\.[0-9]+))"
# Usual standard uncertainty in metres of the offset of a tip qualified on a reference sphere.
QUALIFICATION = 0.5e-6
# Between lengths: a cross, a comma, or a space before the next number.
BETWEEN = re.compile(r"\s*[x×*,;]\s*|\s+(?=[-+.0-9])")
# A name such as E0, MPE before a value.
NAME = re.compile(r"\s*(?:[A-Za-z]\w*(?:,\s*\w+)?\s*=)?\s*±?\s*")
# A um + L/K and (A + B L/K) um, or A um + B L.
GROWING = re.compile(
    rf"\(?\s*{NUMBER}\s*([uµμ]m)?\s*\+\s*{NUMBER}?\s*[*·]?\s*L\s*"
    r"(?:/\s*([1-9][0-9]{0,3}))?\s*\)?\s*([uµμ]m)?"
)
COVERAGE = re.compile(r"\s*[,;(]?\s*k\s*=\s*([1-9](?:\.[0-9]*)?)(?![0-9])\s*\)?\s*")
PLATE = re.compile(
    r"\s*([0-9]{1,4})\s*[x×*]\s*([0-9]{1,4})(?:\s*balls)?\s*[,;]?\s+(pitch\s)?\s*(.+)"
)


@dataclass(frozen=True)
class Plate:
    """A plate with ``columns`` and ``rows`` of balls; ``size`` in metres between outer balls."""

    columns: int
    rows: int
    size: tuple[float, float]


@dataclass(frozen=True)
class StatedTips:
    """The ``form`` of tips, the ``length`` of styli in metres, None for the usual one, and the
    ``uncertainty`` of their offsets in metres.
    """

    form: str
    length: float | None
    uncertainty: float


def lengths(text: str, count: int = 3) -> tuple[float, ...]:
    """Return lengths above zero in metres; those without a unit have that of the last.

    :raises ValueError: another number of lengths, or no lengths.

    >>> lengths("900 x 1200 x 700 mm")
    (0.9, 1.2, 0.7)
    """
    words = BETWEEN.split(text.strip())
    if len(words) != count:
        example = " ".join(["900", "1200", "700"][:count])
        raise ValueError(
            f'"{text}" has {number_of(len(words), "length")}, not {count}; write for example'
            f' "{example} mm"'
        )
    unit = words[-1].lstrip("-+.0123456789 ")
    return tuple(
        parse_positive_length(word if word[-1:].isalpha() else f"{word} {unit}") for word in words
    )


def volume(text: str) -> tuple[float, ...]:
    """Return the edges of a measuring volume in metres, two in two dimensions.

    :raises ValueError: no three lengths of 10 mm to 100 m, or two.
    """
    edges = lengths(text, 2 if len(BETWEEN.split(text.strip())) == 2 else 3)
    for edge in edges:
        if not 0.01 <= edge <= 100.0:
            raise ValueError(f'"{text}" has an edge of {format_length(edge)}; give 10 mm to 100 m')
    return edges


def permissible_error(text: str) -> LengthFunction:
    """Return a maximum permissible error, whose constant part gives the repeatability.

    :raises ValueError: as `growing_length`, or without a constant part.
    """
    found = growing_length(text)
    if found.constant == 0.0:
        raise ValueError(f'"{text}" has no constant part; write for example "0.9 um + L/400"')
    return found


def growing_length(text: str) -> LengthFunction:
    """Return A + B L as a data sheet or a certificate states it.

    Of ``A um + L/K``, L is in millimetres and the result in micrometres; of ``A um + B L``, L is in
    metres. Other texts are those of experiment files, which have K of 10 000 or more for L in
    metres.

    :raises ValueError: written otherwise, without a unit, or growing by 100 um/m or more.

    >>> growing_length("MPE = 0.9 um + L/400")
    LengthFunction(constant=9e-07, slope=2.5e-06)
    >>> growing_length("0.4 um + 0.5 L") == growing_length("0.4 um + 0.5 um/m")
    True
    """
    text = NAME.sub("", text, 1).strip()
    match = GROWING.fullmatch(text)
    if match is None or not (match[2] or match[5]) or not (match[3] or match[4]):
        return parse_length_function(text)
    slope = 1000 * float(match[3] or 1) / float(match[4] or 1000)
    return parse_length_function(f"{match[1]} um + {slope:.9f} um/m")


def expanded(text: str, usual_factor: str = "") -> Target:
    """Return an expanded uncertainty with its coverage factor, the usual one if none is stated.

    :raises ValueError: no coverage factor of 1 to below 10.

    >>> expanded("U = 0.4 um + 0.5 L, k = 2").standard
    LengthFunction(constant=2e-07, slope=2.5e-07)
    """
    factors = COVERAGE.findall(text) or [usual_factor]
    if not factors[0] or len(factors) > 1:
        raise ValueError(f'"{text}" needs one coverage factor of 1 to 10; write "…, k=2"')
    return Target(growing_length(COVERAGE.sub("", text)), float(factors[0]))


def target(text: str) -> Target:
    """Return a target of the expanded uncertainty; k is 2 if none is stated."""
    return expanded(text, "" if "k" in text else "2")


def plate(text: str) -> Plate:
    """Return a plate by its columns, rows, and size between outer balls or pitch.

    :raises ValueError: written otherwise, fewer than two columns or rows, or one length for a plate
        that is not square.

    >>> plate("6 x 6, 420 mm") == plate("6x6 pitch 84 mm")
    True
    """
    match = PLATE.fullmatch(text)
    if match is None or min(int(match[1]), int(match[2])) < 2:
        raise ValueError(
            f'"{text}" is no plate of 2 x 2 balls or more; write columns x rows, and the size'
            ' between the outer balls or the pitch: "6 x 6, 420 mm" or "6 x 6, pitch 84 mm"'
        )
    columns, rows = int(match[1]), int(match[2])
    sides = lengths(match[4], len(BETWEEN.split(match[4].strip(), 1)))
    if match[3]:
        sides = (sides[0] * (columns - 1), sides[-1] * (rows - 1))
    elif len(sides) == 1 and columns != rows:
        raise ValueError(f'"{text}" has one size for two sides; give both, such as 420 x 252 mm')
    return Plate(columns, rows, (round(sides[0], 9), round(sides[-1], 9)))


def tips(text: str) -> StatedTips:
    """Return the form of tips, which the length of a stylus, from the centre of a star or the pivot
    of a head to the tip, and the standard uncertainty of each offset may follow, below a
    millimetre.

    :raises ValueError: an unknown form, or other lengths.

    >>> tips("star, 40 mm")
    StatedTips(form='star', length=0.04, uncertainty=5e-07)
    >>> tips("head, 0.3 um").uncertainty
    3e-07
    """
    form, *words = text.split(",")
    stated = [parse_positive_length(word) for word in words]
    long = [length for length in stated if length >= 1e-3]
    small = [length for length in stated if length < 1e-3]
    if max(len(long), len(small)) > 1:
        raise ValueError(
            f'"{text}" states a length or an uncertainty twice; write "star, 60 mm, 0.5 um"'
        )
    name = known("tips", form, [*table("tips")])
    return StatedTips(name, long[0] if long else None, small[0] if small else QUALIFICATION)


def temperature(text: str) -> str:
    """Return a standard uncertainty of temperatures, as it is stated.

    :raises ValueError: none above zero and at most 5 K.
    """
    if parse_positive_temperature_difference(text) > 5.0:
        raise ValueError(f'"{text}" is no uncertainty of a temperature; write for example "0.1 K"')
    return text.strip()


def hours(text: str) -> float:
    """Return a number of hours, stated with or without a unit.

    :raises ValueError: no duration above zero.

    >>> hours("6"), hours("90 min")
    (6.0, 1.5)
    """
    found = parse_duration(text if text[-1:].isalpha() else f"{text} h") / 3600
    if found == 0.0:
        raise ValueError(f'"{text}" leaves no time for measuring; give for example "6 h"')
    return found


def rounded(length: float, digits: int = 6) -> str:
    """Return a length as a file states it.

    >>> rounded(3e-7 / 0.9, 2)
    '0.33 um'
    """
    return typed_length(float(f"{length:.{digits}g}"))


def function_text(function: LengthFunction) -> str:
    """Return a length that may grow as a file states it.

    >>> function_text(LengthFunction(9e-7, 2.5e-6))
    '0.9 um + 2.5 um/m'
    >>> function_text(LengthFunction(9e-7, 1 / 600e3))
    '0.9 um + L/600000'
    """
    rate = f"{1e6 * function.slope:.6g}"
    grows = f" + {rate} um/m" if function.slope else ""
    if not math.isclose(float(rate), 1e6 * function.slope, rel_tol=1e-9):
        grows = f" + L/{1.0 / function.slope:.9g}"
    return rounded(function.constant) + grows
