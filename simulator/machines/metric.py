"""The two-dimensional metric: scale difference and squareness of two straight axes.

Source: NBSIR 79-1752, equations (1) to (5): a reading is A times the true co-ordinates, with alpha
the departure from squareness and gamma the scale difference of x and y.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .protocol import Array, Parameter, Reported

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
