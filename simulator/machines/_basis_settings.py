"""Keys of univariate functions: polynomials or splines along the axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Self

from ballplate.simulator.inputs.settings import Forms, Settings
from pydantic import Field, model_validator

from .bases import Basis, Ends, Monomial, Polynomial

if TYPE_CHECKING:
    from .spline_basis import Spline

VARIABLES = ("x", "y", "z")

RadialName = Literal[
    "multiquadric", "inverse multiquadric", "gaussian", "thin plate", "linear", "cubic"
]
WITH_CONSTANT = ("multiquadric", "inverse multiquadric", "gaussian")


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
                "neither start nor end is given; give 0 for one or both, or remove the key"
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
            "Slopes of zero, as {start: 0, end: 0} or either. In an empirical model they hold"
            " for all functions except 1, x, y and z."
        ),
    )
    periodic: bool = Field(
        default=False,
        description=(
            "Slope and further derivatives are equal at both ends; values are, except for a"
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
        shared = sorted(set(self.features) & set(self.knots))
        if shared:
            raise ValueError(
                f"{shared[0]:g} is among the knots and the features; leave it out of the knots"
            )
        if self.periodic and self.slopes is not None:
            raise ValueError("periodic ends have slopes of their own; remove slopes or periodic")
        self.spline()
        return self

    def spline(self) -> Spline:
        """Return the spline.

        >>> SplineSettings(features=(0.5,)).spline().knots
        (0.5, 0.5)
        """
        from ballplate.simulator.splines.space import with_boundaries

        from .spline_basis import Spline

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


Polynomials = Literal["chebyshev", "monomial"]
BasisSettings = Forms[Polynomials, SplineSettings, SplineSettings]
BASIS = (
    "Univariate functions: chebyshev or monomial polynomials, or B-splines as {order: 4, knots:"
    " [0.5]}, also with features: [0.3], slopes: {start: 0, end: 0} or periodic: true."
)


def basis_of(settings: Any, coefficients: int) -> Basis:
    """Return the described functions; polynomials have the given number of coefficients."""
    if isinstance(settings, SplineSettings):
        return settings.spline()
    return Monomial(coefficients) if settings == "monomial" else Polynomial(coefficients)


def without(settings: Settings, keys: tuple[str, ...], instead: str) -> None:
    """Refuse stated keys that have no meaning with `instead`.

    :raises ValueError: a key is stated.
    """
    stated_keys = [key for key in keys if key in settings.model_fields_set]
    if stated_keys:
        raise ValueError(f'"{stated_keys[0]}" has no meaning with {instead}; remove it')
