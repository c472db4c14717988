"""The keys of a part file. A plain number is a length in mm."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Annotated, Any, Literal, Union

from ballplate.simulator.experiment import DRAFT, Line, tidied
from ballplate.simulator.geometry import Axis, Name
from ballplate.simulator.inputs import (
    Angle,
    Expansion,
    Forms,
    NonEmpty,
    PositiveTemperatureDifference,
    Ratio,
    Settings,
    Temperature,
    Text,
    listing,
    parse_length,
    parse_positive_length,
)
from pydantic import Discriminator, Field, PlainValidator, Tag, WithJsonSchema, create_model


def _read(value: object, read: Callable[[object], float]) -> float:
    return read(f"{value} mm" if isinstance(value, int | float) else value)


NUMBER = WithJsonSchema({"type": ["string", "number"], "examples": ["0.4 um", 30]})
Size = Annotated[float, PlainValidator(partial(_read, read=parse_length)), NUMBER]
Positive = Annotated[float, PlainValidator(partial(_read, read=parse_positive_length)), NUMBER]
Pair = tuple[Size, Size]
Triple = tuple[Size, Size, Size]
Count = Annotated[int, Field(ge=1, le=1000)]
Grid = tuple[Count, Count] | NonEmpty[Triple]
Sided = Literal["x+", "x-", "y+", "y-", "z+", "z-"]
POINTS = "a list of [x, y, z], or a CSV file with columns such as x_mm,y_mm,z_mm"


def _one_of(kinds: Mapping[str, tuple[Any, Any, str]]) -> Any:
    """Return the union of settings that have, each, one more key, by which they are told apart."""

    def key_of(value: Any) -> str | None:
        keys = value if isinstance(value, dict) else ()
        return next((f"<{key}>" for key in kinds if key in keys), None)

    forms = [
        Annotated[
            create_model(  # type: ignore[call-overload]
                key, __base__=base, **{key: (of, Field(description=text))}
            ),
            Tag(f"<{key}>"),
        ]
        for key, (base, of, text) in kinds.items()
    ]
    message = f"has no kind; add one of {listing(kinds, 20)}"
    return Annotated[
        Union[tuple(forms)],  # noqa: UP007
        Discriminator(key_of, custom_error_type="kind", custom_error_message=message),
    ]


class PartExpansion(Settings):
    """Expansion of the part, which takes one temperature (degC)."""

    coefficient: Expansion = Field(
        0.0, alias="expansion", description="coefficient of thermal expansion"
    )
    coefficient_uncertainty: Expansion = Field(
        0.0, alias="expansion_standard_uncertainty", description="of it; default 0"
    )
    temperature: Temperature = Field(20.0, description="temperature of the part; default 20 degC")
    temperature_uncertainty: PositiveTemperatureDifference = Field(
        0.0, alias="standard_uncertainty", description="of the temperature; default 0 K"
    )


class Tip(Settings):
    """The tip of a probe."""

    diameter: Positive = Field(description="diameter, such as 4 or 4 mm")
    standard_uncertainty: Size = Field(0.0, description="of the diameter; default 0")


def _of_one(value: Any) -> str:
    return "one" if isinstance(value, dict) and "diameter" in value else "several"


TipSettings = Annotated[
    Annotated[Tip, Tag("one")] | Annotated[dict[Name, Tip], Tag("several")],
    Discriminator(_of_one),
]


class PointProbing(Settings):
    """How single points are probed."""

    point_repeatability: Positive = Field(
        description="standard deviation of one touched point along its normal"
    )
    stated_tip: TipSettings = Field(alias="tip", description="the tip, or probe: its tip")
    lobing: Size = Field(
        0.0, alias="form", description="half-width of the lobing of each probe; default 0"
    )

    def tip(self, probe: str) -> Tip | None:
        """Return the tip of a probe, or None if none is stated."""
        tips = self.stated_tip
        return tips if isinstance(tips, Tip) else tips.get(probe)


class PartPlaceSettings(Settings):
    """Where the part is on the machine."""

    origin: Triple = Field(description="origin of the part in the machine")
    quarter_turns: int = Field(0, ge=0, le=3, description="turns about z; default 0")
    rotation: tuple[Angle, Angle, Angle] | None = Field(
        None, description="instead: angles about the fixed axes x, then y, then z"
    )


class ShortWaves(Settings):
    """Errors between the machine's model and its true errors."""

    amplitude: Positive = Field(description="their standard deviation")
    correlation_length: Positive = Field(description="distance over which they fade")


class _Feature(Settings):
    probe: Name | None = Field(None, description="probe; default: the one that points best")


class _Point(_Feature):
    normal: Sided = Field(description="direction away from the material")


class _Touched(_Feature):
    points: Forms[Count | Text, NonEmpty[Triple], Count | Text] = Field(
        description=f"their number, or {POINTS}"
    )


class _Listed(_Touched):
    points: Forms[Text, NonEmpty[Triple], Text] = Field(description=POINTS)
    normal: Sided = Field(description="direction away from the material, about")


class _Plane(_Feature):
    at: Size = Field(description="where it is along its normal")
    start: Pair = Field(alias="from", description="first point, in the order x, y, z")
    to: Pair = Field(description="last point")
    points: Forms[Text, Grid, Text] = Field(description=f"[4, 3] of a grid, or {POINTS}")


