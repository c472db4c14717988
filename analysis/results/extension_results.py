"""Protocols of extensions' results that the kernel uses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from ballplate.presentation.formatting import Data
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.inputs.extensions import MissingExtensionError, service
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.yamltree import Mark

if TYPE_CHECKING:
    from ballplate.simulator.estimation.gauss_newton import Solution
    from ballplate.simulator.experiment.earlier_campaigns import EarlierCampaign
    from ballplate.simulator.readings.observed_readings import ObservedReadings

    from .residuals import LackOfFit


class AskedResult(Protocol):
    """A result that prints as lines of text and as plain data."""

    def lines(self) -> list[str]: ...

    def to_dict(self) -> Data: ...


class PredictedAssumptions(AskedResult, Protocol):
    """Assumptions of a prediction; `doubling` are those that more than double U6, the largest
    first: what is assumed, and a line of text.
    """

    @property
    def doubling(self) -> Sequence[tuple[str, str]]: ...

    def words_of(self, name: str) -> str: ...

    def summary(self) -> list[str]: ...


class IssuedCertificate(AskedResult, Protocol):
    """A plate's co-ordinates in its own axes, by their `datum`; `texts` are files by name."""

    @property
    def datum(self) -> str: ...

    def texts(self, path: str | Path) -> Mapping[Path, str]: ...


class SeparateSigmas(AskedResult, Protocol):
    """The estimate with prior maps, `observed` as weighted in it, and the `sum_of_squares` and
    `freedom` of sigma; `degrees_of_freedom` are the fewest of all sigmas in uncertainties,
    `ratios` those of the maps' sigmas to that of readings.
    """

    @property
    def observed(self) -> ObservedReadings: ...
    @property
    def solution(self) -> Solution: ...
    @property
    def sum_of_squares(self) -> float: ...
    @property
    def freedom(self) -> int: ...
    @property
    def degrees_of_freedom(self) -> int: ...
    @property
    def ratios(self) -> Mapping[EarlierCampaign, float]: ...


class NamedCause(Protocol):
    """A cause: one of an observation if it `is_gross`, in `words`."""

    @property
    def is_gross(self) -> bool: ...

    @property
    def words(self) -> str: ...


class Suspicion(Protocol):
    """Causes that residuals show; false if there are none.

    It `names_causes` unless it states only that no cause explains the residuals; `gross_errors` is
    the number of those among observations.
    """

    @property
    def findings(self) -> Sequence[NamedCause]: ...

    @property
    def gross_errors(self) -> int: ...

    @property
    def names_causes(self) -> bool: ...

    @property
    def verdict(self) -> tuple[str, ...]: ...

    def __bool__(self) -> bool: ...

    def lines(self) -> list[str]: ...

    def to_dict(self) -> Data: ...


def diagnosed(
    at: Linearisation, x: Array, sigma_is_estimated: bool, marks: Sequence[Mark]
) -> tuple[Suspicion | None, str]:
    """Return what the residuals show, None without the extension, and the reason why there was no
    search, or an empty text; `marks` are the locations of readings.
    """
    try:
        search = service("diagnosed")
    except MissingExtensionError as error:
        return None, f"gross errors were not looked for ({error})"
    diagnosis: tuple[Suspicion, str] = search(at, x, sigma_is_estimated, marks)
    return diagnosis


def lack_of_fit(
    squares: float, freedom: int, diagnosis: Suspicion | None, untested: str
) -> LackOfFit:
    """Return the lack of fit of a sum of squares; `untested` residuals may have a pattern."""
    from .residuals import LackOfFit

    if not diagnosis:
        return LackOfFit(squares, freedom, 0, bool(untested))
    contradicted = tuple(
        verdict
        for finding, verdict in zip(diagnosis.findings, diagnosis.verdict, strict=True)
        if not finding.is_gross
    )
    return LackOfFit(squares, freedom, diagnosis.gross_errors, True, contradicted)


def has_exact_values(design: Design) -> bool:
    """Return whether any value of a design is stated as exact."""
    return any(kind.is_exact.any() for kind in design.observations)
