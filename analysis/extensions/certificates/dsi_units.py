r"""Units as certificates in XML write them: the D-SI notation of the siunitx package, such as
\milli\metre.

D. Hutzschenreuter et al., *SmartCom Digital System of Units (D-SI)*, 2nd edition, 2020, section 4.
"""

from __future__ import annotations

import re
from fractions import Fraction

from ballplate.simulator.inputs import QuantityError, shorten

PREFIXES = {
    "kilo": 3,
    "hecto": 2,
    "deca": 1,
    "deci": -1,
    "centi": -2,
    "milli": -3,
    "micro": -6,
    "nano": -9,
    "pico": -12,
}
METRES = ("metre", "meter")
RATIOS = ("one", "percent", "ppm")
TEMPERATURES = {"degreecelsius": 0.0, "kelvin": -273.15}
_TOKEN = re.compile(r"\\([A-Za-z]+)(?:\{([+-]?[0-9])\})?")


def length_factor(unit: str, power: int = 1) -> Fraction:
    r"""How many metres, to a `power`, a unit is.

    :raises QuantityError: it is no unit of length, or of its power.

    >>> length_factor(r"\milli\metre"), length_factor(r"\micro\metre\tothe{2}", 2)
    (Fraction(1, 1000), Fraction(1, 1000000000000))
    >>> [f"{float(length_factor(one)):g}" for one in (f"\\{name}\\metre" for name in PREFIXES)]
    ['1000', '100', '10', '0.1', '0.01', '0.001', '1e-06', '1e-09', '1e-12']
    """
    factor, exponent, prefix, start = Fraction(1), 0, 0, 0
    last = Fraction(1)
    text = unit.strip()
    for match in _TOKEN.finditer(text):
        name, number = match[1].lower(), match[2]
        if match.start() != start:
            break
        start = match.end()
        if name in PREFIXES and number is None:
            prefix += PREFIXES[name]
        elif name in METRES and number is None:
            last = Fraction(10) ** prefix
            factor, exponent, prefix = factor * last, exponent + 1, 0
        elif name == "tothe" and number is not None and exponent and not prefix:
            times = int(number) - 1
            factor, exponent = factor * last**times, exponent + times
        else:
            break
    else:
        if start == len(text) and exponent == power and not prefix:
            return factor
    quantity = "a length" if power == 1 else "the square of a length"
    example = r"\milli\metre" if power == 1 else r"\micro\metre\tothe{2}"
    raise QuantityError(
        f'the unit "{shorten(unit)}" is not a unit of {quantity}, such as {example}'
    )


def celsius(value: float, unit: str) -> float | None:
    r"""A temperature in degrees Celsius, None where the unit is another.

    >>> celsius(20.0, r"\degreeCelsius"), round(celsius(293.15, r"\kelvin"), 9)
    (20.0, 20.0)
    """
    above = TEMPERATURES.get(unit.strip().lstrip("\\").lower())
    return None if above is None else value + above
