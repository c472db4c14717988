"""What an experiment keeps of the campaign of an earlier map: its readings, and its sigma."""

from __future__ import annotations

import math
from dataclasses import dataclass

# An estimated sigma below this is rounding: it is about 1e-9 of readings to 0.2 um.
LEAST_SIGMA = 1e-6


@dataclass(frozen=True)
class MapData:
    """The readings of a map: their number, and the SHA-256 of their content.

    `positions` are fingerprints of the readings of each position, those of a prior map included.
    """

    readings: int
    sha256: str
    positions: tuple[str, ...] = ()

    def common(self, other_data: MapData) -> frozenset[str]:
        """Fingerprints of positions whose readings both have."""
        return frozenset(self.positions) & frozenset(other_data.positions)


@dataclass(frozen=True)
class EarlierCampaign:
    """The campaign of a prior map: its `file`, and its statement on sigma.

    `sum_of_squares` is S^2 at the stated uncertainties, None if it is rounding; `caution` the
    warning on the map's fit, if any.
    """

    file: str
    sigma: float
    degrees_of_freedom: int
    sum_of_squares: float | None
    caution: str = ""

    @property
    def estimate(self) -> float:
        """Sigma from the residuals, or else the stated one."""
        if self.sum_of_squares is None or not self.degrees_of_freedom:
            return self.sigma
        return math.sqrt(self.sum_of_squares / self.degrees_of_freedom)


@dataclass(frozen=True)
class MapShare:
    """The standard uncertainty of a combination of parameters in the map of a `campaign`: at its
    stated uncertainties, and by the machine's change since, in metres.
    """

    campaign: EarlierCampaign
    at_stated: float
    drift: float

    def uncertainty(self, sigma: float) -> float:
        """The standard uncertainty where sigma of the campaign is that."""
        return math.hypot(sigma * self.at_stated, self.drift)
