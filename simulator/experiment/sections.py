"""The keys of an experiment file: forms, units and ranges. What they refer to is checked elsewhere."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, StringConstraints, Tag

from ..geometry.artefacts import AnyArtefactSettings, Coordinates, Name, PairSet
from ..geometry.positions import Axis
from ..machines.settings import ErrorModelSettings
from ..machines.true_machine_settings import TrueMachineSettings, ZeroSettings
from ..quantities import Angle, Length, LengthFunction, PositiveLength
from ..settings import FORM, Settings

Text = Annotated[str, StringConstraints(min_length=1)]
# Without control characters, which would reach the terminal.
Line = Annotated[str, StringConstraints(min_length=1, pattern=r"^[^\x00-\x1f\x7f]*$")]
Count = Annotated[int, Field(ge=1, le=10_000)]
# U6 follows every pair of points.
MOST_POINTS = 40_000
Seed = Annotated[int, Field(ge=0, strict=True)]


BallNames = Annotated[tuple[Name, ...], Field(min_length=1)]
ProbeNames = Annotated[tuple[Name, ...], Field(min_length=1)]
BallSelection = Annotated[
    Annotated[Literal["all"], Tag("<one>")]
    | Annotated[BallNames, Tag("<list>")]
    # Nothing is a mapping here; the list's message says what is expected.
    | Annotated[BallNames, Tag("<mapping>")],
    FORM,
]
CalibratedBalls = Annotated[
    Annotated[Literal["all", "corners"], Tag("<one>")]
    | Annotated[BallNames, Tag("<list>")]
    | Annotated[BallNames, Tag("<mapping>")],
    FORM,
]
ListedPairs = Annotated[tuple[tuple[Name, Name], ...], Field(min_length=1)]
PairSelection = Annotated[
    Annotated[PairSet, Tag("<one>")] | Annotated[ListedPairs, Tag("<list>")] | Annotated[ListedPairs, Tag("<mapping>")],
    FORM,
]


class VolumeSettings(Settings):
    """The measuring volume, axis by axis."""

    x: tuple[Length, Length] = Field(description="lower and upper end of the x axis")
    y: tuple[Length, Length] = Field(description="lower and upper end of the y axis")
    z: tuple[Length, Length] | None = Field(None, description="lower and upper end of the z axis; omitted in 2-D")


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


LengthPerAxis = Annotated[
    Annotated[PositiveLength, Tag("<one>")]
    | Annotated[Edges, Tag("<list>")]
    | Annotated[AxisLengthsSettings, Tag("<mapping>")],
    FORM,
]


class MachineSettings(Settings):
    """The machine: where it can measure and how well it repeats."""

    volume: Annotated[
        Annotated[VolumeSettings, Tag("<mapping>")]
        | Annotated[Edges, Tag("<list>")]
        | Annotated[VolumeSettings, Tag("<one>")],
        FORM,
    ] = Field(description="ends per axis, {x: [0 mm, 1 m], …}, or edges from 0, [1 m, 1 m, 1 m]; two axes: 2-D")
    repeatability: LengthPerAxis = Field(
        description="standard uncertainty of a reading: for every co-ordinate, or one per axis"
    )


class InPlaneSettings(Settings):
    """A point in a machine plane: its co-ordinates along the plane's two axes."""

    x: Length | None = Field(None, description="co-ordinate along x")
    y: Length | None = Field(None, description="co-ordinate along y")
    z: Length | None = Field(None, description="co-ordinate along z")


class PoseSettings(Settings):
    """A free pose x = R y + origin of an artefact."""

    origin: Coordinates = Field(description="where the origin of the artefact's frame is")
    rotation: (
        Annotated[
            Annotated[Angle, Tag("<one>")]
            | Annotated[tuple[Angle, Angle, Angle], Tag("<list>")]
            | Annotated[tuple[Angle, Angle, Angle], Tag("<mapping>")],
            FORM,
        ]
        | None
    ) = Field(None, description="angles about the fixed axes x, then y, then z; a single angle in 2-D; default 0")


class ReadingSettings(Settings):
    """Balls that are read with the same probes."""

    probes: ProbeNames | None = Field(None, description="names of probes; optional if there is exactly one")
    balls: BallSelection = Field("all", description="all, or a list of balls")
    repeats: Count = Field(1, description="how often every ball is read with every probe")
    standard_uncertainty: LengthPerAxis | None = Field(
        None, description="of each of these readings, one length or per axis; default: machine.repeatability"
    )


