"""Keys of the kinematic error model."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.settings import Forms, Settings
from pydantic import Field, create_model, model_validator

from ._basis_settings import BASIS, BasisSettings, SplineSettings, basis_of, without
from .arrangement import (
    ARRANGEMENT,
    AXIS_ERRORS,
    PRODUCTS,
    ArrangementName,
    ArrangementSettings,
    arrangement_of,
)
from .bases import Basis
from .kinematic import PlaneModel, in_plane, in_space, kinematic_model_of
from .protocol import Corner, ErrorModel, ErrorModelKind

_Function = Forms[Annotated[int, Field(ge=1, le=30)], SplineSettings, SplineSettings]
FunctionsSettings = create_model(
    "FunctionsSettings",
    __base__=Settings,
    __doc__="Single error functions by their ISO 230-1 names.",
    **{  # type: ignore[call-overload]
        name: (_Function | None, Field(None, description=error.meaning))
        for name, error in AXIS_ERRORS.items()
    },
)


class KinematicSettings(Settings):
    """Errors of each axis as polynomials or splines, superposed along the chain of axes."""

    kind: Literal["kinematic"] = Field(
        description="errors of each axis, superposed along the chain of axes"
    )
    arrangement: ArrangementName | ArrangementSettings = Field(
        default="MB2", description=ARRANGEMENT
    )
    rotations: Literal["linearised", "full"] = Field(default="linearised", description=PRODUCTS)
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
    functions: FunctionsSettings | None = Field(  # type: ignore[valid-type]
        default=None,
        description=(
            "Single functions by their ISO 230-1 names, by default as all others: numbers"
            " of coefficients, the constant included, or B-splines as {order: 4, knots: [0.5]}."
            " With 1 coefficient there is no such error."
        ),
    )
    squareness: Literal["straightness", "parameters"] = Field(
        default="straightness",
        description=(
            "Form of squareness: in the straightness errors EXY, EXZ and EYZ, which then do not"
            " vanish at the upper end of their axis, or in parameters EC0Y, EB0Z and EA0Z of its"
            " own (the 21-parameter form)."
        ),
    )

    @model_validator(mode="after")
    def _coefficients_of_polynomials(self) -> Self:
        if isinstance(self.basis, SplineSettings):
            without(
                self,
                ("position_coefficients", "rotation_coefficients"),
                "splines, which have an order and knots",
            )
        return self


def _single_functions(settings: KinematicSettings) -> tuple[tuple[str, Basis], ...]:
    """Return the functions with families of their own."""
    forms: dict[str, Any] = {} if settings.functions is None else settings.functions.stated
    polynomials = "monomial" if settings.basis == "monomial" else "chebyshev"
    return tuple(
        (
            name,
            form.spline() if isinstance(form, SplineSettings) else basis_of(polynomials, form),
        )
        for name, form in forms.items()
    )


def _kinematic(settings: KinematicSettings, lower: Corner, upper: Corner) -> ErrorModel:
    model = kinematic_model_of(
        arrangement_of(settings.arrangement),
        basis_of(settings.basis, settings.position_coefficients),
        basis_of(settings.basis, settings.rotation_coefficients),
        *in_space(lower, upper),
        settings.rotations == "full",
        _single_functions(settings),
        settings.squareness == "parameters",
    )
    return model if len(lower) == 3 else PlaneModel(in_plane(model), 0.0)


def _wrong(settings: KinematicSettings, dimension: int) -> list[tuple[Steps, str]]:
    names = [name for name, _ in _single_functions(settings)]
    absent = [name for name in names if dimension == 2 and not AXIS_ERRORS[name].in_plane]
    if absent:
        text = "moves no point within the plane of x and y; remove it"
        return [(("functions", name), text) for name in absent]
    if not _kinematic(settings, (0.0,) * dimension, (1.0,) * dimension).parameters:
        return [
            (
                ("functions",),
                "leaves no error to be estimated; give one function more than 1 coefficient",
            )
        ]
    return []


KINEMATIC = ErrorModelKind(KinematicSettings, _kinematic, wrong=_wrong)
