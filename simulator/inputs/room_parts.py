"""Places along an axis: lengths, or parts of the room in which an artefact can be placed."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, get_args

from pydantic import PlainValidator, WithJsonSchema

from .quantities import QuantityError, parse_length
from .quantity_types import Length
from .quantity_words import typed_length
from .settings import hint, shorten

ENDS = {"low": 0.0, "middle": 0.5, "high": 1.0}
PART = r" *([+-]?[0-9]{1,9}(\.[0-9]{1,20})? *%|[0-9]{1,9} */ *[1-9][0-9]{0,8}) *"


@dataclass(frozen=True)
class RoomPart:
    """A part of the free room along an axis as ``written``: from its low end, 0, to its high end,
    1.
    """

    fraction: float
    written: str


def length_of(place: Place, low: float, high: float) -> float:
    """Return a place in metres; parts of a room between two ends, the middle if there is no room.

    >>> length_of(0.75, 0.0, 0.5), length_of(RoomPart(0.3, "30 %"), -0.05, 0.95)
    (0.75, 0.25)
    """
    if isinstance(place, float):
        return place
    fraction = place.fraction if low <= high else 0.5
    # A millionth of a micrometre: as round as a length that one would write.
    return float(round(low + fraction * (high - low), 12)) + 0.0


def parse_place(value: object) -> float | RoomPart:
    """Read a length and return it in metres, or a part of the free room.

    :raises QuantityError: neither a length, nor low, middle, high, nor a part from 0 % to 100 %.

    >>> parse_place("750 mm"), parse_place("2/9").written, parse_place("high").fraction
    (0.75, '2/9', 1.0)
    """
    text = value.strip() if isinstance(value, str) else ""
    if text in ENDS:
        return RoomPart(ENDS[text], text)
    if re.fullmatch(PART, text):
        fraction = Fraction(re.sub("[ %]", "", text)) / (100 if "%" in text else 1)
        if 0 <= fraction <= 1:
            return RoomPart(float(fraction), text)
        raise QuantityError(f'"{text}" is beyond the free room; give 0 % to 100 %')
    if not text[:1].isalpha():
        return parse_length(value)
    raise QuantityError(
        f'"{shorten(text)}" is not a place ({hint(text, ENDS)}); write low, middle, high, a part of'
        ' the free room such as "30 %", or a length such as "750 mm"'
    )


def place_text(place: Place) -> str:
    """Return a place as typed into a file.

    >>> place_text(0.25), place_text(RoomPart(0.3, "30 %"))
    ('250 mm', '30 %')
    """
    return place.written if isinstance(place, RoomPart) else typed_length(place)


_SCHEMAS = [
    {"enum": [*ENDS]},
    {"type": "string", "pattern": f"^{PART}$", "examples": ["30 %"]},
    get_args(Length)[-1].json_schema,
]
Place = Annotated[
    float | RoomPart, PlainValidator(parse_place), WithJsonSchema({"anyOf": _SCHEMAS})
]
