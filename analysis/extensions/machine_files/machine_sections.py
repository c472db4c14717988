"""The keys of a machine file: forms, units and ranges."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from ballplate.simulator.experiment import Edges, Line, VolumeSettings
from ballplate.simulator.geometry import Axis
from ballplate.simulator.inputs import (
    Angle,
    Bending,
    Expansion,
    Forms,
    Length,
    PositiveAngle,
    PositiveLength,
    PositiveTemperatureDifference,
    Settings,
    TemperatureDifference,
    Text,
)
from ballplate.simulator.machines import (
    ARRANGEMENT,
    AXIS_ERRORS,
    SQUARENESS_ERRORS,
    ArrangementName,
    ArrangementSettings,
    AxisError,
)
from pydantic import Field, create_model, model_validator

from .curves import Interpolation
from .straightness import Criterion

# Polynomials go to the tenth order.
MOST_COEFFICIENTS = 11

Point = tuple[Length, Length, Length]
Sigmas = Literal[1, 2, 3]
BANDWIDTH = "random part: a half-width of sigmas standard deviations, the same along the axis"
SIGMAS = "standard deviations in a bandwidth: 1, 2 or 3"
POLYNOMIAL = "coefficients of 1, t, t^2, … with t from 0 to 1 along the axis, to the tenth order"
FILE = (
    "CSV file with columns such as position_mm,EXX_um and optional comments # line, #"
    " straightness, # probe"
)
LINE = "line of measurement, as positions of the other axes; default: through the reference point"
PROBE = (
    "offset of the reflector or tip from the reference point of the probe while it was measured;"
    " default 0"
)
STRAIGHTEDGE = "table, if it was measured along a straightedge on a table that the axis moves"
STRAIGHTNESS = "reference line of straightness errors: end points, least squares or minimum zone"


class SmoothingSettings(Settings):
    """A least-squares spline or polynomial instead of the points of a table."""

    order: int = Field(
        4,
        ge=2,
        le=MOST_COEFFICIENTS,
        description=(
            "coefficients of each polynomial, the constant included; default: 4, cubic. Without"
            " knots there is one polynomial"
        ),
    )
    every: int | None = Field(
        None, ge=1, description="n: a knot at every n-th point, as in ballplate spline --every"
    )
    knots: tuple[Length, ...] | None = Field(None, description="positions of the knots")

    @model_validator(mode="after")
    def _one_kind_of_knots(self) -> Self:
        if self.every is not None and self.knots is not None:
            raise ValueError('"every" and "knots" both state the knots; give only one of them')
        return self


class _ErrorSettings(Settings):
    file: Text | None = Field(None, description=FILE)
    fit: SmoothingSettings | None = Field(
        None,
        description=(
            "least-squares fit to the points of the file, used instead of them: {order: 4} is a"
            " cubic polynomial, {every: 5} a cubic spline"
        ),
    )
    sigmas: Sigmas = Field(2, description=SIGMAS)
    line: dict[Axis, Length] | None = Field(None, description=LINE)
    probe: Point | None = Field(None, description=PROBE)

    @model_validator(mode="after")
    def _what_belongs_together(self) -> Self:
        polynomial, bandwidth = getattr(self, "polynomial", None), getattr(self, "bandwidth", None)
        if polynomial is not None and self.file is not None:
            raise ValueError(
                "a polynomial and a file cannot both be the error; give only one of them"
            )
        if self.fit is not None and self.file is None:
            raise ValueError("fit has no points; name a file with measured points, or remove fit")
        if polynomial is None and self.file is None and bandwidth is None:
            raise ValueError(
                "has no data; give a polynomial, a file, or the bandwidth of a random error"
            )
        for key in ("line", "probe", "straightness", "straightedge"):
            if key in self.model_fields_set and polynomial is None:
                where = (
                    f"write # {key}: … into the file"
                    if self.file
                    else "remove it, or give a polynomial"
                )
                raise ValueError(f'"{key}" has no meaning here; {where}')
        return self


class PositioningSettings(_ErrorSettings):
    """A positioning error of an axis."""

    polynomial: (
        Annotated[tuple[Length, ...], Field(min_length=1, max_length=MOST_COEFFICIENTS)] | None
    ) = Field(None, description=POLYNOMIAL)
    bandwidth: PositiveLength | None = Field(None, description=BANDWIDTH)


class StraightnessSettings(PositioningSettings):
    """A straightness error of an axis."""

    straightness: Criterion | None = Field(
        None, description=f"{STRAIGHTNESS}; default: that of the machine"
    )
    straightedge: Literal["table"] | None = Field(None, description=STRAIGHTEDGE)


class RotationSettings(_ErrorSettings):
    """A rotational error of an axis."""

    polynomial: (
        Annotated[tuple[Angle, ...], Field(min_length=1, max_length=MOST_COEFFICIENTS)] | None
    ) = Field(None, description=POLYNOMIAL)
    bandwidth: PositiveAngle | None = Field(None, description=BANDWIDTH)


def _form_of(error: AxisError) -> type[_ErrorSettings]:
    if error.is_rotation:
        return RotationSettings
    return StraightnessSettings if error.is_straightness else PositioningSettings


ErrorsSettings = create_model(
    "ErrorsSettings",
    __base__=Settings,
    __doc__="Errors of the axes by their ISO 230-1 names; those left out are zero.",
    **{  # type: ignore[call-overload]
        name: (_form_of(error) | None, Field(None, description=error.meaning))
        for name, error in AXIS_ERRORS.items()
    },
)


class SquarenessValue(Settings):
    """A squareness error with its random part, or measured elsewhere."""

    value: Angle = Field(
        description="right-handed rotation of the second axis to the first, from a right angle"
    )
    at: Point | None = Field(
        None,
        description="intersection of the two lines of measurement; default: the reference point",
    )
    bandwidth: PositiveAngle | None = Field(
        None, description="random part, the same wherever the machine is"
    )
    sigmas: Sigmas = Field(2, description=SIGMAS)


_Squareness = Forms[Angle, Angle, SquarenessValue]
SquarenessSettings = create_model(
    "SquarenessSettings",
    __base__=Settings,
    __doc__="Squareness errors by their ISO 230-1 names; those left out are zero.",
    **{  # type: ignore[call-overload]
        name: (_Squareness | None, Field(None, description=error.meaning))
        for name, error in SQUARENESS_ERRORS.items()
    },
)


class AxisTemperatureSettings(Settings):
    """Temperature of an axis's scale and what it does."""

    deviation: TemperatureDifference = Field(
        description="temperature less the reference temperature of 20 degC"
    )
    expansion: Expansion = Field(description="coefficient of thermal expansion")
    standard_uncertainty: PositiveTemperatureDifference | None = Field(
        None, description="standard uncertainty of the deviation; part of the random error"
    )


