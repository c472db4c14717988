"""Common base of calibration items: their values in files, and their observations."""

from __future__ import annotations

from abc import ABC
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self, cast

import numpy as np
from ballplate.simulator.geometry.ball_layouts import BallLayout
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.machines.protocol import ErrorModel, Unit

from ..arrays import Design, Observations
from ..state import State
from .balls import BallObservations
from .whitening import CovarianceRoot, at_least_exact

# A certified distance that differs from the drawing by more than this fraction is a slip of the
# pen.
FAR_FROM_DRAWING = 0.1

# Balls tied to one another by distances are estimated together, with memory that grows as the
# square of their number.
MOST_TIED_BALLS = 3000


@dataclass(frozen=True)
class CertifiedValue:
    """A value stated in a certificate: its item's path, its subject, and value and standard
    uncertainty in `unit`.

    `is_pair`: the two names are balls, in either order. `drawn` is the nominal value of a length.
    """

    item: str
    first: str
    second: str
    value: float
    standard_uncertainty: float
    unit: Unit = "m"
    is_pair: bool = False
    drawn: float | None = None

    @property
    def key(self) -> tuple[str, str, str]:
        """Key that identifies this value."""
        names = sorted((self.first, self.second)) if self.is_pair else (self.first, self.second)
        return self.item, names[0], names[1]


class Calibration(ABC):
    """An item of calibration of one `kind`; a frozen dataclass with the `values` (m, ...) that it
    states, nominal unless `certified`, and with standard uncertainties in fields whose names begin
    with `standard_uncertaint`. A kind without these fields overrides what reads them: `size`,
    `certified_values` and `with_values`.

    `artefact` is empty for values of the machine; their observations have no balls. `are_lengths`:
    values are distances between two balls, named in either order. `root` is that of the covariance
    of its values, absent if they are uncorrelated.
    """

    artefact: str
    kind: str
    are_lengths: ClassVar[bool] = False
    root: CovarianceRoot | None = None

    @property
    def _values(self) -> Array:
        values: Array = vars(self)["values"]
        return values

    @property
    def size(self) -> int:
        """Number of stated values."""
        return len(self._values)

    @property
    def subject(self) -> str:
        """Subject of its values, as text."""
        return self.artefact or "the machine"

    def observed(self, first: int) -> Observations:
        """Its observations where the artefact's balls begin at `first`."""
        raise NotImplementedError

    def names(self, layout: BallLayout) -> list[tuple[str, str]]:
        """Two names for each value, by which a file of certificate values finds it."""
        raise NotImplementedError

    def doubt(self, layout: BallLayout) -> str:
        """Improbable combinations of values that are each possible; possibly empty."""
        return ""

    def certified_values(self, layout: BallLayout) -> Iterator[CertifiedValue]:
        """Return its values, with nominal ones of lengths."""
        observed = self.observed(0)
        drawn = [None] * len(observed)
        if self.are_lengths and isinstance(observed, BallObservations):
            drawn = observed.values(layout.coordinates)[0].tolist()
        # A value without uncertainty has `EXACT` in an adjustment, so that rows can be weighted; in
        # a certificate it is exact again.
        uncertainty = np.where(observed.is_exact, 0.0, observed.uncertainty).tolist()
        for (first, second), value, u, length in zip(
            self.names(layout), observed.value.tolist(), uncertainty, drawn, strict=True
        ):
            yield CertifiedValue(
                "", first, second, value, u, observed.measured_in, self.are_lengths, length
            )

    def true_values(self, design: Design, truth: State, model: ErrorModel, first: int) -> Array:
        """Its values (m,) where balls and the machine are `truth`, whose error model is `model`."""
        return self.observed(first).true_values(design, truth, model)

    def with_values(self, values: Array) -> Self:
        """The same with other values (m,), from a certificate."""
        values = values.reshape(self._values.shape)
        values.setflags(write=False)
        return cast(Self, replace(cast(Any, self), values=values, certified=True))

    def times_as_uncertain(self, factor: float) -> Self:
        """Return the same with `factor` the standard uncertainties."""
        changed = {
            name: factor * value
            for name, value in vars(self).items()
            if name.startswith("standard_uncertaint") and value is not None
        }
        if self.root is not None:
            changed["root"] = replace(self.root, own=at_least_exact(factor * self.root.own))
        return cast(Self, replace(cast(Any, self), **changed))

    def drawn_errors(self, normal: Array, uncertainty: Array) -> Array:
        """Errors (m,) of its values from standard normal numbers (m,)."""
        return uncertainty * normal if self.root is None else self.root.drawn(normal)


def far_from_drawing(certified: float, drawn: float) -> str:
    """Return a message about a certified length far from nominal."""
    return (
        f"{1e3 * certified:.6g} mm is far from the {1e3 * drawn:.6g} mm of the artefact's drawing"
    )
