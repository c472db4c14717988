"""The keys of a map file: forms, units and ranges."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from ballplate.simulator.experiment import DRAFT, Line, VolumeSettings, tidied
from ballplate.simulator.geometry import Name
from ballplate.simulator.inputs import Day, Length, NonEmpty, Settings, Text
from ballplate.simulator.machines import ErrorModelSettings, Unit
from pydantic import Field, StringConstraints

Sha256 = Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")]
Fingerprint = Annotated[str, StringConstraints(pattern="^[0-9a-f]{16}$")]
PerAxis = Annotated[tuple[Length, ...], Field(min_length=2, max_length=3)]
ROW = "a text of numbers separated by blanks"


class MapProbeSettings(Settings):
    """A probe of a map."""

    offset: PerAxis = Field(description="offset of the tip, estimated or as it was stated")
    estimated: tuple[Literal["x", "y", "z"], ...] = Field(
        (), description="axes of which the offset was estimated"
    )
    nominal: PerAxis | None = Field(
        None, description="of an estimated offset: the value stated before; default: the estimate"
    )


class MapSigmaSettings(Settings):
    """What the stated uncertainties were multiplied by."""

    value: Annotated[float, Field(ge=0)] = Field(
        description="factor of the stated uncertainties, contained in the covariance"
    )
    estimated: bool = Field(description="whether it comes from the residuals, or is given as 1")
    degrees_of_freedom: Annotated[int, Field(ge=0)] = Field(
        description="observations less parameters that they determine"
    )
    sum_of_squares: Annotated[float, Field(ge=0)] = Field(
        description=(
            "weighted sum of squares of the residuals at the stated uncertainties, with as many"
            " degrees of freedom"
        ),
    )


class MapParameterSettings(Settings):
    """A parameter of the error model, by its name there."""

    name: Text = Field(description="as the error model names it")
    unit: Unit = Field(description="m, rad or 1")
    # Beyond it are no errors of machines, and squares that are not finite.
    value: Annotated[float, Field(ge=-1000, le=1000)] = Field(
        description="the estimate, in that unit"
    )


class LeftOutSettings(Settings):
    """An estimate of the fit that the map does not apply."""

    name: Text = Field(description="as fit reports it")
    kind: Text = Field(description="type of the estimate, such as influence")
    unit: Unit = Field(description="its unit")
    value: float | None = Field(None, description="the estimate; left out: undetermined")
    standard_uncertainty: float | None = Field(None, description="of the estimate")


class MapDataSettings(Settings):
    """The readings that a map comes from."""

    readings: Annotated[int, Field(ge=0)] = Field(description="how many")
    sha256: Sha256 = Field(description="SHA-256 of their content")
    positions: tuple[Fingerprint, ...] = Field(
        (), description="fingerprints of each position's readings, those of a prior map included"
    )


class LackOfFitSettings(Settings):
    """The residuals of the fit that a map comes from, at the uncertainties stated."""

    sum_of_squares: Annotated[float, Field(ge=0)] = Field(description="weighted sum of squares S^2")
    degrees_of_freedom: Annotated[int, Field(ge=0)] = Field(
        description="observations less parameters that they determine"
    )
    suspected: Annotated[int, Field(ge=0)] = Field(
        0, description="gross errors that the fit suspected among the readings"
    )
    has_pattern: bool = Field(
        True, description="whether residuals have a pattern that noise does not explain"
    )
    contradicted: tuple[Text, ...] = Field(
        (), description="causes that the readings showed against assumptions of the experiment"
    )


class MapSettings(Settings):
    """A map file, which fit writes."""

    map: Literal[1] = Field(description="version of the format: 1")
    title: Line = Field(description="title of the experiment")
    experiment: str = Field("", description="name of the experiment's file and variant")
    date: Day | None = Field(None, description="day of the campaign, such as 2026-11-22")
    program: str = Field("", description="program that wrote the file")
    extensions: tuple[Text, ...] = Field(
        (),
        description="names of extensions that the error model needs in addition to those shipped",
    )
    error_model: ErrorModelSettings = Field(  # type: ignore[valid-type]
        description="error model, as in an experiment file"
    )
    files: dict[str, Sha256] = Field(
        default={},
        description="name of a file that the error model rests on → SHA-256 of its content",
    )
    volume: VolumeSettings = Field(description="measuring volume, ends of each axis")
    frame: str = Field("", description="which motion of the whole machine the error model holds")
    repeatability: PerAxis = Field(
        description="stated standard uncertainty of a reading along each axis"
    )
    probes: dict[Name, MapProbeSettings] = Field(min_length=1, description="probes by name")
    probe: Name = Field(description="probe used if none is named")
    sigma: MapSigmaSettings = Field(
        description="factor of the stated uncertainties, and degrees of freedom"
    )
    coverage_factor: Annotated[float, Field(ge=1, le=10)] = Field(
        2.0, description="factor of expanded uncertainties"
    )
    temperatures: dict[str, float] | None = Field(
        None, description="temperatures in degrees Celsius: reference, scales, artefact"
    )
    data: MapDataSettings | None = Field(None, description="the readings that the map comes from")
    lack_of_fit: LackOfFitSettings = Field(description="residuals of the fit")
    left_out: tuple[LeftOutSettings, ...] = Field(
        (), description="estimates of the fit that the map does not apply"
    )
    parameters: NonEmpty[MapParameterSettings] = Field(
        description="parameters of the error model with their estimates, in its order"
    )
    undetermined: tuple[str | float | int, ...] = Field(
        (), description=f"directions that were not determined, each {ROW}, one for each parameter"
    )
    covariance: NonEmpty[str | float | int] = Field(
        description=(
            "covariance of the parameters, then of the estimated offsets of probes by probe and"
            f" axis, sigma contained: rows of the lower triangle, each {ROW}, in products of the"
            " units"
        )
    )
    checksum: Sha256 | None = Field(
        None, description="SHA-256 of the file's content; left out of a file written by hand"
    )


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a map file in YAML."""
    schema: dict[str, Any] = tidied(MapSettings.model_json_schema())
    return {"$schema": DRAFT, **schema, "title": "ballplate map"}
