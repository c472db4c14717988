"""Sum of two error models."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .protocol import Array, ErrorModel, Parameter, Reported


@dataclass(frozen=True)
class JoinedModel:
    """e(x, a, p) = e1(x, a1, p) + e2(x, a2, p) - p, with a = (a1, a2).

    What both models can say is said by two sets of parameters: such a model tells ranks and sums of
    squares.
    """

    first: ErrorModel
    second: ErrorModel

    @property
    def dimension(self) -> int:
        return self.first.dimension

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those of the first model, then those of the second with a name that says so."""
        others = tuple(replace(one, name=f"second {one.name}") for one in self.second.parameters)
        return self.first.parameters + others

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
