"""Lengths of three digits in order, so that the search for one is a search among whole numbers."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from fractions import Fraction

DIGITS = 3
PER_DECADE = 9 * 10 ** (DIGITS - 1)


def at_step(step: int) -> Decimal:
    """Return the number of three digits with this index in ascending order.

    >>> at_step(0), at_step(1), at_step(-1), at_step(PER_DECADE)
    (Decimal('1.00'), Decimal('1.01'), Decimal('0.999'), Decimal('10.0'))
    """
    decade, place = divmod(step, PER_DECADE)
    return Decimal(10 ** (DIGITS - 1) + place).scaleb(decade - DIGITS + 1)


def step_of(value: Decimal) -> int:
    """Return the index of the largest number of three digits not above a positive value.

    >>> step_of(Decimal("0.2147")) == step_of(Decimal("0.214")) == step_of(Decimal("0.213")) + 1
    True
    """
    rounded = round_down(value)
    return (
        rounded.adjusted() * PER_DECADE
        + int(rounded.scaleb(DIGITS - 1 - rounded.adjusted()))
        - 10 ** (DIGITS - 1)
    )


def round_down(value: Decimal, digits: int = DIGITS) -> Decimal:
    """Return a positive number cut to `digits` digits."""
    return value.quantize(Decimal(1).scaleb(value.adjusted() - digits + 1), ROUND_FLOOR)


def round_up(value: Decimal, digits: int = DIGITS) -> Decimal:
    """Return a positive number rounded up to `digits` digits."""
    return value.quantize(Decimal(1).scaleb(value.adjusted() - digits + 1), ROUND_CEILING)


def exact(value: float) -> Decimal:
    """Return the shortest decimal that gives this float."""
    return Decimal(repr(value))


def times(value: Decimal, factor: Fraction) -> Decimal:
    """A product to 30 digits."""
    return Decimal((Fraction(value) * factor).numerator) / Decimal(
        (Fraction(value) * factor).denominator
    )
