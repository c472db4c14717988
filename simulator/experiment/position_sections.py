"""The keys of positions and calibration, in an experiment and in its pool."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from ..geometry.artefacts import Coordinates, Name, PairSet
from ..geometry.positions import Axis
from ..inputs.quantities import Angle, Length, LengthFunction, PositiveLength
from ..inputs.settings import Forms, NonEmpty, Settings

Text = Annotated[str, StringConstraints(min_length=1)]
Count = Annotated[int, Field(ge=1, le=10_000)]
BallNames = NonEmpty[Name]
ProbeNames = NonEmpty[Name]
BallSelection = Forms[Literal["all"], BallNames, BallNames]
CalibratedBalls = Forms[Literal["all", "corners"], BallNames, BallNames]
ListedPairs = NonEmpty[tuple[Name, Name]]
PairSelection = Forms[PairSet, ListedPairs, ListedPairs]


# Those beyond are refused when the position is placed, with what is meant.
QuarterTurns = Annotated[int, Field(json_schema_extra={"minimum": 0, "maximum": 3})]


class AxisLengthsSettings(Settings):
    """A length above zero per axis."""

    x: PositiveLength = Field(description="along x")
    y: PositiveLength = Field(description="along y")
    z: PositiveLength | None = Field(None, description="along z; omitted in 2-D")


class SomeAxisLengthsSettings(Settings):
    """A length above zero for some axes."""

    x: PositiveLength | None = Field(None, description="along x; omitted: x is not calibrated")
    y: PositiveLength | None = Field(None, description="along y; omitted: y is not calibrated")
    z: PositiveLength | None = Field(None, description="along z; omitted: z is not calibrated")


Edges = Annotated[tuple[PositiveLength, ...], Field(min_length=2, max_length=3)]


LengthPerAxis = Forms[PositiveLength, Edges, AxisLengthsSettings]


class InPlaneSettings(Settings):
    """A point in a machine plane: its co-ordinates along the plane's two axes."""

    x: Length | None = Field(None, description="co-ordinate along x")
    y: Length | None = Field(None, description="co-ordinate along y")
    z: Length | None = Field(None, description="co-ordinate along z")


class PoseSettings(Settings):
    """A free pose x = R y + origin of an artefact."""

    origin: Coordinates = Field(description="where the origin of the artefact's frame is")
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
    artefact: Name | None = Field(
        None, description="name of the artefact; optional if there is exactly one"
    )
    plane: Axis | None = Field(
        None, description="axis that the artefact's plane is normal to; omitted in 2-D"
    )
    level: Length | None = Field(
        None, description="co-ordinate of the plane along that axis; omitted in 2-D"
    )
    corner: InPlaneSettings | None = Field(
        None, description="lower corner of the turned bounding rectangle"
    )
    centre: InPlaneSettings | None = Field(
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


class CertifiedDistance(Settings):
    """A distance from a certificate."""

    balls: tuple[Name, Name] = Field(description="the two balls")
    distance: PositiveLength = Field(description="distance of their centres")


CertifiedDistances = NonEmpty[CertifiedDistance]


class DistancesSettings(Settings):
    """Calibrated distances between balls of an artefact."""

    kind: Literal["distances"] = Field(description="calibrated distances between balls")
    artefact: Name | None = Field(
        None, description="name of the artefact; optional if there is exactly one"
    )
    pairs: PairSelection = Field(
        description=(
            "corner sides, corner diagonals, corners (both), neighbours, all, or a list of pairs of"
            " balls"
        )
    )
    dimensions: Literal[2, 3] | None = Field(
        None, description="3 (default): distances in space; 2: in the artefact's plane"
    )
    standard_uncertainty: LengthFunction = Field(description="of each distance; may grow with it")
    values: Forms[Text, CertifiedDistances, CertifiedDistances] | None = Field(
        None,
        description=(
            "CSV file with columns ball_1, ball_2 and distance_mm, or a list of "
            "{balls: [a, b], distance: …}; default: nominal distances"
        ),
    )
    form: Literal["distance", "projection"] = Field(
        "distance",
        description="only for a length standard: distance, or projection on its nominal axis",
    )
    repeatability: Literal["included", "ignored"] = Field(
        "included",
        description=(
            "only for a length standard: whether reading it has the machine's repeatability"
        ),
    )


class CoordinatesSettings(Settings):
    """Calibrated co-ordinates of balls in their artefact's frame."""

    kind: Literal["coordinates"] = Field(description="calibrated co-ordinates of balls")
    artefact: Name | None = Field(
        None, description="name of the artefact; optional if there is exactly one"
    )
    balls: CalibratedBalls = Field("all", description="all (default), corners, or a list of balls")
    standard_uncertainty: Forms[PositiveLength, PositiveLength, SomeAxisLengthsSettings] = Field(
        description="of every co-ordinate, or per axis of the artefact: {x: …, y: …}"
    )
    values: Text | None = Field(
        None,
        description="CSV file with columns ball, x_mm, y_mm, z_mm; default: nominal co-ordinates",
    )


class RadiusSettings(Settings):
    """The calibrated radius of a Bryan gauge."""

    kind: Literal["radius"] = Field(description="calibrated radius of a Bryan gauge")
    artefact: Name | None = Field(
        None, description="name of the gauge; optional if there is exactly one artefact"
    )
    value: PositiveLength | None = Field(
        None, description="the radius certified; default: as drawn"
    )
    standard_uncertainty: PositiveLength = Field(
        description="of the radius, the same wherever the gauge stands"
    )


CalibrationSettings = Annotated[
    DistancesSettings | CoordinatesSettings | RadiusSettings, Field(discriminator="kind")
]
