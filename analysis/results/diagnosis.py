"""Diagnosis of a fit's residuals by the extension that searches for gross errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from ballplate.presentation.formatting import Data
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.inputs.extensions import MissingExtensionError, service
from ballplate.simulator.inputs.yamltree import Mark
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.maps.fit_verdict import LackOfFit


class Suspicion(Protocol):
    """Observations flagged as gross errors; false if there are none.

    It `names_causes` unless it states only that no gross error explains the residuals. `marks` are
    the locations of readings.
    """

    @property
    def suspects(self) -> Sequence[object]: ...

    @property
    def names_causes(self) -> bool: ...

    def __bool__(self) -> bool: ...

    def words(self, marks: Sequence[Mark] = ()) -> list[str]: ...

    def lines(self, marks: Sequence[Mark] = ()) -> list[str]: ...

    def data(self, marks: Sequence[Mark] = ()) -> list[Data]: ...


def diagnosed(
    at: Linearisation, x: Array, freedom: int, sigma_is_estimated: bool
) -> tuple[Suspicion | None, str]:
    """Return flagged observations, None without the extension, and the reason why there was no
    search, or an empty text.
    """
    try:
        search = service("diagnosed")
    except MissingExtensionError as error:
        return None, f"gross errors were not looked for ({error})"
    diagnosis: tuple[Suspicion, str] = search(at, x, freedom, sigma_is_estimated)
    return diagnosis


def lack_of_fit(
    squares: float, freedom: int, diagnosis: Suspicion | None, untested: str
) -> LackOfFit:
    """Return the lack of fit of a sum of squares; `untested` residuals may have a pattern."""
    count = len(diagnosis.suspects) if diagnosis else 0
    return LackOfFit(squares, freedom, count, bool(diagnosis or untested))


def has_exact_values(design: Design) -> bool:
    """Return whether any value of a design is stated as exact."""
    return any(kind.is_exact.any() for kind in design.observations)
