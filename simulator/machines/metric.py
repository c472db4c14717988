"""The two-dimensional metric: scale difference and squareness of two straight axes.

Source: NBSIR 79-1752, equations (1) to (5): a reading is A times the true co-ordinates, with alpha
the departure from squareness and gamma the scale difference of x and y.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.simulator.computing.numerics import eigvalsh
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.number_arrays import Array

from .protocol import Parameter, Reported

Scale = Literal["none", "x", "y", "split"]

# Share of gamma in each scale: equations (3), (4) and (5).
_SHARES: dict[Scale, tuple[float, float]] = {
    "none": (0.0, 0.0),
    "x": (1.0, 0.0),
    "y": (0.0, -1.0),
    "split": (0.5, -0.5),
}


@dataclass(frozen=True)
class MetricModel:
    """A = [[1 + s gamma, -alpha], [0, 1 + t gamma]], with (s, t) = (1, 0), (0, -1) or (1/2, -1/2).

    The correction is e(x) = A^-1 x - x + p. With scale "none", alpha is the only parameter.
    """

    scale: Scale
    span: float = 1.0

    @property
    def dimension(self) -> int:
        return 2

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        alpha = Parameter(
            "alpha", "rad", "alpha", "departure of the axes from squareness", self.span
        )
        gamma = Parameter("gamma", "1", "gamma", "difference of the scales of x and y", self.span)
        return (alpha,) if self.scale == "none" else (alpha, gamma)

    def _solve(self, x: Array, a: Array) -> tuple[Array, Array, float, float]:
        share_x, share_y = _SHARES[self.scale]
        gamma = a[1] if self.scale != "none" else 0.0
        scale_x, scale_y = 1.0 + share_x * gamma, 1.0 + share_y * gamma
        y = x[:, 1] / scale_y
        return (x[:, 0] + a[0] * y) / scale_x, np.asarray(y), scale_x, scale_y

    def error(self, x: Array, a: Array, p: Array) -> Array:
        true_x, true_y, _, _ = self._solve(x, a)
        return np.stack([true_x, true_y], axis=1) - x + p

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        true_x, true_y, scale_x, scale_y = self._solve(x, a)
        share_x, share_y = _SHARES[self.scale]
        result = np.zeros((len(x), 2, len(self.parameters)), np.result_type(x, a, float))
        result[:, 0, 0] = true_y / scale_x
        if self.scale != "none":
            by_gamma_y = -share_y * true_y / scale_y
            result[:, 0, 1] = (a[0] * by_gamma_y - share_x * true_x) / scale_x
            result[:, 1, 1] = by_gamma_y
        return result

    def reported(self) -> Reported:
        return Reported.as_is(self.parameters)


SQUARENESS = ("C0Y", "B0Z", "A0Z")


@dataclass(frozen=True)
class SpatialMetricModel:
    """Scale errors of X, Y and Z (optional) and squareness errors C0Y, B0Z and A0Z, in this order.

    A reading x is corrected to `lower` + M (x - `lower`) + p with the columns (1 + s_i) u_i of M.
    A scale error s is positive if readings are too short. Squareness errors are turns of the
    guideway about the positive axis C, B or A (ISO 230-1): the angle between X and Y is 90 degrees
    + C0Y, between X and Z 90 degrees - B0Z, between Y and Z 90 degrees + A0Z, exactly.
    """

    with_scales: bool
    lower: tuple[float, ...]
    upper: tuple[float, ...]

    @property
    def dimension(self) -> int:
        return 3

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        span = [end - start for start, end in zip(self.lower, self.upper, strict=True)]
        scales = tuple(
            Parameter(
                f"scale {axis}", "1", f"scale {axis}", f"scale error of {axis.upper()}", span[i]
            )
            for i, axis in enumerate(AXIS_NAMES)
        )
        squareness = tuple(
            Parameter(
                name,
                "rad",
                name,
                f"squareness of {name[2]} to {reference}",
                span["XYZ".index(name[2])],
            )
            for name, reference in zip(SQUARENESS, "XXY", strict=True)
        )
        return scales + squareness if self.with_scales else squareness

    def axes(self, a: Array) -> Array:
        """Return M (3, 3) at parameters `a`, from differences of readings to true differences."""
        return self._derivatives(a)[0]

    def _derivatives(self, a: Array) -> tuple[Array, Array]:
        """Return M (3, 3) and its derivatives (parameters, 3, 3)."""
        scale = 1.0 + a[:3] if self.with_scales else np.ones(3)
        c, b, a_ = a[-3:]
        sin_c, cos_c, sin_b, sin_a = np.sin(c), np.cos(c), np.sin(b), np.sin(a_)
        # Unit vectors with the stated angles between them: X is (1, 0, 0), Y is (-sin C, cos C, 0),
        # and Z is (sin B, w, v), with w from its product with Y, which is -sin A, and v from its
        # length.
        w = (sin_c * sin_b - sin_a) / cos_c
        v = np.sqrt(1.0 - sin_b**2 - w**2)
        kind = np.result_type(a, float)
        directions = np.array([[1.0, -sin_c, sin_b], [0.0, cos_c, w], [0.0, 0.0, v]], kind)
        turned = np.zeros((3, 3, 3), kind)
        turned[0, :2, 1] = -cos_c, -sin_c
        by_w = np.array(
            [(sin_b - sin_c * sin_a) / cos_c**2, sin_c * np.cos(b) / cos_c, -np.cos(a_) / cos_c],
            kind,
        )
        turned[1, 0, 2] = np.cos(b)
        turned[:, 1, 2] = by_w
        turned[:, 2, 2] = -w * by_w / v
        turned[1, 2, 2] -= sin_b * np.cos(b) / v
        stretched = np.zeros((3, 3, 3), kind)
        for i in range(3):
            stretched[i, :, i] = directions[:, i]
        by_parameter = np.concatenate([stretched, turned * scale]) if self.with_scales else turned
        return directions * scale, by_parameter

    def error(self, x: Array, a: Array, p: Array) -> Array:
        from_lower = x - np.array(self.lower)
        return from_lower @ (self.axes(a) - np.eye(3)).T + p

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        return np.einsum("nij,mj->min", self._derivatives(a)[1], x - np.array(self.lower))

    def reported(self) -> Reported:
        return Reported.as_is(self.parameters)


def parameters_of_metric(metric: Array) -> Array:
    """Return scale and squareness errors (6,) of a metric tensor G (3, 3): equations (102) to
    (107).

    :raises ValueError: G is not positive definite: a difference of readings has no length.

    >>> model = SpatialMetricModel(True, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    >>> a = np.array([1e-5, -2e-5, 3e-5, 4e-5, -5e-5, 6e-5])
    >>> np.abs(parameters_of_metric(model.axes(a).T @ model.axes(a)) - a).max() < 1e-15
    np.True_
    """
    if not (eigvalsh(metric) > 0.0).all():
        raise ValueError("the equations give some differences of readings no length")
    size = np.sqrt(np.diag(metric))
    cosine = metric / np.outer(size, size)
    # The sine of the departure from a right angle is the cosine of the angle.
    return np.array(
        [*(size - 1.0), -np.arcsin(cosine[0, 1]), np.arcsin(cosine[0, 2]), -np.arcsin(cosine[1, 2])]
    )
