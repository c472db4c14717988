"""Checks of a class of influence quantity when it is laid out: its parameters, and its shifts at a
few readings.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

import numpy as np
from ballplate.simulator.inputs.settings import listing
from ballplate.simulator.machines.protocol import Integers, Unit

from .protocol import Disturbed, Influence, InfluenceParameter

# Readings by which a kind is checked. More than there are axes, so that axes are not taken for
# them.
FEW = 7


def few(count: int) -> Integers:
    """Return a few indices spread over `count` readings."""
    return np.unique(np.linspace(0, max(count - 1, 0), min(count, FEW)).astype(np.int64))


def wrong_of_parameters(parameters: tuple[InfluenceParameter, ...], positions: int) -> str:
    """Return faults of parameters for `positions` positions; possibly empty."""
    return next(iter(_of_parameters(parameters, positions)), "")


def _of_parameters(parameters: tuple[InfluenceParameter, ...], positions: int) -> Iterator[str]:
    units = get_args(Unit)
    for parameter in parameters:
        words = f'parameter "{parameter.name}"'
        if not parameter.name:
            yield "a parameter has no name; give one"
        if parameter.unit not in units:
            yield f'{words} has the unit "{parameter.unit}"; give one of {listing(units)}'
        if not np.isfinite(parameter.value):
            yield f"{words} has the value {parameter.value}; give a finite one"
        if not parameter.uncertainty >= 0.0:
            yield (
                f"{words} has the uncertainty {parameter.uncertainty:g}; give 0 for a constant,"
                " inf where"
                " nothing is known, or a positive number"
            )
        if not (np.isfinite(parameter.effect) and parameter.effect > 0.0):
            yield (
                f"{words} has the effect {parameter.effect:g}; give what a unit of it moves"
                " readings by"
                " where it does most, a positive number of metres"
            )
        if not -1 <= parameter.position < positions:
            yield (
                f"{words} is of position {parameter.position}; give an index below {positions}, or"
                " -1"
                " where it is of several"
            )


def wrong_of_shifts(influence: Influence, at: Disturbed) -> str:
    """Return faults of the shapes and numbers of shifts at readings `at`; possibly empty."""
    m, d, p = *at.x.shape, len(influence.parameters)
    shift, derivative = influence.shifts(at)
    for array, shape, description in (
        (shift, (m, d), "shifts"),
        (derivative, (m, d, p), "the derivative of shifts"),
    ):
        if np.shape(array) != shape:
            return (
                f"{description} of {m} readings has the shape {np.shape(array)}; it must be {shape}"
            )
        if not np.isfinite(array).all():
            return f"{description} has values that are not finite"
    return ""
