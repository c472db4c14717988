"""Types of quantities in files: how each is parsed, and what its pattern in the schema is."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from fractions import Fraction
from functools import partial
from typing import Annotated, Any, get_args

from pydantic import (
    AfterValidator,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PlainValidator,
    WithJsonSchema,
)
from pydantic_core import CoreSchema, core_schema

from .quantities import (
    LENGTH_FUNCTION_EXAMPLE,
    NUMBER,
    LengthFunction,
    QuantityError,
    parse_common_part,
    parse_duration,
    parse_length,
    parse_length_function,
    parse_quantity,
    parse_temperature,
)
from .settings import hint, shorten
from .units import KINDS, typed_length


@dataclass(frozen=True)
class StatedForm:
    """How a file states a quantity: its reader, and a pattern and examples for the schema."""

    read: Callable[[object], Any]
    pattern: str
    examples: tuple[str, ...]

    @property
    def json_schema(self) -> dict[str, Any]:
        """The schema of its text."""
        return {"type": "string", "pattern": self.pattern, "examples": list(self.examples)}

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return self.json_schema


def _pattern(kind: str) -> str:
    names = [re.escape(unit) for unit in KINDS[kind].units]
    names += ["[µμ]" + name[1:] for name in names if name.startswith("u")]
    return f" *{NUMBER} *({'|'.join(names)})"


def _of(kind: str, *examples: str, **limits: bool) -> StatedForm:
    return StatedForm(partial(parse_quantity, kind=kind, **limits), f"^{_pattern(kind)}$", examples)


GROWING_PATTERN = f"^{_pattern('length')}( *\\+( *L */ *{NUMBER}|{_pattern('ratio')}) *)?$"
GROWING_EXAMPLES = (LENGTH_FUNCTION_EXAMPLE, "0.9 um + 2.5 um/m")
Length = Annotated[float, _of("length", "750 mm", "0.2 um", "12.5 in")]
PositiveLength = Annotated[float, _of("length", "750 mm", "0.2 um", above_zero=True)]
LengthUncertainty = Annotated[float, _of("length", "0.2 um", "0 um", above_zero=True, or_zero=True)]
TargetFunction = Annotated[
    LengthFunction,
    StatedForm(parse_length_function, GROWING_PATTERN, ("0.2 um", *GROWING_EXAMPLES)),
]
UncertaintyFunction = Annotated[
    LengthFunction,
    StatedForm(
        partial(parse_length_function, or_zero=True),
        GROWING_PATTERN,
        ("0.2 um", "0 um", *GROWING_EXAMPLES),
    ),
]
CommonPart = Annotated[
    LengthFunction,
    StatedForm(
        parse_common_part,
        f"{GROWING_PATTERN}|^{_pattern('ratio')}$",
        ("0.5 um/m", "0.1 um + 0.5 um/m", *GROWING_EXAMPLES),
    ),
]
Angle = Annotated[float, _of("angle", "90 deg", "2 arcsec", "5 urad")]
PositiveAngle = Annotated[float, _of("angle", "2 arcsec", "5 urad", above_zero=True)]
TemperatureDifference = Annotated[float, _of("temperature difference", "1.5 degC", "-0.3 K")]
PositiveTemperatureDifference = Annotated[
    float, _of("temperature difference", "0.5 degC", above_zero=True)
]
Temperature = Annotated[float, StatedForm(parse_temperature, f"^ *{NUMBER} *degC$", ("20.3 degC",))]
Expansion = Annotated[float, _of("thermal expansion", "11 um/m/degC")]
Bending = Annotated[float, _of("angle per length", "5 urad/m")]
Ratio = Annotated[float, _of("ratio", "5 ppm", "0.1 %", "1.2 um/m")]
Duration = Annotated[
    float,
    StatedForm(parse_duration, f"^{_pattern('duration')}$", ("20 min", "15 s", "1.5 h")),
]
LengthDrift = Annotated[float, _of("length per time", "0.5 um/h", "-2 nm/min")]
RatioDrift = Annotated[float, _of("ratio per time", "0.3 ppm/h")]


ENDS = {"low": 0.0, "middle": 0.5, "high": 1.0}
PART = r" *([+-]?[0-9]{1,9}(\.[0-9]{1,20})? *%|[0-9]{1,9} */ *[1-9][0-9]{0,8}) *"


@dataclass(frozen=True)
class RoomPart:
    """A part of the free room along an axis as ``written``: from its low end, 0, to its high end,
    1.
    """

    fraction: float
    written: str


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


def parse_day(text: str) -> date:
    """Return the day that a text such as 2026-11-22 names.

    :raises ValueError: it is no day.

    >>> parse_day("2026-11-22").year
    2026
    """
    try:
        if re.fullmatch(r"[0-9]{4}-[0-9]{2}-[0-9]{2}", text):
            return date.fromisoformat(text)
    except ValueError:
        pass
    raise ValueError(f'"{text[:20]}" is no day; write it as 2026-11-22')


def stated_day(text: str) -> str:
    """Return a text that names a day, unchanged.

    :raises ValueError: it is no day.
    """
    parse_day(text)
    return text


Day = Annotated[str, AfterValidator(stated_day)]
"""A day in a file."""
