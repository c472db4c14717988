"""Protocols of extensions' results that the kernel uses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from ballplate.presentation.formatting import Data

if TYPE_CHECKING:
    from ballplate.simulator.estimation.gauss_newton import Solution
    from ballplate.simulator.maps.map_prior import EarlierCampaign
    from ballplate.simulator.readings.observed_readings import ObservedReadings


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
