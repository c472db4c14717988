"""Checks of a class of influence quantity when it is laid out: its parameters, and its shifts at a
few readings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import get_args

import numpy as np

from ...inputs.settings import listing
from ...machines.protocol import Integers, Unit
from .protocol import Disturbed, Influence, InfluenceParameter, InfluenceSettings

# Readings by which a kind is checked. More than there are axes, so that axes are not taken for
# them.
FEW = 7
# By which a changed value displaces readings, in metres: most of all and at least to be compared.
STEP = 1e-6
# What quotients of differences may miss derivatives by, in parts of the largest: shifts need be
# linear about the stated values only, and rounding of them is far smaller.
DERIVATIVE = 1e-3


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


def wrong_of_shifts(
    influence: Influence,
    settings: InfluenceSettings,
    at: Disturbed,
    again: Callable[[InfluenceSettings], Influence],
) -> str:
    """Return faults of shifts and their derivatives at readings `at`; possibly empty.

    If a number in the settings is the value of a parameter, the influence is built `again` with
    other values, and the derivative compared with differences. Other derivatives are not checked.
    """
    shift, derivative = influence.shifts(at)
    m, d, p = *at.x.shape, len(influence.parameters)
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
    for key, k in _stated(settings, influence):
        name, effect = influence.parameters[k].name, influence.parameters[k].effect
        steps, faults = [], []
        for step in (STEP / effect, -STEP / effect):
            value = getattr(settings, key) + step
            try:
                copied = again(settings.model_copy(update={key: value}))
            except ValueError:
                # No value that is possible.
                break
            if not _differ_in_value_only(influence, copied, k):
                break
            steps.append(copied.parameters[k].value)
            faults.append(copied.shifts(at)[0])
        if len(faults) < 2 or steps[0] == steps[1]:
            continue
        quotient = (faults[0] - faults[1]) / (steps[0] - steps[1])
        largest = float(max(np.abs(quotient).max(initial=0), np.abs(derivative[..., k]).max()))
        if np.abs(quotient - derivative[..., k]).max(initial=0) > DERIVATIVE * largest:
            reading = np.abs(quotient - derivative[..., k]).max(axis=1).argmax()
            axis = np.abs(quotient - derivative[..., k])[reading].argmax()
            return (
                f'the derivative of shifts by "{name}" is {derivative[reading, axis, k]:.3g}'
                f" along {'xyz'[axis]} of a reading where differences give"
                f" {quotient[reading, axis]:.3g}; correct it, or the shifts"
            )
    return ""


def _stated(settings: InfluenceSettings, influence: Influence) -> Iterator[tuple[str, int]]:
    """Return numeric settings with the parameters whose values they are."""
    for key in type(settings).model_fields:
        value = getattr(settings, key)
        if isinstance(value, float):
            for k, parameter in enumerate(influence.parameters):
                if parameter.value == value:
                    yield key, k


def _differ_in_value_only(one: Influence, other: Influence, k: int) -> bool:
    """True if two influences have the same parameters except the value of one."""
    if len(one.parameters) != len(other.parameters):
        return False
    value = one.parameters[k].value
    return other.parameters[k].value != value and all(
        replace(theirs, value=parameter.value) == parameter if i == k else theirs == parameter
        for i, (parameter, theirs) in enumerate(zip(one.parameters, other.parameters, strict=True))
    )
