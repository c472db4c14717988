"""The keys of probes, heads, stars and positions."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from ballplate.simulator.geometry.ball_layouts import BallNames, Coordinates
from ballplate.simulator.geometry.poses import Axis
from ballplate.simulator.inputs.quantity_types import Angle, Place, PositiveLength
from ballplate.simulator.inputs.settings import Forms, Name, NonEmpty, Settings, Text
from pydantic import Field, model_validator

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


StarProbes = Annotated[tuple[Name, ...], Field(min_length=2)]


class ProbeSettings(Settings):
    """A probe whose offset is estimated, or stated by the angles of a head."""

    offset: Coordinates | None = Field(
        None, description="offset from the machine's reference point, as far as it is known"
    )
    a: Angle | None = Field(
        None, alias="A", description="angle A of the head, 0 if the stylus points down"
    )
    b: Angle | None = Field(
        None, alias="B", description="angle B of the head, about the machine's z axis; default 0"
    )
    tip: Coordinates | None = Field(
        None, description="tip from the head's centre at A = 0 and B = 0; default: head.tip"
    )
    standard_uncertainty: LengthPerAxis | None = Field(
        None,
        description="of the stated offset, one length or per axis; the offset is then estimated",
    )
    unknown: bool = Field(
        False, description="whether the offset is estimated without prior knowledge of it"
    )
    reference: bool = Field(
        False,
        description=(
            "whether this probe's offset is held as the reference of the others; default: first"
        ),
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.offset is None) == (self.a is None):
            raise ValueError('needs either "offset" or the angle "A"; give exactly one of them')
        if self.a is None and (self.b is not None or self.tip is not None):
            raise ValueError('"B" and "tip" belong to the angle "A"; add it, or remove them')
        return self


AnyProbe = Forms[Coordinates, Coordinates, ProbeSettings]


class HeadSettings(Settings):
    """An articulating head: angle A tilts the stylus, B turns it about the machine's z axis."""

    centre: Coordinates | None = Field(
        None,
        description=(
            "offset of the centre that both axes go through from the machine's reference point;"
            " default: there"
        ),
    )
    tip: Coordinates | None = Field(
        None, description="tip from the centre at A = 0 and B = 0, such as [0 mm, 0 mm, -120 mm]"
    )


class StarSettings(Settings):
    """Probes whose tips are known among one another; where the star points is estimated."""

    probes: StarProbes | None = Field(None, description="names of its probes; default: all")
    standard_uncertainty: PositiveLength = Field(
        description="of each co-ordinate of a tip in the star's own frame"
    )
    place: Literal["stated", "unknown"] = Field(
        "stated",
        description=(
            "stated (default): the star turns about the machine's reference point; unknown: its"
            " location is estimated too, relative to the probe that is the reference"
        ),
    )
    values: Text | None = Field(
        None,
        description=(
            "CSV file with the tips in the star's frame, columns probe, x_mm, y_mm, z_mm; default:"
            " the offsets of the probes"
        ),
    )