class DroopSettings(Settings):
    """Droop of a horizontal arm, for each metre that it is moved out; it counts besides the stated
    errors.
    """

    phi1: Bending | None = Field(
        None, description="tilt of the column: phi1 x z in X (MH1), phi1 y z in Y (MH2)"
    )
    phi2: Bending | None = Field(
        None, description="bend of the arm: -phi2 x^2/2 (MH1), +phi2 y^2/2 (MH2), in Z"
    )


class DescribedMachineSettings(Settings):
    """A machine and its parametric errors, for ballplate map and for kind: machine in
    experiments.
    """

    title: Line = Field(description="one-line description of the machine")
    description: Text | None = Field(None, description="further notes")
    arrangement: ArrangementName | ArrangementSettings = Field(description=ARRANGEMENT)
    volume: Forms[VolumeSettings, Annotated[Edges, Field(min_length=3)], VolumeSettings] = Field(
        description="ends per axis, {x: [0 mm, 1 m], …}, or edges from 0, [1 m, 1 m, 1 m]"
    )
    reference_point: Point | None = Field(
        None,
        description=(
            "point where all errors are zero and lines of reference cross; default: the lower"
            " corner"
        ),
    )
    probe: Point | None = Field(
        None, description="offset of the tip from the reference point of the probe; default 0"
    )
    interpolation: Interpolation = Field(
        "linear",
        description="between the points of tables: linear, cubic splines, or monotone cubics",
    )
    straightness: Criterion = Field("end points", description=STRAIGHTNESS)
    errors: ErrorsSettings | None = Field(None, description="errors of the axes by ISO 230-1 name")  # type: ignore[valid-type]
    squareness: SquarenessSettings | None = Field(  # type: ignore[valid-type]
        None, description="squareness errors by ISO 230-1 name"
    )
    temperature: dict[Axis, AxisTemperatureSettings] | None = Field(
        None,
        description="temperatures of the axes; those left out are at the reference temperature",
    )
    droop: DroopSettings | None = Field(None, description="droop of the arm, for MH1 and MH2")
    probing: PositiveLength | None = Field(
        None, description="standard deviation that probing adds to each co-ordinate; default 0"
    )


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a machine file."""
    from ballplate.simulator.experiment import DRAFT, tidied

    schema: dict[str, Any] = tidied(DescribedMachineSettings.model_json_schema())
    return {"$schema": DRAFT, **schema, "title": "ballplate machine"}
