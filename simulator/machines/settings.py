"""What a file may say about the machine, and how it becomes an error model.

An error model is registered by its settings class and builder in `ERROR_MODELS`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal, Self, Union

from pydantic import Field, model_validator

from ..quantities import Angle, PositiveLength
from ..settings import Settings
from .arrangement import ARRANGEMENTS, AXES, Arrangement
from .kinematic import kinematic_model
from .metric import MetricModel, Scale
from .protocol import ErrorModel

Corner = tuple[float, ...]
AxisName = Literal["x", "y", "z"]


class ArrangementSettings(Settings):
    """An arrangement of the axes that has no name of its own."""

    probe_side: tuple[AxisName, ...] = Field(
        default=(), description="Axes that carry the probe, listed from the ground to the probe."
    )
    workpiece_side: tuple[AxisName, ...] = Field(
        default=(), description="Axes that carry the workpiece, listed from the ground to the table."
    )

    @model_validator(mode="after")
    def _each_axis_once(self) -> Self:
        if sorted(self.probe_side + self.workpiece_side) != list(AXES):
            raise ValueError("name each of the axes x, y and z exactly once on the two sides together")
        return self


class KinematicSettings(Settings):
    """Errors of each axis as polynomials, superposed along the chain of axes."""

    kind: Literal["kinematic"]
    arrangement: Literal["MB1", "MB2", "FB1", "FB2", "FH1", "FH2", "MH1", "MH2", "CX1", "CY1"] | ArrangementSettings = (
        Field(
            default="MB2",
            description="Which axis carries which: a named arrangement, or the axes on either side. "
            "MB2 (x carries y carries z carries the probe) is NPL's kinematic model.",
        )
    )
    rotations: Literal["linearised", "full"] = Field(
        default="linearised", description="Whether products of small errors are left out or multiplied out."
    )
    position_coefficients: int = Field(
        default=5,
        ge=2,
        le=30,
        description="Coefficients of each positional error's polynomial, the constant included (NDEL); "
        "the constant is held at zero, so 5 leaves 4 free.",
    )
    rotation_coefficients: int = Field(
        default=5,
        ge=1,
        le=30,
        description="Coefficients of each rotational error's polynomial, the constant included (NEPS).",
    )


class MetricSettings(Settings):
    """A two-dimensional machine of straight axes: squareness and scale difference."""

    kind: Literal["metric"]
    scale: Scale = Field(
        default="none", description="Which axis takes the scale difference gamma: x, y, split between both, or none."
    )


def _kinematic(settings: KinematicSettings, lower: Corner, upper: Corner) -> ErrorModel:
    named = settings.arrangement
    arrangement = ARRANGEMENTS[named] if isinstance(named, str) else Arrangement(named.probe_side, named.workpiece_side)
    return kinematic_model(
        arrangement,
        settings.position_coefficients,
        settings.rotation_coefficients,
        lower,
        upper,
        settings.rotations == "full",
    )


def _metric(settings: MetricSettings, lower: Corner, upper: Corner) -> ErrorModel:
    return MetricModel(settings.scale, max(b - a for a, b in zip(lower, upper, strict=True)))


ERROR_MODELS: dict[type[Settings], tuple[int, Callable[[Any, Corner, Corner], ErrorModel]]] = {
    KinematicSettings: (3, _kinematic),
    MetricSettings: (2, _metric),
}
"""Settings class of every error model, with its number of dimensions and its builder."""

ErrorModelSettings = Annotated[Union[tuple(ERROR_MODELS)], Field(discriminator="kind")]  # type: ignore[valid-type]  # noqa: UP007


class ZeroSettings(Settings):
    """A machine without errors."""

    kind: Literal["zero"] = "zero"


class CoefficientSettings(Settings):
    """A machine with stated errors."""

    kind: Literal["coefficients"]
    values: dict[str, str] = Field(
        description="Value with unit of each parameter that is not zero, by its name in the error model or in the "
        'monomial form, for example "EXX t^2": 3 um.'
    )


class RandomSettings(Settings):
    """A machine whose errors are drawn at random with stated sizes."""

    kind: Literal["random"]
    position: PositiveLength | None = Field(
        default=None, description="Root mean square of each positional error along its axis."
    )
    rotation: Angle | None = Field(
        default=None, description="Root mean square of each rotational error along its axis."
    )
    seed: int = Field(default=1, ge=0, description="Seed of the draw.")


TrueMachineSettings = Annotated[ZeroSettings | CoefficientSettings | RandomSettings, Field(discriminator="kind")]


def dimension_of(settings: Settings) -> int:
    """Number of dimensions, 2 or 3, of the error model that the settings describe."""
    return ERROR_MODELS[type(settings)][0]


def build_error_model(settings: Settings, lower: Corner, upper: Corner) -> ErrorModel:
    """The error model that settings describe, for a volume from `lower` to `upper` in metres.

    >>> build_error_model(MetricSettings(kind="metric"), (0.0, 0.0), (1.0, 1.0)).dimension
    2
    """
    return ERROR_MODELS[type(settings)][1](settings, lower, upper)
