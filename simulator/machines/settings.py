"""The keys of error models in a file, and their conversion into error models.

An error model is registered by its settings class and builder in `ERROR_MODELS`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, Self, Union

from pydantic import Field, PrivateAttr, StringConstraints, model_validator

from ..inputs.settings import Forms, Settings
from ..splines.knots import with_boundaries
from .arrangement import ARRANGEMENTS, AXES, Arrangement
from .bases import Basis, Ends, Monomial, Polynomial, Spline
from .custom import custom_model
from .description import MachineDescription, fitted_volumetric
from .empirical import FrameError, empirical_model
from .kinematic import kinematic_model_of
from .metric import MetricModel, Scale
from .protocol import ErrorModel
from .spatial_metric import SpatialMetricModel
from .terms import Radial, quadratic, sums, tensor

Corner = tuple[float, ...]
Centres = Annotated[int, Field(ge=2, le=8)]
MOST_INTERIOR = 6
AxisName = Literal["x", "y", "z"]


class ArrangementSettings(Settings):
    """An arrangement of the axes that has no name of its own."""

    probe_side: tuple[AxisName, ...] = Field(
        default=(), description="Axes that carry the probe, listed from the ground to the probe."
    )
    workpiece_side: tuple[AxisName, ...] = Field(
        default=(),
        description="Axes that carry the workpiece, listed from the ground to the table.",
    )

    @model_validator(mode="after")
    def _each_axis_once(self) -> Self:
        if sorted(self.probe_side + self.workpiece_side) != list(AXES):
            raise ValueError(
                "an axis is missing or named twice; name each of x, y and z exactly once on the"
                " two sides together"
            )
        return self


ArrangementName = Literal["MB1", "MB2", "FB1", "FB2", "FH1", "FH2", "MH1", "MH2", "CX1", "CY1"]
ARRANGEMENT = (
    "Which axis carries which: a named arrangement, or the axes on either side. "
    "MB2 (x carries y carries z carries the probe) is NPL's kinematic model."
)
ROTATIONS = "Whether products of small errors are left out or multiplied out."


def arrangement_of(settings: str | ArrangementSettings) -> Arrangement:
    """The arrangement that settings name or list."""
    if isinstance(settings, str):
        return ARRANGEMENTS[settings]
    return Arrangement(settings.probe_side, settings.workpiece_side)


class SlopesSettings(Settings):
    """Slopes of zero at the ends of a spline."""

    start: float | None = Field(
        default=None, description="0: no slope at the lower end of the axis."
    )
    end: float | None = Field(default=None, description="0: no slope at the upper end of the axis.")

    @model_validator(mode="after")
    def _zero(self) -> Self:
        for name in ("start", "end"):
            if getattr(self, name) not in (None, 0.0):
                raise ValueError(
                    f"functions of a basis are multiplied by any number, which keeps no {name}"
                    " slope but 0; give 0"
                )
        if self.start is None and self.end is None:
            raise ValueError(
                "neither start nor end is given; give 0 for one of them or both, or remove the key"
            )
        return self


class SplineSettings(Settings):
    """B-splines of an order with interior knots, along every axis of the volume."""

    order: int = Field(
        default=4,
        ge=2,
        le=12,
        description="Order of the splines, degree plus one: 4 for cubic ones.",
    )
    knots: tuple[float, ...] = Field(
        default=(),
        max_length=100,
        description="Interior knots in ascending order, in fractions of the axis between 0 and 1.",
    )
    features: tuple[float, ...] = Field(
        default=(),
        max_length=30,
        description=(
            "Boundaries of neighbouring features in ascending order, in fractions of the axis:"
            " there only value and slope are continuous."
        ),
    )
    slopes: SlopesSettings | None = Field(
        default=None,
        description=(
            "Slopes of zero, as {start: 0, end: 0} or one of them. In an empirical model they hold"
            " for the functions besides 1, x, y and z."
        ),
    )
    periodic: bool = Field(
        default=False,
        description=(
            "Slope and further derivatives are the same at both ends; values are, but for a"
            " straight line."
        ),
    )

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.features and self.order < 3:
            raise ValueError(
                "broken lines share no slope between features; give an order of 3 or more"
            )
        if list(self.features) != sorted(set(self.features)):
            raise ValueError(
                "boundaries of features are out of order; give each once, in ascending order"
            )
        both = sorted(set(self.features) & set(self.knots))
        if both:
            raise ValueError(
                f"{both[0]:g} is among the knots and the features; leave it out of the knots"
            )
        if self.periodic and self.slopes is not None:
            raise ValueError("periodic ends have slopes of their own; remove slopes or periodic")
        self.spline()
        return self

    def spline(self) -> Spline:
        """The functions described.

        >>> SplineSettings(features=(0.5,)).spline().knots
        (0.5, 0.5)
        """
        start, end = (
            (False, False)
            if self.slopes is None
            else (self.slopes.start == 0, self.slopes.end == 0)
        )
        ends: Ends = (
            "zero slopes"
            if start and end
            else "zero slope at start"
            if start
            else "zero slope at end"
        )
        if not (start or end):
            ends = "periodic" if self.periodic else "free"
        return Spline(self.order, with_boundaries(self.knots, self.features, self.order), ends=ends)


BasisSettings = Forms[Literal["chebyshev", "monomial"], SplineSettings, SplineSettings]
BASIS = (
    "Univariate functions: chebyshev or monomial polynomials, or B-splines as {order: 4, knots:"
    " [0.5]}, also with features: [0.3], slopes: {start: 0, end: 0} or periodic: true."
)


def _basis(settings: Any, coefficients: int) -> Basis:
    if isinstance(settings, SplineSettings):
        return settings.spline()
    return Monomial(coefficients) if settings == "monomial" else Polynomial(coefficients)


def _without(settings: Settings, keys: tuple[str, ...], instead: str) -> None:
    stated = [key for key in keys if key in settings.model_fields_set]
    if stated:
        raise ValueError(f'"{stated[0]}" has no meaning with {instead}; remove it')


class KinematicSettings(Settings):
    """Errors of each axis as polynomials or splines, superposed along the chain of axes."""

    kind: Literal["kinematic"] = Field(
        description="errors of each axis, superposed along the chain of axes"
    )
    arrangement: ArrangementName | ArrangementSettings = Field(
        default="MB2", description=ARRANGEMENT
    )
    rotations: Literal["linearised", "full"] = Field(default="linearised", description=ROTATIONS)
    position_coefficients: int = Field(
        default=5,
        ge=2,
        le=30,
        description=(
            "Coefficients of each positional error's polynomial, the constant included (NDEL); "
            "the constant is held at zero, so 5 leaves 4 free."
        ),
    )
    rotation_coefficients: int = Field(
        default=5,
        ge=1,
        le=30,
        description=(
            "Coefficients of each rotational error's polynomial, the constant included (NEPS)."
        ),
    )
    basis: BasisSettings = Field(default="chebyshev", description=BASIS)

    @model_validator(mode="after")
    def _coefficients_of_polynomials(self) -> Self:
        if isinstance(self.basis, SplineSettings):
            _without(
                self,
                ("position_coefficients", "rotation_coefficients"),
                "splines, which have an order and knots",
            )
        return self


class RadialSettings(Settings):
    """Multiquadric radial basis functions on a grid of centres."""

    centres: tuple[Centres, Centres, Centres] = Field(
        description="Number of centres along x, y and z."
    )
    constant: float = Field(
        default=0.5,
        ge=1e-3,
        le=10,
        description="Constant c of sqrt(r^2 + c^2), in fractions of the volume.",
    )

    @model_validator(mode="after")
    def _possible(self) -> Self:
        try:
            empirical_model(Radial(self.centres, self.constant), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
        except FrameError:
            raise ValueError(
                "these functions are too similar to be distinguished; give fewer centres or a"
                " smaller constant"
            ) from None
        return self


class EmpiricalSettings(Settings):
    """Six functions of three variables: displacement and rotation of the probe."""

    kind: Literal["empirical"] = Field(description="six functions of x, y and z")
    terms: Forms[Literal["sums", "quadratic", "tensor"], RadialSettings, RadialSettings] = Field(
        default="sums",
        description=(
            "Functions of x, y and z: sums of tensor products with linear factors, quadratic"
            " polynomials, full tensor products, or radial basis functions as {centres: [3, 3, 3],"
            " constant: 0.5}."
        ),
    )
    basis: BasisSettings = Field(default="chebyshev", description=BASIS)
    coefficients: int = Field(
        default=3,
        ge=2,
        le=12,
        description="Coefficients of each univariate polynomial, the constant included.",
    )
    rotations: Literal["linearised", "full"] = Field(
        default="linearised",
        description="Whether the probe offset is turned by cross products or rotation matrices.",
    )

    @model_validator(mode="after")
    def _what_belongs_together(self) -> Self:
        if isinstance(self.terms, RadialSettings):
            _without(self, ("basis", "coefficients"), "radial basis functions")
        elif self.terms == "quadratic":
            _without(self, ("basis", "coefficients"), "quadratic terms")
        elif isinstance(self.basis, SplineSettings):
            _without(self, ("coefficients",), "splines, which have an order and knots")
        if (
            self.terms == "tensor"
            and isinstance(self.basis, SplineSettings)
            and self.basis.slopes is not None
        ):
            raise ValueError(
                "full tensor products have the factors x, y and z, whose slope is not 0; remove"
                " slopes"
            )
        if (
            self.terms == "tensor"
            and _basis(self.basis, self.coefficients).interior().size > MOST_INTERIOR
        ):
            raise ValueError(
                f"full tensor products have at most {MOST_INTERIOR + 2} functions along an axis;"
                " give fewer, or sums"
            )
        return self


class MetricSettings(Settings):
    """A machine of straight axes: squareness and scales."""

    kind: Literal["metric"] = Field(
        description="straight axes that need not be square, and their scales"
    )
    scale: Literal["none", "x", "y", "split", "each"] | None = Field(
        default=None,
        description=(
            "In two dimensions which axis takes the scale difference gamma: x, y, split between"
            " both, or none (default). In three dimensions each (default), for a scale error of"
            " every axis, or none."
        ),
    )

    @property
    def plane_scale(self) -> Scale:
        """Which axis takes the scale difference in two dimensions."""
        return "none" if self.scale is None or self.scale == "each" else self.scale


class PythonSettings(Settings):
    """A user's own error model, made by a Python function that is called with the volume's corners
    and the options.
    """

    kind: Literal["python"] = Field(description="a model of the user's own")
    object: Annotated[str, StringConstraints(min_length=1)] = Field(
        description=(
            "module:function, the module installed or beside this file, or the name of an installed"
            " entry point of the group ballplate.error_models."
        )
    )
    options: dict[str, Any] = Field(
        default={}, description="Keyword arguments of the function; quantities arrive in SI units."
    )

    folder: str | None = Field(
        default=None,
        description=(
            "Folder of the module, as it is found from this file; default: that of this file."
        ),
    )

    # Where modules are looked for besides where Python finds them.
    _folder: Path | None = PrivateAttr(default=None)

    def beside(self, folder: Path) -> None:
        """Look for modules in the folder of the experiment file too, or in that named from
        there.
        """
        self._folder = folder if self.folder is None else folder / self.folder


class MachineFileSettings(Settings):
    """What a machine file states, as an error model to be estimated: its arrangement and errors,
    not their values.
    """

    kind: Literal["machine"] = Field(description="the errors that a machine file states")
    file: str = Field(description="Machine file (YAML), as for ballplate map.")
    knots: int = Field(
        default=3,
        ge=0,
        le=50,
        description=(
            "Interior knots of the cubic splines that represent errors given as tables, evenly"
            " spaced."
        ),
    )

    # What the file says; filled in when the experiment is loaded.
    _machine: MachineDescription | None = PrivateAttr(default=None)

    def of(self, machine: MachineDescription) -> None:
        """Take the machine that the file describes."""
        self._machine = machine


def _kinematic(settings: KinematicSettings, lower: Corner, upper: Corner) -> ErrorModel:
    return kinematic_model_of(
        arrangement_of(settings.arrangement),
        _basis(settings.basis, settings.position_coefficients),
        _basis(settings.basis, settings.rotation_coefficients),
        lower,
        upper,
        settings.rotations == "full",
    )


def _empirical(settings: EmpiricalSettings, lower: Corner, upper: Corner) -> ErrorModel:
    if isinstance(settings.terms, RadialSettings):
        return empirical_model(
            Radial(settings.terms.centres, settings.terms.constant),
            lower,
            upper,
            settings.rotations == "full",
        )
    basis = _basis(settings.basis, settings.coefficients)
    terms = {"sums": lambda: sums(basis), "quadratic": quadratic, "tensor": lambda: tensor(basis)}[
        settings.terms
    ]()
    return empirical_model(terms, lower, upper, settings.rotations == "full")


def _metric(settings: MetricSettings, lower: Corner, upper: Corner) -> ErrorModel:
    if len(lower) == 3:
        return SpatialMetricModel(settings.scale != "none", lower, upper)
    return MetricModel(settings.plane_scale, max(b - a for a, b in zip(lower, upper, strict=True)))


def _python(settings: PythonSettings, lower: Corner, upper: Corner) -> ErrorModel:
    return custom_model(settings.object, settings.options, settings._folder, lower, upper)


def _machine_file(settings: MachineFileSettings, lower: Corner, upper: Corner) -> ErrorModel:
    assert settings._machine is not None
    return fitted_volumetric(settings._machine, lower, upper, settings.knots)


ERROR_MODELS: dict[
    type[Settings], tuple[int | None, Callable[[Any, Corner, Corner], ErrorModel]]
] = {
    KinematicSettings: (3, _kinematic),
    EmpiricalSettings: (3, _empirical),
    MetricSettings: (None, _metric),
    PythonSettings: (None, _python),
    MachineFileSettings: (3, _machine_file),
}
"""Settings class of every error model, with its number of dimensions, None for any, and its
builder.
"""

ErrorModelSettings = Annotated[Union[tuple(ERROR_MODELS)], Field(discriminator="kind")]  # type: ignore[valid-type]  # noqa: UP007


def dimension_of(settings: Settings) -> int | None:
    """Number of dimensions, 2 or 3, of the error model that the settings describe; None if that
    depends.
    """
    return ERROR_MODELS[type(settings)][0]


def with_defaults(settings: Settings, dimension: int) -> Settings:
    """Settings of an error model or a true machine, with defaults stated that depend on the number
    of dimensions.

    >>> with_defaults(MetricSettings(kind="metric"), 3).scale
    'each'
    """
    if isinstance(settings, MetricSettings) and settings.scale is None:
        return settings.model_copy(update={"scale": "none" if dimension == 2 else "each"})
    own = getattr(settings, "error_model", None)
    return (
        settings
        if own is None
        else settings.model_copy(update={"error_model": with_defaults(own, dimension)})
    )


def build_error_model(settings: Settings, lower: Corner, upper: Corner) -> ErrorModel:
    """The error model that settings describe, for a volume from `lower` to `upper` in metres.

    :raises CustomModelError: a user's own model that cannot be used.

    >>> build_error_model(MetricSettings(kind="metric"), (0.0, 0.0), (1.0, 1.0)).dimension
    2
    """
    return ERROR_MODELS[type(settings)][1](settings, lower, upper)
