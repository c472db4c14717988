"""Sum of two error models."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .protocol import Array, ErrorModel, Parameter, Reported


@dataclass(frozen=True)
class JoinedModel:
    """e(x, a, p) = e1(x, a1, p) + e2(x, a2, p) - p, with a = (a1, a2).

    Errors common to both models have two sets of parameters: use the sum for ranks and sums of
    squares only.
    """

    first: ErrorModel
    second: ErrorModel

    @property
    def dimension(self) -> int:
        return self.first.dimension

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of the first model, then those of the second, named "second …"."""
        renamed = (replace(p, name=f"second {p.name}") for p in self.second.parameters)
        return (*self.first.parameters, *renamed)

    def error(self, x: Array, a: Array, p: Array) -> Array:
        n = len(self.first.parameters)
        return self.first.error(x, a[:n], p) + self.second.error(x, a[n:], p) - p

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        n = len(self.first.parameters)
        return np.concatenate(
            [self.first.jacobian(x, a[:n], p), self.second.jacobian(x, a[n:], p)], axis=2
        )

    def reported(self) -> Reported:
        second = self.second.reported()
        names = tuple(f"second {name}" for name in second.names)
        return self.first.reported().beside(replace(second, names=names))
