"""The key `assumptions` of an experiment file: what to take in place of each assumption."""

from __future__ import annotations

from typing import Annotated

from ballplate.simulator.inputs import (
    CommonPart,
    LengthDrift,
    PositiveLength,
    PositiveTemperatureDifference,
    Settings,
)
from pydantic import Field


class AssumptionsSettings(Settings):
    """What holds if an assumption of the prediction does not; default: usual values."""

    tips: PositiveLength | None = Field(
        None, description="standard uncertainty of each offset of a tip; default 0.5 um"
    )
    common: CommonPart | None = Field(
        None,
        description=(
            "standard uncertainty that the values of a certificate have in common; default: what"
            " grows with length, or else a correlation of 0.9"
        ),
    )
    temperature: PositiveTemperatureDifference | None = Field(
        None,
        description=(
            "standard uncertainty of the temperatures of artefacts and scales, in all positions"
            " alike and in each; default 0.1 K"
        ),
    )
    sag: PositiveLength | None = Field(
        None,
        description=(
            "standard uncertainty of a plate's largest sag; default 0.3 um of a plate of 0.5 m,"
            " with the square of its size"
        ),
    )
    drift: LengthDrift | None = Field(
        None, description="standard uncertainty of the drift along each axis; default 0.3 um/h"
    )
    reindexing: PositiveLength | None = Field(
        None, description="repeatability of re-indexing of a head; default 0.3 um"
    )
    scatter: Annotated[float, Field(gt=1, le=100)] | None = Field(
        None, description="factor by which readings scatter more than stated; default 1.5"
    )


SETTINGS = AssumptionsSettings
