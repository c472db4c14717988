"""Quantities as text: exactly, as they are typed, and as they are read."""

from __future__ import annotations

from decimal import Decimal

from .units import DURATION_UNITS, LENGTH_UNITS


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