class _Line(_Touched):
    on: Name = Field(description="plane above that it is on")
    at: dict[Axis, Size] = Field(min_length=1, description="where it is across, such as {z: 30}")
    start: Size = Field(alias="from", description="first place along it")
    to: Size = Field(description="last place along it")


class _Round(_Touched):
    at: Pair = Field(description="place of the axis, in the order x, y, z")
    diameter: Positive = Field(description="diameter")
    depths: Forms[Size, NonEmpty[Size], Size] = Field(
        description="places along the axis of circles, each with so many points; one is a circle"
    )
    helix: float | None = Field(
        None, description="turns of a helix of points from the first to the last depth"
    )


class _Arc(_Touched):
    at: Pair = Field(description="centre, in the order x, y, z")
    radius: Positive = Field(description="radius")
    depth: Size = Field(description="place along the axis")
    start: Angle = Field(alias="from", description="first angle")
    to: Angle = Field(description="last angle")
    inner: bool = Field(False, description="whether the material surrounds it")


class _Sphere(_Touched):
    diameter: Positive = Field(description="diameter")
    inner: bool = Field(False, description="whether the material surrounds it")


class _Cone(_Touched):
    apex: Triple = Field(description="apex")
    angle: Angle = Field(description="angle between opposite lines")
    depths: NonEmpty[Positive] = Field(description="distances of circles from the apex")
    inner: bool = Field(True, description="whether the material surrounds it")


FEATURES: dict[str, tuple[Any, Any, str]] = {
    "plane": (_Plane, Sided, "plane by its normal away from the material"),
    "line": (_Line, Axis, "line on a plane by its direction"),
    "point": (_Point, Triple, "point"),
    "bore": (_Round, Axis, "bore by its axis"),
    "shaft": (_Round, Axis, "shaft by its axis"),
    "arc": (_Arc, Axis, "part of a circle by its axis"),
    "sphere": (_Sphere, Triple, "sphere by its centre"),
    "cone": (_Cone, Axis | Sided, "cone by the direction in which it opens"),
    "fit": (_Listed, Literal["plane"], "plane by its points"),
}


class _Dimension(Settings):
    tolerance: Forms[Size, tuple[Size, Size], Size] | None = Field(
        None, description="limit of deviations to both sides, or [lower, upper]"
    )
    name: Name | None = Field(None, description="default: made of kind and features")


class _Angle(_Dimension):
    tolerance: Forms[Angle, tuple[Angle, Angle], Angle] | None = Field(
        None, description="limit of deviations to both sides, or [lower, upper]"
    )


class _Zone(_Dimension):
    tolerance: Positive | None = Field(None, description="width of the zone")
    nominal: Size = Field(0.0, description="deviation that is expected; default 0")


class _Form(_Zone):
    evaluation: Literal["least squares", "minimum zone"] = Field(
        "least squares", description="fit of the feature"
    )


class _InDatums(_Zone):
    datums: Forms[Name, NonEmpty[Name], Name] = Field(description="features in their order")


Two = tuple[Name, Name]
DIMENSIONS: dict[str, tuple[Any, Any, str]] = {
    "diameter": (_Dimension, Name, "feature"),
    "radius": (_Dimension, Name, "feature"),
    "distance": (
        _Dimension,
        Two,
        "two features: of axes and centres across their axes, of planes the mean",
    ),
    "angle": (_Angle, Two, "two features: of planes that in the material"),
    **{
        kind: (_Form, Name, "feature")
        for kind in ("flatness", "straightness", "roundness", "cylindricity")
    },
    **{
        kind: (_InDatums, Name, "feature")
        for kind in ("parallelism", "perpendicularity", "position")
    },
}
FeatureSettings: Any = _one_of(FEATURES)
DimensionSettings: Any = _one_of(DIMENSIONS)


class PartSettings(Settings):
    """A part that is measured: features, dimensions and places."""

    part: Line = Field(description="one-line description of the part")
    unit: Literal["mm"] = Field("mm", description="unit of plain numbers")
    material: PartExpansion | None = Field(None, description="expansion; default: none of the part")
    probing: PointProbing = Field(description="how single points are probed")
    places: dict[Name, PartPlaceSettings] = Field(
        min_length=1, description="name: where the part is; every dimension is judged in each"
    )
    features: dict[Name, FeatureSettings] = Field(min_length=1, description="name: feature")
    dimensions: NonEmpty[DimensionSettings] = Field(description="dimensions, in the table's order")
    short_waves: Literal["none"] | ShortWaves | None = Field(
        None, description="errors that the machine's model cannot follow, or none"
    )
    random_part: Text | None = Field(
        None, description="machine file (YAML) whose random errors act on touched points as well"
    )
    share_of_tolerance: Ratio = Field(
        0.2, gt=0, description="part of the tolerance that the uncertainty may take; default 20 %"
    )


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a part file."""
    properties = tidied(PartSettings.model_json_schema())
    # A feature that is like another one has any of the keys.
    features = properties["properties"]["features"]
    like = {"type": "object", "required": ["like"], "properties": {"like": {"type": "string"}}}
    features["additionalProperties"] = {"anyOf": [like, features["additionalProperties"]]}
    return {"$schema": DRAFT, **properties, "title": "ballplate part"}
