"""What the residuals of a fit show, as far as they were searched for gross errors.

The search is an extension's; a fit without it tells only how large its residuals are.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.inputs.extensions import MissingExtensionError, service
from ballplate.simulator.inputs.yamltree import Mark
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.maps.fit_verdict import LackOfFit


class Suspicion(Protocol):
    """What is suspected; false where nothing is.

    It `names_causes` if it is more than that nothing explains the residuals. `marks` tell where the
    readings stand.
    """

    @property
    def suspects(self) -> Sequence[object]: ...

    @property
    def names_causes(self) -> bool: ...

    def __bool__(self) -> bool: ...

    def words(self, marks: Sequence[Mark] = ()) -> list[str]: ...

    def lines(self, marks: Sequence[Mark] = ()) -> list[str]: ...

    def data(self, marks: Sequence[Mark] = ()) -> list[dict[str, Any]]: ...


def diagnosed(
    at: Linearisation, x: Array, freedom: int, sigma_is_estimated: bool
) -> tuple[Suspicion | None, str]:
    """What is suspected of the observations behind a fit, None without the extension that searches
    for it, and why there was no search, empty where there was one.
    """
    try:
        search = service("diagnosed")
    except MissingExtensionError as error:
        return None, f"gross errors were not looked for ({error})"
    found: tuple[Suspicion, str] = search(at, x, freedom, sigma_is_estimated)
    return found


def lack_of_fit(
    squares: float, freedom: int, diagnosis: Suspicion | None, untested: str
) -> LackOfFit:
    """The lack of fit of a sum of squares; residuals that are `untested` may have a pattern."""
    count = len(diagnosis.suspects) if diagnosis else 0
    return LackOfFit(squares, freedom, count, bool(diagnosis or untested))


def has_exact_values(design: Design) -> bool:
    """Whether any value of a design is stated as exact."""
    return any(one.is_exact.any() for one in design.observations)
