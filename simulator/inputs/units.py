"""Units of quantities, as exact factors of SI units, and quantities as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction

# Sizes of units in SI, by their names.
Factors = Mapping[str, Fraction]
# Units of several columns, or kinds of quantities.
Units = Mapping[str, Factors]
PI = Fraction("3.14159265358979323846264338327950288419716939937510582")


def _exact(sizes: Mapping[str, str]) -> Factors:
    return {unit: Fraction(size) for unit, size in sizes.items()}


LENGTH_UNITS = _exact(
    {
        "m": "1",
        "dm": "0.1",
        "cm": "0.01",
        "mm": "1e-3",
        "um": "1e-6",
        "nm": "1e-9",
        "pm": "1e-12",
        "in": "0.0254",
    }
)
ANGLE_UNITS = {
    **_exact({"rad": "1", "mrad": "1e-3", "urad": "1e-6", "nrad": "1e-9"}),
    "deg": PI / 180,
    "arcmin": PI / (180 * 60),
    "arcsec": PI / (180 * 3600),
}
RATIO_UNITS = _exact(
    {
        "ppm": "1e-6",
        "ppb": "1e-9",
        "%": "0.01",
        "m/m": "1",
        "mm/m": "1e-3",
        "um/m": "1e-6",
        "nm/m": "1e-9",
    }
)
DURATION_UNITS = _exact({"s": "1", "min": "60", "h": "3600"})


def _per_hour(sizes: Factors, units: Sequence[str]) -> Factors:
    return {
        f"{unit}/{time}": sizes[unit] * 3600 / seconds
        for time, seconds in sorted(DURATION_UNITS.items())
        for unit in units
    }


@dataclass(frozen=True)
class Kind:
    """A kind of quantity: its `units`, the `base` in which it is kept, and texts for messages.

    `alternative` is a second unit to suggest for a number without one: one alone would lead to
    errors of a factor of a thousand. `small` is a small quantity, and `above_zero` an example of
    one that must be above zero.
    """

    units: Factors
    base: str
    example: str
    alternative: str = ""
    small: str = ""
    above_zero: str = ""


KINDS: Mapping[str, Kind] = {
    "length": Kind(LENGTH_UNITS, "m", "750 mm", "um", "1 nm", "0.2 um"),
    "angle": Kind(ANGLE_UNITS, "rad", "2 arcsec", "deg", "1 nrad", "2 arcsec"),
    "ratio": Kind(RATIO_UNITS, "m/m", "5 ppm", "m/m"),
    "temperature difference": Kind(
        _exact({"K": "1", "degC": "1", "mK": "1e-3"}), "K", "1.5 degC", "", "1 mK", "1.5 degC"
    ),
    "thermal expansion": Kind(
        {
            f"{ratio}/{degree}": RATIO_UNITS.get(ratio, Fraction(1))
            for ratio in ("um/m", "ppm", "mm/m", "m/m", "1")
            for degree in ("K", "degC")
        },
        "m/m/K",
        "11 um/m/degC",
        "m/m/K",
    ),
    "angle per length": Kind(
        {f"{unit}/m": factor for unit, factor in ANGLE_UNITS.items()}, "rad/m", "5 urad/m"
    ),
    "duration": Kind(DURATION_UNITS, "s", "20 min", "s"),
    "length per time": Kind(_per_hour(LENGTH_UNITS, ["um", "nm", "mm", "m"]), "m/h", "0.5 um/h"),
    "ratio per time": Kind(
        _per_hour(RATIO_UNITS, ["ppm", "um/m", "nm/m", "m/m"]), "m/m/h", "0.3 ppm/h"
    ),
}


def plain_unit(unit: str) -> str:
    """Return a unit with u for the micro sign and the Greek letter."""
    return unit.strip().replace("µ", "u").replace("μ", "u")


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


def format_angle(angle: float) -> str:
    """Return an angle in radians as text in microradians.

    >>> format_angle(2e-6)
    '2 µrad'
    """
    return f"{1e6 * angle + 0.0:.9g} µrad"
