"""The three-dimensional metric: three straight axes with scale errors, not quite square to one
another.

Source: US 4,437,151 (Hurt and Foss), equations (100) to (107). A difference D of readings has the
true length d with d^2 = D' G D. Here G = M'M, and the columns of M are the directions of the axes
times their scale factors; M is upper triangular because X defines the frame's x axis, X and Y its
xy plane. G and M are equivalent: sqrt(G_ii) - 1 is the scale error of axis i, arccos(G_ij /
sqrt(G_ii G_jj)) the angle between axes i and j.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.decompositions import eigvalsh

from .protocol import Array, Parameter, Reported

AXES = ("x", "y", "z")
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
            for i, axis in enumerate(AXES)
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