class PositionSettings(Settings):
    """One position of an artefact and what is read in it."""

    name: Name = Field(description="name of the position, used in tables and messages")
    artefact: Name | None = Field(None, description="name of the artefact; optional if there is exactly one")
    plane: Axis | None = Field(None, description="axis that the artefact's plane is normal to; omitted in 2-D")
    level: Length | None = Field(None, description="co-ordinate of the plane along that axis; omitted in 2-D")
    corner: InPlaneSettings | None = Field(None, description="lower corner of the turned bounding rectangle")
    centre: InPlaneSettings | None = Field(None, description="centre of the bounding rectangle, instead of corner")
    quarter_turns: int | None = Field(
        None, description="turns by 90 degrees, counter-clockwise seen against the plane's normal; default 0"
    )
    pose: PoseSettings | None = Field(None, description="free pose, instead of plane, level and corner")
    probes: ProbeNames | None = Field(None, description="names of probes; optional if there is exactly one")
    balls: BallSelection | None = Field(None, description="all (default), or a list of balls")
    repeats: Count | None = Field(None, description="how often every ball is read with every probe; default 1")
    standard_uncertainty: LengthPerAxis | None = Field(
        None, description="of each reading there, one length or per axis; default: machine.repeatability"
    )
    readings: Annotated[tuple[ReadingSettings, ...], Field(min_length=1)] | None = Field(
        None, description="groups of readings, instead of probes, balls, repeats and standard_uncertainty"
    )


class CertifiedDistance(Settings):
    """A distance from a certificate."""

    balls: tuple[Name, Name] = Field(description="the two balls")
    distance: PositiveLength = Field(description="distance of their centres")


CertifiedDistances = Annotated[tuple[CertifiedDistance, ...], Field(min_length=1)]


class DistancesSettings(Settings):
    """Calibrated distances between balls of an artefact."""

    kind: Literal["distances"] = Field(description="calibrated distances between balls")
    artefact: Name | None = Field(None, description="name of the artefact; optional if there is exactly one")
    pairs: PairSelection = Field(
        description=("corner sides, corner diagonals, corners (both), neighbours, all, or a list of pairs of balls")
    )
    dimensions: Literal[2, 3] | None = Field(
        None, description="3 (default): distances in space; 2: in the artefact's plane"
    )
    standard_uncertainty: LengthFunction = Field(description="of each distance; may grow with it")
    values: (
        Annotated[
            Annotated[Text, Tag("<one>")]
            | Annotated[CertifiedDistances, Tag("<list>")]
            | Annotated[CertifiedDistances, Tag("<mapping>")],
            FORM,
        ]
        | None
    ) = Field(
        None,
        description="CSV file with columns ball_1, ball_2 and distance_mm, or a list of "
        "{balls: [a, b], distance: …}; default: nominal distances",
    )
    form: Literal["distance", "projection"] = Field(
        "distance", description="only for a length standard: distance, or projection on its nominal axis"
    )
    repeatability: Literal["included", "ignored"] = Field(
        "included",
        description="only for a length standard: whether reading it has the machine's repeatability",
    )


class CoordinatesSettings(Settings):
    """Calibrated co-ordinates of balls in their artefact's frame."""

    kind: Literal["coordinates"] = Field(description="calibrated co-ordinates of balls")
    artefact: Name | None = Field(None, description="name of the artefact; optional if there is exactly one")
    balls: CalibratedBalls = Field("all", description="all (default), corners, or a list of balls")
    standard_uncertainty: Annotated[
        Annotated[PositiveLength, Tag("<one>")]
        | Annotated[SomeAxisLengthsSettings, Tag("<mapping>")]
        | Annotated[PositiveLength, Tag("<list>")],
        FORM,
    ] = Field(description="of every co-ordinate, or per axis of the artefact: {x: …, y: …}")
    values: Text | None = Field(
        None, description="CSV file with columns ball, x_mm, y_mm, z_mm; default: nominal co-ordinates"
    )


class RadiusSettings(Settings):
    """The calibrated radius of a Bryan gauge."""

    kind: Literal["radius"] = Field(description="calibrated radius of a Bryan gauge")
    artefact: Name | None = Field(None, description="name of the gauge; optional if there is exactly one artefact")
    value: PositiveLength | None = Field(None, description="the radius certified; default: as drawn")
    standard_uncertainty: PositiveLength = Field(description="of the radius, the same wherever the gauge stands")


CalibrationSettings = Annotated[DistancesSettings | CoordinatesSettings | RadiusSettings, Field(discriminator="kind")]


