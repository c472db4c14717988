"""Types of quantities in files: how each is parsed, and what its pattern in the schema is."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from .quantities import (
    LENGTH_FUNCTION_EXAMPLE,
    NUMBER,
    LengthFunction,
    parse_common_part,
    parse_duration,
    parse_length_function,
    parse_quantity,
    parse_temperature,
)
from .units import KINDS


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
