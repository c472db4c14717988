"""The keys of an experiment file: forms, units and ranges. References between them are checked in
`_checks`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from ballplate.simulator.design.influence_quantities import DesignParts, Influence
from ballplate.simulator.design.objects import Distribution, NoiseSettings
from ballplate.simulator.geometry.artefacts import ARTEFACTS, AnyArtefactSettings
from ballplate.simulator.geometry.ball_layouts import Coordinates
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.quantity_types import Day, Length, PositiveLength, TargetFunction
from ballplate.simulator.inputs.settings import Forms, Name, NonEmpty, Settings, Several, Text
from ballplate.simulator.inputs.validation import OpenKinds
from ballplate.simulator.machines.settings import ErrorModelSettings
from ballplate.simulator.machines.truth import TrueMachineSettings, ZeroSettings
from pydantic import Discriminator, Field, StringConstraints, Tag, model_validator

from .calibrations import CalibrationSettings
from .pool_sections import PoolSettings
from .position_sections import (
    AnyProbe,
    Edges,
    HeadSettings,
    LengthPerAxis,
    PositionSettings,
    StarSettings,
)
from .readings_section import ReadingsSettings
from .references import References


class InfluenceSettings(Settings):
    """Settings of one influence quantity, with a `kind` of its own.

    If it is `in_order` it depends on the time of readings: a plan chooses without it.
    """

    in_order: ClassVar[bool] = False

    def check(self, steps: Steps, positions: Mapping[str, str], references: References) -> None:
        """Report faults, given `positions`: names with those of their artefacts."""

    def influence(self, design: DesignParts) -> Influence:
        """Return the influence quantity in a design.

        :raises ValueError: the design lacks data that it needs.
        """
        raise NotImplementedError


if TYPE_CHECKING:
    AnyInfluence = InfluenceSettings
else:
    AnyInfluence = Annotated[InfluenceSettings, OpenKinds("influences", InfluenceSettings)]


# Without control characters, which would reach the terminal.
Line = Annotated[str, StringConstraints(min_length=1, pattern=r"^[^\x00-\x1f\x7f]*$")]
# U6 follows every pair of points.
MOST_POINTS = 40_000
Seed = Annotated[int, Field(ge=0, strict=True)]


class VolumeSettings(Settings):
    """The measuring volume, axis by axis."""

    x: tuple[Length, Length] = Field(description="lower and upper end of the x axis")
    y: tuple[Length, Length] = Field(description="lower and upper end of the y axis")
    z: tuple[Length, Length] | None = Field(
        None, description="lower and upper end of the z axis; omitted in 2-D"
    )


class MachineSettings(Settings):
    """The machine: where it can measure and how well it repeats."""

    volume: Forms[VolumeSettings, Edges, VolumeSettings] = Field(
        description=(
            "ends per axis, {x: [0 mm, 1 m], …}, or edges from 0, [1 m, 1 m, 1 m]; two axes: 2-D"
        )
    )
    repeatability: LengthPerAxis = Field(
        description="standard uncertainty of a reading: for every co-ordinate, or one per axis"
    )


class PriorSettings(Settings):
    """Prior knowledge of a parameter."""

    parameter: Text = Field(
        description=(
            "name as fit reports it, such as EXX[1], EXX t^2 or z low: rotation x; or an error"
            " function such as EAX, for each of its coefficients"
        )
    )
    value: Text | None = Field(
        None,
        description="value with unit; default 0, of a position's origin the nominal co-ordinate",
    )
    standard_uncertainty: Text = Field(description="standard uncertainty of the value, with unit")


class MapPriorSettings(Settings):
    """What the map of an earlier campaign tells of the machine."""

    kind: Literal["map"] = Field(description="the map of an earlier campaign")
    file: Text = Field(description="map file, as ballplate fit -o writes it")
    inflation: Annotated[float, Field(ge=1, le=1e6)] = Field(
        1.0, description="factor of the map's standard uncertainties; default 1"
    )
    drift_per_year: PositiveLength | None = Field(
        None,
        description=(
            "standard uncertainty by which each parameter's effect may have changed in a year, such"
            " as 0.5 um"
        ),
    )
    years: Annotated[float, Field(ge=0, le=1000)] | None = Field(
        None, description="years since the campaign of the map"
    )
    date: Day | None = Field(
        None, description="day of this campaign, such as 2027-05-22, instead of years"
    )
    offsets: bool = Field(
        False,
        description=(
            "whether the map's estimates of probe offsets count as well, of probes by the same"
            " names that are estimated here and have not been changed; default: false"
        ),
    )

    @model_validator(mode="after")
    def _one_age(self) -> Self:
        if self.years is not None and self.date is not None:
            raise ValueError("gives the age twice; give either years or date")
        if self.drift_per_year is None and (self.years, self.date) != (None, None):
            raise ValueError("an age needs a drift; add drift_per_year: 0.5 um, or leave it out")
        return self


def _form_of_prior(value: Any) -> str:
    settings = value if isinstance(value, dict) else {}
    return "<map>" if {"kind", "file"} & settings.keys() else "<parameter>"


AnyPrior = Annotated[
    Annotated[PriorSettings, Tag("<parameter>")] | Annotated[MapPriorSettings, Tag("<map>")],
    Discriminator(_form_of_prior),
]


class PointsSettings(Settings):
    """Evaluation points that are not listed: drawn at random, or read from a file."""

    random: Annotated[int, Field(ge=1, le=MOST_POINTS)] | None = Field(
        None, description="number of points drawn evenly in the volume"
    )
    seed: Seed | None = Field(None, description="seed of the draw; default 1")
    file: Text | None = Field(None, description="CSV file with columns x_mm, y_mm, z_mm")


class TaskSettings(Settings):
    """A measuring task: a length that the corrected machine is to measure."""

    name: Name = Field(description="name of the task, used in tables and messages")
    start: Coordinates = Field(
        alias="from", description="start of the length: co-ordinates as those of points"
    )
    to: Coordinates = Field(description="end of the length")
    probe: Name | None = Field(
        None, description="probe that both ends are measured with; default: evaluation.probe"
    )
    probes: tuple[Name, Name] | None = Field(
        None, description="probes of the two ends, instead of probe"
    )
    target_uncertainty: TargetFunction | None = Field(
        None,
        description=("target uncertainty of the task; default: target_uncertainty of the file"),
    )


class EvaluationSettings(Settings):
    """Where the uncertainty of the machine is evaluated."""

    points: (
        Forms[
            PointsSettings,
            Annotated[tuple[Coordinates, ...], Field(min_length=1, max_length=MOST_POINTS)],
            PointsSettings,
        ]
        | None
    ) = Field(
        None,
        description=(
            "{random: 200, seed: 1}, {file: points.csv}, or a list of co-ordinates; optional if"
            " tasks are given"
        ),
    )
    probe: Name | None = Field(
        None, description="probe that the points are measured with; default: the first"
    )
    tasks: Several[TaskSettings] | None = Field(
        None,
        description="list of lengths that the machine is to measure, {name: …, from: …, to: …}",
    )


class ExperimentSettings(Settings):
    """A ball-plate experiment on a co-ordinate measuring machine."""

    title: Line = Field(description="one-line description of the experiment")
    description: Text | None = Field(None, description="further notes")
    machine: MachineSettings = Field(description="measuring volume and repeatability")
    error_model: ErrorModelSettings = Field(  # type: ignore[valid-type,unused-ignore]
        description="the errors of the machine that are estimated"
    )
    true_machine: TrueMachineSettings = Field(
        default_factory=ZeroSettings,
        description="the errors that simulated readings have; default zero",
    )
    probes: Annotated[dict[Name, AnyProbe], Field(min_length=1)] | None = Field(
        None,
        description=(
            "name → offset of the probe from the machine's reference point, or {offset: …,"
            " standard_uncertainty: …} if it is estimated; optional in 2-D"
        ),
    )
    head: HeadSettings | None = Field(
        None, description="articulating head, whose angles A and B probes may be stated by"
    )
    stars: NonEmpty[StarSettings] | None = Field(
        None, description="probes whose tips are known relative to one another, as one body"
    )
    artefacts: Annotated[dict[Name, AnyArtefactSettings], Field(min_length=1)] = Field(
        description=f"name → artefact: {', '.join(ARTEFACTS)}"
    )
    positions: NonEmpty[PositionSettings] = Field(
        description="placements of the artefacts and the balls read in each"
    )
    calibration: tuple[CalibrationSettings, ...] = Field(
        (),
        description=(
            "calibrated values of the artefacts: distances, coordinates, radius; may be empty"
        ),
    )
    pool: PoolSettings | None = Field(
        None, description="candidates from which ballplate plan chooses positions and calibration"
    )
    priors: NonEmpty[AnyPrior] | None = Field(
        None, description="prior knowledge of machine errors and poses, or a map of the machine"
    )
    readings: ReadingsSettings | None = Field(
        None, description="the laboratory's readings: their files and format"
    )
    influences: NonEmpty[AnyInfluence] | None = Field(
        None, description="effects on readings, such as temperature, probing or drift"
    )
    evaluation: EvaluationSettings | None = Field(
        None, description="points and lengths for which the machine's uncertainty is evaluated"
    )
    target_uncertainty: TargetFunction | None = Field(
        None,
        description=(
            "largest standard uncertainty, or coverage_factor times that, that is accepted, such as"
            " 0.5 um + L/1000000 with L in metres, or 0.9 um + 2.5 um/m"
        ),
    )
    coverage_factor: Annotated[float, Field(ge=1, le=10, strict=True)] = Field(
        1.0,
        description=(
            "k of the expanded uncertainty U = k u that is compared with"
            " target_uncertainty; default 1, the standard uncertainty u"
        ),
    )
    sigma: Literal["estimated", "given"] = Field(
        "estimated",
        description=(
            "whether the scale of all uncertainties is estimated from the residuals or given"
        ),
    )
    expected_rank_deficiency: Annotated[int, Field(ge=0, strict=True)] | None = Field(
        None, description="number of undetermined parameters that is accepted as intended"
    )
    noise: Forms[Distribution, NoiseSettings, NoiseSettings] = Field(
        "normal",
        description=(
            "distribution of the noise of readings that are simulated: normal (default), uniform,"
            " or {distribution: student t, degrees_of_freedom: 5, correlation: 0.2}"
        ),
    )
    seed: Seed = Field(1, description="seed of simulated readings; default 1")
    extensions: NonEmpty[Text] | None = Field(
        None, description="names of extensions that the file needs in addition to those shipped"
    )
    variants: Annotated[dict[Name, dict[Text, Any]], Field(min_length=1)] | None = Field(
        None,
        description=(
            "name → {path: new value}; the path is such as positions[1].level or positions[z"
            " low].level"
        ),
    )
