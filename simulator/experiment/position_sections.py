"""The keys of positions and calibration, in an experiment and in its pool."""

from __future__ import annotations

from typing import Annotated, Literal

from ballplate.simulator.geometry.ball_layouts import BallNames, Name
from ballplate.simulator.geometry.positions import Axis
from ballplate.simulator.inputs.quantity_types import Angle, PositiveLength
from ballplate.simulator.inputs.room_parts import Place
from ballplate.simulator.inputs.settings import Forms, NonEmpty, Settings
from pydantic import Field

Count = Annotated[int, Field(ge=1, le=10_000)]
ProbeNames = NonEmpty[Name]
BallSelection = Forms[Literal["all"], BallNames, BallNames]


# Those beyond are refused when the position is placed, with what is meant.
QuarterTurns = Annotated[int, Field(json_schema_extra={"minimum": 0, "maximum": 3})]


PLACE = "a length, or low, middle, high or a part such as 30 % of the free room"


class AxisLengthsSettings(Settings):
    """A length above zero per axis."""

    x: PositiveLength = Field(description="along x")
    y: PositiveLength = Field(description="along y")
    z: PositiveLength | None = Field(None, description="along z; omitted in 2-D")


Edges = Annotated[tuple[PositiveLength, ...], Field(min_length=2, max_length=3)]


LengthPerAxis = Forms[PositiveLength, Edges, AxisLengthsSettings]


class PoseSettings(Settings):
    """A free pose x = R y + origin of an artefact."""

    origin: Annotated[tuple[Place, ...], Field(min_length=2, max_length=3)] = Field(
        description=(
            "location of the origin of the artefact's frame; a part of the free room moves the box"
            " around its balls"
        )
    )
    rotation: Forms[Angle, tuple[Angle, Angle, Angle], tuple[Angle, Angle, Angle]] | None = Field(
        None,
        description=(
            "angles about the fixed axes x, then y, then z; a single angle in 2-D; default 0"
        ),
    )


class ReadingSettings(Settings):
    """Balls that are read with the same probes."""

    probes: ProbeNames | None = Field(
        None, description="names of probes; optional if there is exactly one"
    )
    balls: BallSelection = Field("all", description="all, or a list of balls")
    repeats: Count = Field(1, description="how often every ball is read with every probe")
    standard_uncertainty: LengthPerAxis | None = Field(
        None,
        description=(
            "of each of these readings, one length or per axis; default: machine.repeatability"
        ),
    )


class PositionSettings(Settings):
    """One position of an artefact and what is read in it."""

    name: Name = Field(description="name of the position, used in tables and messages")
    description: Name | None = Field(
        None, description="one-line description in addition to a short name; shown on run sheets"
    )
    enabled: bool = Field(
        True, description="false: the position stays in the file, and is not read"
    )
    artefact: Name | None = Field(
        None, description="name of the artefact; optional if there is exactly one"
    )
    plane: Axis | None = Field(
        None, description="axis that the artefact's plane is normal to; omitted in 2-D"
    )
    level: Place | None = Field(
        None,
        description=f"co-ordinate of the plane along that axis, {PLACE}; omitted in 2-D",
    )
    corner: dict[Axis, Place] | None = Field(
        None,
        description=(
            "lower corner of the turned bounding rectangle: along each of the plane's two axes,"
            f" {PLACE}"
        ),
    )
    centre: dict[Axis, Place] | None = Field(
        None, description="centre of the bounding rectangle, instead of corner"
    )
    quarter_turns: QuarterTurns | None = Field(
        None,
        description=(
            "0 to 3 turns by 90 degrees, counter-clockwise seen against the plane's normal;"
            " default 0"
        ),
    )
    pose: PoseSettings | None = Field(
        None, description="free pose, instead of plane, level and corner"
    )
    probes: ProbeNames | None = Field(
        None, description="names of probes; optional if there is exactly one"
    )
    balls: BallSelection | None = Field(None, description="all (default), or a list of balls")
    repeats: Count | None = Field(
        None, description="how often every ball is read with every probe; default 1"
    )
    standard_uncertainty: LengthPerAxis | None = Field(
        None,
        description="of each reading there, one length or per axis; default: machine.repeatability",
    )
    readings: NonEmpty[ReadingSettings] | None = Field(
        None,
        description=(
            "groups of readings, instead of probes, balls, repeats and standard_uncertainty"
        ),
    )
