"""Changes of a machine as text: scales, and turns of guideways."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from ballplate.presentation import number
from ballplate.results import ARCSECOND
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import (
    QuantityError,
    parse_angle,
    parse_length,
    parse_ratio,
)

# Turns and scale changes above this (rad, ratio) are no adjustments.
LARGEST = 0.05

TURNS = re.compile(r"([+-]?[0-9.]+) turns? of (.+?) at (.+)")


@dataclass(frozen=True)
class MachineChange:
    """A change of a machine: the scale of an axis (0 to 2) reads more by the ratio `amount`, or its
    guideway turns by `amount` (rad) towards the positive direction `towards`, None for a scale.
    """

    axis: int
    amount: float
    towards: int | None = None

    @property
    def words(self) -> str:
        """The change as text.

        >>> MachineChange(0, -2e-5).words
        'X made to read 20.00 µm per m less'
        >>> MachineChange(1, 1e-5, 0).words
        'Y guideway turned by 2.063 arcsec towards +X'
        """
        letter, size = AXIS_NAMES[self.axis].upper(), abs(self.amount)
        if self.towards is None:
            more = "less" if self.amount < 0.0 else "more"
            return f"{letter} made to read {number(1e6 * size)} µm per m {more}"
        sign = "-" if self.amount < 0.0 else "+"
        direction = f"{sign}{AXIS_NAMES[self.towards].upper()}"
        return f"{letter} guideway turned by {number(size / ARCSECOND)} arcsec towards {direction}"


def scale_change(text: str) -> MachineChange:
    """Return a change of a scale.

    :raises ValueError: it is none, or is too large for one.

    >>> scale_change("x=22 um/m")
    MachineChange(axis=0, amount=2.2e-05, towards=None)
    """
    name, sign, value = (part.strip() for part in text.partition("="))
    if not sign or name.lower() not in AXIS_NAMES:
        raise ValueError(
            f'"{text}" is no change of a scale; write for example x="22 um/m" where X reads that'
            ' much more, y="-5 um/m" where Y reads less'
        )
    return MachineChange(AXIS_NAMES.index(name.lower()), _within(text, _parsed(value, parse_ratio)))


def guideway_turn(text: str) -> MachineChange:
    """Return a turn of a guideway, from an angle or from turns of a screw with a pitch at the end
    of an arm.

    :raises ValueError: it is none, or is too large for one.

    >>> guideway_turn("y-x=12 urad").amount
    -1.2e-05
    >>> guideway_turn("z+x=0.5 turns of 1 mm at 500 mm").amount
    0.001
    """
    name, equal, value = (part.strip() for part in text.partition("="))
    match = re.fullmatch("([xyz])([+-])([xyz])", name.lower())
    if not equal or match is None or match[1] == match[3]:
        raise ValueError(
            f'"{text}" is no turn of a guideway; write for example y-x="12 arcsec" for the Y'
            ' guideway towards -X, or y-x="0.25 turns of 1 mm at 400 mm" for its screw'
        )
    screw = TURNS.fullmatch(value)
    if screw is None:
        angle = _parsed(value, parse_angle)
    else:
        count, pitch = _parsed(screw[1], float), _parsed(screw[2], parse_length)
        arm = _parsed(screw[3], parse_length)
        if not arm > 0.0:
            raise ValueError(f'"{screw[3]}" is no arm of a screw; it must be above zero')
        angle = count * pitch / arm
    axis, towards = AXIS_NAMES.index(match[1]), AXIS_NAMES.index(match[3])
    angle = _within(text, angle)
    return MachineChange(axis, -angle if match[2] == "-" else angle, towards)


def _parsed(text: str, parse: Any) -> float:
    try:
        return float(parse(text))
    except QuantityError as error:
        raise ValueError(str(error)) from None


def _within(text: str, amount: float) -> float:
    if not abs(amount) <= LARGEST:
        raise ValueError(f'"{text}" is more than {100 * LARGEST:g} %, which no adjustment is')
    return amount
