"""Keys of the empirical error model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from ballplate.simulator.inputs.settings import Forms, Settings
from pydantic import ConfigDict, Discriminator, Field, Tag, model_validator

from ._basis_settings import (
    BASIS,
    VARIABLES,
    WITH_CONSTANT,
    BasisSettings,
    RadialName,
    SplineSettings,
    basis_of,
    without,
)
from .bases import Basis
from .protocol import Corner, ErrorModel, ErrorModelKind

if TYPE_CHECKING:
    from ._terms import Radial, Terms

Centres = Annotated[int, Field(ge=2, le=8)]
MOST_INTERIOR = 6
# Terms that are made of univariate functions.
OF_BASIS = ("sums", "univariate", "tensor")


class RadialSettings(Settings):
    """Radial basis functions on a grid of centres."""

    centres: tuple[Centres, Centres, Centres] = Field(
        description="Number of centres along x, y and z."
    )
    constant: float = Field(
        default=0.5,
        ge=1e-3,
        le=10,
        description="Constant c of sqrt(r^2 + c^2), in fractions of the volume.",
    )
    function: RadialName = Field(
        default="multiquadric",
        description=(
            "Function of the distance r: multiquadric sqrt(r^2 + c^2), inverse multiquadric"
            " 1/sqrt(r^2 + c^2), gaussian exp(-r^2/c^2), or without a constant thin plate r^2 log"
            " r, linear r, cubic r^3."
        ),
    )

    @model_validator(mode="after")
    def _possible(self) -> Self:
        from ._empirical import empirical_model

        if self.function not in WITH_CONSTANT:
            without(self, ("constant",), f"the function {self.function}")
        try:
            empirical_model(self.terms(), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
        except ValueError:  # That of singular matrices, too.
            raise ValueError(
                "these functions are too similar to be distinguished; give fewer centres or a"
                " smaller constant"
            ) from None
        return self

    def terms(self) -> Radial:
        """Return the radial functions."""
        from ._terms import Radial

        return Radial(self.centres, self.constant, self.function)


TermsSettings = Forms[
    Literal["sums", "univariate", "quadratic", "tensor"], RadialSettings, RadialSettings
]
TERMS = (
    "Functions of x, y and z: sums of tensor products with linear factors, plain sums of univariate"
    " functions, quadratic polynomials, full tensor products, or radial basis functions as"
    " {centres: [3, 3, 3], constant: 0.5}."
)
_Count = Annotated[int, Field(ge=2, le=12)]


class BasisByAxis(Settings):
    """Univariate functions of x, y and z."""

    # An empty mapping states splines without knots along all axes.
    model_config = ConfigDict(json_schema_extra={"minProperties": 1})

    x: BasisSettings = Field(default="chebyshev", description="functions of x")
    y: BasisSettings = Field(default="chebyshev", description="functions of y")
    z: BasisSettings = Field(default="chebyshev", description="functions of z")

    @model_validator(mode="before")
    @classmethod
    def _no_key_of_all_axes(cls, stated: Any) -> Any:
        for key in stated:
            if key in SplineSettings.model_fields:
                raise ValueError(f'"{key}" is a key of splines; move it into x, y or z')
        return stated


class CoefficientsByAxis(Settings):
    """Coefficients of univariate polynomials of x, y and z, the constant included."""

    x: _Count = Field(default=3, description="coefficients of polynomials of x")
    y: _Count = Field(default=3, description="coefficients of polynomials of y")
    z: _Count = Field(default=3, description="coefficients of polynomials of z")


def _basis_form(value: Any) -> str:
    stated = value.keys() if isinstance(value, dict) else ()
    is_by_axis = isinstance(value, BasisByAxis) or not set(VARIABLES).isdisjoint(stated)
    return "<axes>" if is_by_axis else "<one>"


AnyBasis = Annotated[
    Annotated[BasisSettings, Tag("<one>")] | Annotated[BasisByAxis, Tag("<axes>")],
    Discriminator(_basis_form),
]
AnyCoefficients = Forms[_Count, CoefficientsByAxis, CoefficientsByAxis]
COEFFICIENTS = (
    "Coefficients of each univariate polynomial, the constant included; by axis as {x: 5, y: 3, z:"
    " 2}."
)
BASIS_BY_AXIS = f"{BASIS[:-1]}; by axis as {{x: {{order: 4}}, y: monomial}}."


class RotationFunctionsSettings(Settings):
    """Functions of x, y and z for the rotations."""

    terms: TermsSettings = Field(default="sums", description=TERMS)
    basis: AnyBasis = Field(default="chebyshev", description=BASIS_BY_AXIS)
    coefficients: AnyCoefficients = Field(default=3, description=COEFFICIENTS)

    @model_validator(mode="after")
    def _what_belongs_together(self) -> Self:
        _check(self)
        return self


class EmpiricalSettings(Settings):
    """Six functions of three variables: displacement and rotation of the probe."""

    kind: Literal["empirical"] = Field(description="six functions of x, y and z")
    terms: TermsSettings = Field(default="sums", description=TERMS)
    basis: AnyBasis = Field(default="chebyshev", description=BASIS_BY_AXIS)
    coefficients: AnyCoefficients = Field(default=3, description=COEFFICIENTS)
    rotations: Literal["linearised", "full"] = Field(
        default="linearised",
        description=(
            "Rotation of the probe offset: by cross products (linearised) or rotation matrices"
            " (full)."
        ),
    )
    rotation_functions: (
        Forms[Literal["none"], RotationFunctionsSettings, RotationFunctionsSettings] | None
    ) = Field(
        default=None,
        description=(
            "Functions of the rotations, as {terms: univariate, coefficients: 2}, or none: a probe"
            " that does not turn; default: those of the displacements."
        ),
    )

    @model_validator(mode="after")
    def _what_belongs_together(self) -> Self:
        _check(self)
        return self


def _by_axis(stated: Any) -> list[Any]:
    """Return the values for x, y and z of a key that states one for all or each."""
    if isinstance(stated, BasisByAxis | CoefficientsByAxis):
        return [getattr(stated, axis) for axis in VARIABLES]
    return [stated] * 3


def has_polynomials(settings: EmpiricalSettings | RotationFunctionsSettings) -> bool:
    """True if the functions along some axis are polynomials of stated numbers of coefficients."""
    return settings.terms in OF_BASIS and not all(
        isinstance(basis, SplineSettings) for basis in _by_axis(settings.basis)
    )


def _check(settings: EmpiricalSettings | RotationFunctionsSettings) -> None:
    """Refuse keys that contradict each other.

    :raises ValueError: some do.
    """
    terms, coefficients = settings.terms, settings.coefficients
    bases = _by_axis(settings.basis)
    if isinstance(terms, RadialSettings):
        without(settings, ("basis", "coefficients"), "radial basis functions")
    elif terms == "quadratic":
        without(settings, ("basis", "coefficients"), "quadratic terms")
    elif not has_polynomials(settings):
        without(settings, ("coefficients",), "splines, which have an order and knots")
    elif isinstance(coefficients, CoefficientsByAxis):
        for axis, basis in zip(VARIABLES, bases, strict=True):
            if isinstance(basis, SplineSettings):
                without(coefficients, (axis,), f"splines along {axis}")
    if terms != "tensor":
        return
    if any(isinstance(basis, SplineSettings) and basis.slopes is not None for basis in bases):
        raise ValueError(
            "full tensor products have the factors x, y and z, whose slope is not 0; remove slopes"
        )
    if any(basis.interior().size > MOST_INTERIOR for basis in _bases(settings)):
        raise ValueError(
            f"full tensor products have at most {MOST_INTERIOR + 2} functions along an axis; give"
            " fewer, or sums"
        )


def _bases(settings: EmpiricalSettings | RotationFunctionsSettings) -> tuple[Basis, ...]:
    """Return the univariate functions of x, y and z."""
    return tuple(map(basis_of, _by_axis(settings.basis), _by_axis(settings.coefficients)))


def _terms(settings: EmpiricalSettings | RotationFunctionsSettings) -> Terms:
    from ._terms import quadratic, sums, tensor, univariate

    if isinstance(settings.terms, RadialSettings):
        return settings.terms.terms()
    if settings.terms == "quadratic":
        return quadratic()
    of_basis = {"sums": sums, "univariate": univariate, "tensor": tensor}
    return of_basis[settings.terms](*_bases(settings))


def _empirical(settings: EmpiricalSettings, lower: Corner, upper: Corner) -> ErrorModel:
    from ._empirical import empirical_model
    from ._terms import no_terms

    functions = settings.rotation_functions
    of_rotations = (
        None
        if functions is None
        else no_terms()
        if isinstance(functions, str)
        else _terms(functions)
    )
    return empirical_model(
        _terms(settings),
        lower,
        upper,
        settings.rotations == "full",
        of_rotations=of_rotations,
    )


EMPIRICAL = ErrorModelKind(EmpiricalSettings, _empirical, dimensions=(3,))
