"""Balls of a plate in the plate's own axes, as a certificate states them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np
from ballplate.presentation import Data, MainTable, Result, aligned, number, picked, to_uncertainty
from ballplate.results import freedom_words
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Array

NO_ACCREDITATION = (
    "This states results of a fit to readings, as the program computed them. It is not a"
    " calibration certificate of an accredited laboratory."
)

# What a certificate may be told about, and what stands there otherwise.
ABOUT = {
    "identifier": "",
    "date": "",
    "country": "",
    "laboratory": "not stated",
    "e-mail": "not stated",
    "city": "not stated",
    "person": "not stated",
    "customer": "not stated",
    "manufacturer": "not stated",
    "serial number": "not stated",
}


@dataclass(frozen=True)
class PlateDistance:
    """A distance between two balls and its standard uncertainty in metres, NaN where it is
    undetermined.
    """

    balls: tuple[str, str]
    length: float
    standard_uncertainty: float


@dataclass(frozen=True, eq=False, repr=False)
class CertifiedBalls(Result):
    """Balls of a plate in the plate's own axes: `coordinates` (n, d) in metres and their
    `covariance` (n d, n d), those of a ball side by side, in square metres.

    `datum` says what defines the axes.
    `left_out` are balls whose co-ordinates in these axes nothing determined. `scale` tells what the
    lengths rest on, `scale_uncertainty` is that of all lengths in common, as a ratio.
    `reference_temperature` in °C is None where it is unknown. `degrees_of_freedom` are those of
    the scatter that the uncertainties come from, infinite where they are as stated. `fingerprint`
    is the SHA-256 of what it all comes from: the readings, the experiment and what was chosen.
    """

    label: str
    title: str
    artefact: str
    datum: str
    names: tuple[str, ...]
    coordinates: Array
    covariance: Array
    distances: tuple[PlateDistance, ...]
    left_out: tuple[str, ...]
    scale: tuple[str, ...]
    scale_uncertainty: float
    reference_temperature: float | None
    temperature: str
    coverage_factor: float
    degrees_of_freedom: float
    remarks: tuple[str, ...]
    about: Mapping[str, str]
    fingerprint: str

    @property
    def dimension(self) -> int:
        """Number of co-ordinates of a ball, 2 or 3."""
        return self.coordinates.shape[1]

    @property
    def standard_uncertainties(self) -> Array:
        """Of each co-ordinate (n, d), in metres."""
        return np.sqrt(np.diag(self.covariance)).reshape(self.coordinates.shape)

    @property
    def coverage_probability(self) -> float:
        """That of an interval of the coverage factor, by Student's distribution."""
        from scipy.special import ndtr, stdtr

        k, freedom = self.coverage_factor, self.degrees_of_freedom
        return float(2.0 * (ndtr(k) if np.isinf(freedom) else stdtr(freedom, k)) - 1.0)

    @property
    def identifier(self) -> str:
        """What the certificate is called: as stated, or by what it comes from."""
        return self.about["identifier"] or f"ballplate-{self.fingerprint[:16]}"

    @property
    def facts(self) -> dict[str, str]:
        """What is to be known beside the figures, as text."""
        k, freedom = self.coverage_factor, self.degrees_of_freedom
        source = "uncertainties as stated in the experiment"
        if np.isfinite(freedom):
            source = f"uncertainties scaled by the residuals, {freedom_words(int(freedom))}"
        facts_told = {
            "plate": self.artefact,
            "experiment": self.heading,
            "identifier": self.identifier,
            "axes": self.datum,
            "scale": (
                f"from {listing(self.scale)}; relative standard uncertainty"
                f" {number(1e6 * self.scale_uncertainty, 3)} µm/m"
            ),
            "temperature": self.temperature,
            "uncertainty": (f"U = {k:g} u, of {100.0 * self.coverage_probability:.4g} %; {source}"),
        }
        if self.left_out:
            facts_told["undetermined"] = f"no value is stated of {listing(self.left_out)}"
        facts_told["computed by"] = f"ballplate {version('ballplate')}"
        facts_given = {
            key: self.about[key] for key in ABOUT if self.about[key] not in ("", ABOUT[key])
        }
        return facts_told | {key: text for key, text in facts_given.items() if key != "identifier"}

    @property
    def notes(self) -> tuple[str, ...]:
        return (NO_ACCREDITATION, *self.remarks)

    def headline(self) -> str:
        largest = 1e6 * self.coverage_factor * float(self.standard_uncertainties.max())
        return (
            f"{len(self.names)} balls of {self.artefact}, U at most {number(largest, 3)} µm"
            f" (k = {self.coverage_factor:g})"
        )

    def coordinate_table(self) -> list[list[str]]:
        """Co-ordinates in mm with U in µm below a line of headings."""
        axes, u = "xyz"[: self.dimension], self.coverage_factor * self.standard_uncertainties
        rows = [["ball", *(f"{axis}, mm" for axis in axes), *(f"U({axis}), µm" for axis in axes)]]
        for name, place, uncertainties in zip(
            self.names, self.coordinates.tolist(), u.tolist(), strict=True
        ):
            values = [
                to_uncertainty(1e3 * value, 1e3 * component)
                for value, component in zip(place, uncertainties, strict=True)
            ]
            rows.append(
                [name, *values, *(number(1e6 * component, 3) for component in uncertainties)]
            )
        return rows

    def distance_table(self) -> list[list[str]]:
        """Distances in mm with U in µm below a line of headings."""
        rows = [["from", "to", "distance, mm", "U, µm"]]
        for distance in self.distances:
            expanded = self.coverage_factor * distance.standard_uncertainty
            length = to_uncertainty(1e3 * distance.length, 1e3 * expanded)
            rows.append([*distance.balls, length, number(1e6 * expanded, 3)])
        return rows

    def lines(self) -> list[str]:
        facts = [f"{key}: {text}" for key, text in self.facts.items()]
        right = [False, *[True] * (2 * self.dimension)]
        table = aligned(self.coordinate_table(), right)
        lengths = aligned(self.distance_table(), [False, False, True, True])
        return [*facts, "", *table, "", *lengths, "", *self.notes]

    def data(self) -> Data:
        u = self.standard_uncertainties
        axes = "xyz"[: self.dimension]
        return {
            **{key.replace(" ", "_"): text for key, text in self.facts.items()},
            **picked(self, "coverage_factor", "coverage_probability"),
            "degrees_of_freedom": self.degrees_of_freedom,
            **picked(self, "reference_temperature", "scale_uncertainty"),
            "left_out": self.left_out,
            "balls": {
                name: {
                    axis: {"value": value, "standard_uncertainty": distance, "unit": "m"}
                    for axis, value, distance in zip(axes, place, uncertainties, strict=True)
                }
                for name, place, uncertainties in zip(self.names, self.coordinates, u, strict=True)
            },
            "covariance": {"unit": "m^2", "values": self.covariance},
            "distances": [
                {
                    "balls": distance.balls,
                    "value": distance.length,
                    "standard_uncertainty": distance.standard_uncertainty,
                    "unit": "m",
                }
                for distance in self.distances
            ],
            "notes": self.notes,
        }

    def columns(self) -> MainTable:
        """One row for each co-ordinate."""
        count, d = self.coordinates.shape
        columns = {
            "ball": np.repeat(self.names, d),
            "axis": list("xyz"[:d]) * count,
            "value, mm": self.coordinates.ravel(),
            "standard uncertainty, µm": self.standard_uncertainties.ravel(),
            "unit": ["m"] * (count * d),
        }
        return columns, ()
