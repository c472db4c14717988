"""Conditions on the values of an axis, which skip or select cells."""

from __future__ import annotations

import math
from typing import Any

from .model import Choice, SweepAxis
from .sweep_settings import BoundsSettings
from .values import numeric


def holds(condition: Any, axis: SweepAxis, choice: Choice) -> bool:
    """Return whether a choice meets a condition: a value, one of a list, or bounds.

    Quantities in the axis's unit compare by size, other values as written.

    :raises ValueError: bounds for an axis without numbers, or in another unit.
    """
    if isinstance(condition, BoundsSettings):
        above = _bound(condition.above, axis, -math.inf)
        return above < choice.value < _bound(condition.below, axis, math.inf)
    if isinstance(condition, tuple):
        return any(holds(alternative, axis, choice) for alternative in condition)
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
        example = {"m": "300 mm", "rad": "2 arcsec", "1": "5", "h": "3 h"}[axis.unit]
        raise ValueError(
            f'"{value}" cannot be compared with the values of the axis; write for example'
            f' "{example}"'
        )
    return number
