"""Conditions on the values of an axis, by which cells are left out or kept."""

from __future__ import annotations

import math
from typing import Any

from .model import Choice, SweepAxis
from .sweep_settings import BoundsSettings
from .values import numeric


def holds(condition: Any, axis: SweepAxis, choice: Choice) -> bool:
    """Whether a condition holds for a choice: a value, one of a list, or bounds.

    A value is compared as a quantity where it and the axis are such, and otherwise as it is
    written.

    :raises ValueError: bounds of an axis without numbers, or of another unit.
    """
    if isinstance(condition, BoundsSettings):
        above, below = (
            _bound(condition.above, axis, -math.inf),
            _bound(condition.below, axis, math.inf),
        )
        return above < choice.value < below
    if isinstance(condition, tuple):
        return any(holds(one, axis, choice) for one in condition)
    text = "true" if condition is True else "false" if condition is False else str(condition)
    value, unit = numeric(condition)
    if axis.unit and unit == axis.unit:
        return value == choice.value
    return text == choice.label


def _bound(value: object, axis: SweepAxis, otherwise: float) -> float:
    if value is None:
        return otherwise
    number, unit = numeric(value)
    if not axis.unit:
        raise ValueError("the values of the axis are not numbers; name those that are meant")
    if unit != axis.unit:
        example = {"m": "300 mm", "rad": "2 arcsec", "1": "5"}[axis.unit]
        raise ValueError(
            f'"{value}" cannot be compared with the values of the axis; write for example'
            f' "{example}"'
        )
    return number
