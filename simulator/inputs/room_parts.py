"""Places along an axis: lengths, or parts of the room in which an artefact can be placed."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated

from pydantic import PlainValidator, WithJsonSchema

from .quantities import NUMBER, Length, QuantityError, exact_number, parse_length, typed_length
from .settings import nearest, shorten

ENDS = {"low": 0.0, "middle": 0.5, "high": 1.0}
RATIO = r"[0-9]{1,9} */ *[1-9][0-9]{0,8}"
PART = re.compile(rf"({NUMBER}) *%|({RATIO})")
# A millionth of a micrometre: places in a room are as round as those that one would write.
DECIMALS = 12


@dataclass(frozen=True)
class RoomPart:
    """A part of the free room along an axis as ``written``: from its low end, 0, to its high end,
    1.
    """

    fraction: float
    written: str

    def between(self, low: float, high: float) -> float:
        """Return the place between two ends in metres; the middle if there is no room.

        >>> RoomPart(0.3, "30 %").between(-0.05, 0.95)
        0.25
        """
        fraction = self.fraction if low <= high else 0.5
        return round(low + fraction * (high - low), DECIMALS) + 0.0


def parse_place(value: object) -> float | RoomPart:
    """Read a length and return it in metres, or a part of the free room.

    :raises QuantityError: neither a length, nor low, middle, high, nor a part from 0 % to 100 %.

    >>> parse_place("750 mm"), parse_place("2/9").written, parse_place("high").fraction
    (0.75, '2/9', 1.0)
    """
    text = value.strip() if isinstance(value, str) else ""
    if text in ENDS:
        return RoomPart(ENDS[text], text)
    if match := PART.fullmatch(text):
        ratio = match[2] and Fraction(match[2].replace(" ", ""))
        fraction = exact_number(match[1]) / 100 if ratio is None else ratio
        if not 0 <= fraction <= 1:
            raise QuantityError(f'"{shorten(text)}" is beyond the free room; give 0 % to 100 %')
        return RoomPart(float(fraction), text)
    if text[:1].isalpha():
        meant = nearest(text, ENDS)
        meant = f'did you mean "{meant}"? ' if meant else ""
        raise QuantityError(
            f'"{shorten(text)}" is not a place; {meant}write low, middle, high, a part of the free'
            ' room such as "30 %", or a length such as "750 mm"'
        )
    return parse_length(value)


def place_text(place: float | RoomPart) -> str:
    """Return a place as typed into a file.

    >>> place_text(0.25), place_text(RoomPart(0.3, "30 %"))
    ('250 mm', '30 %')
    """
    return place.written if isinstance(place, RoomPart) else typed_length(place)


Place = Annotated[
    float | RoomPart,
    PlainValidator(parse_place),
    WithJsonSchema(
        {
            "anyOf": [
                {"enum": [*ENDS]},
                {"type": "string", "pattern": f"^ *({NUMBER} *%|{RATIO})$", "examples": ["30 %"]},
                Length.__metadata__[1].json_schema,
            ]
        }
    ),
]
