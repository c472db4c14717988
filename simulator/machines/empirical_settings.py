"""Keys of the empirical error model."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ..inputs.settings import Forms, Settings
from .bases import Basis
from .basis_settings import BASIS, BasisSettings, SplineSettings, basis_of, without
from .empirical import FrameError, empirical_model
from .model_kinds import Corner, ErrorModelKind
from .protocol import ErrorModel
from .terms import (
    WITH_CONSTANT,
    Products,
    Radial,
    RadialName,
    Terms,
    no_terms,
    quadratic,
    sums,
    tensor,
    univariate,
)

Centres = Annotated[int, Field(ge=2, le=8)]
MOST_INTERIOR = 6
OF_BASIS: dict[str, Callable[[Basis], Products]] = {
    "sums": sums,
    "univariate": univariate,
    "tensor": tensor,
}
"""Terms that are made of univariate functions."""


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
        if self.function not in WITH_CONSTANT:
            without(self, ("constant",), f"the function {self.function}")
        try:
            empirical_model(self.terms(), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
        except (FrameError, np.linalg.LinAlgError):
            raise ValueError(
                "these functions are too similar to be distinguished; give fewer centres or a"
                " smaller constant"
            ) from None
        return self

    def terms(self) -> Radial:
        """Return the radial functions."""
        return Radial(self.centres, self.constant, self.function)


TermsSettings = Forms[
    Literal["sums", "univariate", "quadratic", "tensor"], RadialSettings, RadialSettings
]
TERMS = (
    "Functions of x, y and z: sums of tensor products with linear factors, plain sums of univariate"
    " functions, quadratic polynomials, full tensor products, or radial basis functions as"
    " {centres: [3, 3, 3], constant: 0.5}."
)
COEFFICIENTS = "Coefficients of each univariate polynomial, the constant included."


class RotationFunctionsSettings(Settings):
    """Functions of x, y and z for the rotations."""

    terms: TermsSettings = Field(default="sums", description=TERMS)
    basis: BasisSettings = Field(default="chebyshev", description=BASIS)
    coefficients: int = Field(default=3, ge=2, le=12, description=COEFFICIENTS)

    @model_validator(mode="after")
    def _what_belongs_together(self) -> Self:
        _check(self)
        return self


class EmpiricalSettings(Settings):
    """Six functions of three variables: displacement and rotation of the probe."""

    kind: Literal["empirical"] = Field(description="six functions of x, y and z")
    terms: TermsSettings = Field(default="sums", description=TERMS)
    basis: BasisSettings = Field(default="chebyshev", description=BASIS)
    coefficients: int = Field(default=3, ge=2, le=12, description=COEFFICIENTS)
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


def _check(settings: EmpiricalSettings | RotationFunctionsSettings) -> None:
    """Refuse keys that contradict each other.

    :raises ValueError: some do.
    """
    terms, basis = settings.terms, settings.basis
    if isinstance(terms, RadialSettings):
        without(settings, ("basis", "coefficients"), "radial basis functions")
    elif terms == "quadratic":
        without(settings, ("basis", "coefficients"), "quadratic terms")
    elif isinstance(basis, SplineSettings):
        without(settings, ("coefficients",), "splines, which have an order and knots")
    if terms == "tensor" and isinstance(basis, SplineSettings) and basis.slopes is not None:
        raise ValueError(
            "full tensor products have the factors x, y and z, whose slope is not 0; remove slopes"
        )
    if terms == "tensor" and basis_of(basis, settings.coefficients).interior().size > MOST_INTERIOR:
        raise ValueError(
            f"full tensor products have at most {MOST_INTERIOR + 2} functions along an axis; give"
            " fewer, or sums"
        )


def _terms(settings: EmpiricalSettings | RotationFunctionsSettings) -> Terms:
    if isinstance(settings.terms, RadialSettings):
        return settings.terms.terms()
    if settings.terms == "quadratic":
        return quadratic()
    return OF_BASIS[settings.terms](basis_of(settings.basis, settings.coefficients))


def _empirical(settings: EmpiricalSettings, lower: Corner, upper: Corner) -> ErrorModel:
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