class PriorSettings(Settings):
    """What is known beforehand of a parameter."""

    parameter: Text = Field(
        description="name as fit reports it, such as EXX[1], EXX t^2 or z low: rotation x; or an error function such "
        "as EAX, for each of its coefficients"
    )
    value: Text | None = Field(
        None, description="value with unit; default 0, of a position's origin the nominal co-ordinate"
    )
    standard_uncertainty: Text = Field(description="standard uncertainty of the value, with unit")


class ProbeSettings(Settings):
    """A probe whose offset is estimated."""

    offset: Coordinates = Field(description="offset from the machine's reference point, as far as it is known")
    standard_uncertainty: LengthPerAxis | None = Field(
        None, description="of the stated offset, one length or per axis; the offset is then estimated"
    )
    unknown: bool = Field(False, description="whether the offset is estimated without being known beforehand")
    reference: bool = Field(
        False, description="whether this probe's offset is held, which says what others are relative to; default: first"
    )


AnyProbe = Annotated[
    Annotated[Coordinates, Tag("<list>")]
    | Annotated[ProbeSettings, Tag("<mapping>")]
    | Annotated[Coordinates, Tag("<one>")],
    FORM,
]


class PointsSettings(Settings):
    """Evaluation points that are not listed: drawn at random, or read from a file."""

    random: Annotated[int, Field(ge=1, le=MOST_POINTS)] | None = Field(
        None, description="number of points drawn evenly in the volume"
    )
    seed: Seed | None = Field(None, description="seed of the draw; default 1")
    file: Text | None = Field(None, description="CSV file with columns x_mm, y_mm, z_mm")


class EvaluationSettings(Settings):
    """Where the uncertainty of the machine is evaluated."""

    points: Annotated[
        Annotated[PointsSettings, Tag("<mapping>")]
        | Annotated[Annotated[tuple[Coordinates, ...], Field(min_length=1, max_length=MOST_POINTS)], Tag("<list>")]
        | Annotated[PointsSettings, Tag("<one>")],
        FORM,
    ] = Field(description="{random: 200, seed: 1}, {file: points.csv}, or a list of co-ordinates")
    probe: Name | None = Field(None, description="probe that the points are measured with; default: the first")


class ExperimentSettings(Settings):
    """A ball-plate experiment on a co-ordinate measuring machine."""

    title: Line = Field(description="what the experiment is, in a line")
    description: Text | None = Field(None, description="what else is worth knowing")
    machine: MachineSettings = Field(description="measuring volume and repeatability")
    error_model: ErrorModelSettings = Field(  # type: ignore[valid-type,unused-ignore]
        description="the errors of the machine that are estimated"
    )
    true_machine: TrueMachineSettings = Field(
        default_factory=ZeroSettings, description="the errors that simulated readings have; default zero"
    )
    probes: Annotated[dict[Name, AnyProbe], Field(min_length=1)] | None = Field(
        None,
        description="name → offset of the probe from the machine's reference point, or {offset: …, "
        "standard_uncertainty: …} where it is estimated; optional in 2-D",
    )
    artefacts: Annotated[dict[Name, AnyArtefactSettings], Field(min_length=1)] = Field(
        description="name → artefact: grid, square, balls, two_spheres, sphere or bryan_gauge"
    )
    positions: Annotated[tuple[PositionSettings, ...], Field(min_length=1)] = Field(
        description="where the artefacts are put and what is read there"
    )
    calibration: tuple[CalibrationSettings, ...] = Field(
        (), description="what is known of the artefacts: distances, coordinates, radius; may be empty"
    )
    priors: Annotated[tuple[PriorSettings, ...], Field(min_length=1)] | None = Field(
        None, description="what is known beforehand of machine errors and poses"
    )
    evaluation: EvaluationSettings | None = Field(None, description="where the machine's uncertainty is evaluated")
    target_accuracy: LengthFunction | None = Field(
        None, description="accuracy to be reached, such as 0.5 um + L/1000000"
    )
    sigma: Literal["estimated", "given"] = Field(
        "estimated",
        description="whether the scale of all uncertainties is estimated from the residuals or given",
    )
    expected_rank_deficiency: Annotated[int, Field(ge=0, strict=True)] | None = Field(
        None, description="number of undetermined parameters that is accepted as intended"
    )
    seed: Seed = Field(1, description="seed of simulated readings; default 1")
    variants: Annotated[dict[Name, dict[Text, Any]], Field(min_length=1)] | None = Field(
        None,
        description=("name → {path: new value}; the path is such as positions[1].level or positions[z low].level"),
    )
