"""One ratio by which all scales are too long."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.simulator.inputs import Settings
from ballplate.simulator.machines import Array, Corner, ErrorModelKind, Parameter, Reported
from pydantic import Field


@dataclass(frozen=True)
class StretchedModel:
    """e(x, a, p) = a (x - lower) + p."""

    lower: Corner
    upper: Corner

    @property
    def dimension(self) -> int:
        return len(self.lower)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        span = max(end - start for start, end in zip(self.lower, self.upper, strict=True))
        return (Parameter("scale", "1", "scale", "scale error of all axes", span),)

    def error(self, x: Array, a: Array, p: Array) -> Array:
        return a[0] * (x - np.array(self.lower)) + p

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        return (x - np.array(self.lower))[:, :, None]

    def reported(self) -> Reported:
        return Reported.as_is(self.parameters)


class StretchedSettings(Settings):
    """A machine of straight, square axes whose scales are wrong by one ratio."""

    kind: Literal["stretched"] = Field(description="one scale error of all axes")


SETTINGS = StretchedSettings
ERROR_MODEL = ErrorModelKind(
    StretchedSettings, lambda settings, lower, upper: StretchedModel(lower, upper)
)
