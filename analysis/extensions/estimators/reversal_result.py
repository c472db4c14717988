"""Result of a reversal, with the full estimate of the same readings."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.presentation import (
    SHOWN,
    Data,
    FitResult,
    MainTable,
    Vectors,
    by_name,
    draw_vectors,
    number,
    picked,
    table_lines,
)
from ballplate.results import (
    MOST_BALLS,
    Fit,
    ParameterEstimate,
    PlateAxes,
    axes_words,
    coordinates_data,
    in_plate_axes,
)
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Array, Integers, Scale
from ballplate.simulator.readings import ObservedReadings

from .reversal import Reversal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Error of the first-order equations, in standard uncertainties of a result, that causes a warning.
NOTICEABLE = 0.5
# The same that makes the result unusable.
USELESS = 5.0

# Significance level of the test for offsets.
SIGNIFICANCE_LEVEL = 1e-3


def of_all_balls(values: Array, balls: Integers, count: int) -> Array:
    """Return values (k, 2) of `balls` among those of all (count, 2), NaN for the others."""
    every = np.full((count, 2), np.nan)
    every[balls] = values
    return every


@dataclass(frozen=True, eq=False, repr=False)
class ReversalFit(FitResult):
    """The reversal, and the full estimate of the same readings.

    `first` and `second` are positions, the second turned by about 90 degrees clockwise from the
    first; `places` (k, 2) are the readings in the first, of the balls that are read in `both` (k,),
    the only ones that the reversal uses. `names` and `coordinates` (n, 2) are the balls by the
    reversal in the plate's own `axes`, NaN for others. `full` is the estimate by multiple
    redundancy with the same share of the scale difference, and `redundant` its alpha, beta, gamma
    (unless `scale` is "none") and offsets as the reversal defines them, with standard
    uncertainties. `without_offsets` is the p-value of the hypothesis of no offsets; NaN if they are
    parameters.
    """

    label: str
    title: str
    scale: Scale
    offsets: bool
    first: str
    second: str
    places: Array
    found: Reversal
    estimates: tuple[ParameterEstimate, ...]
    axes: PlateAxes
    names: tuple[str, ...]
    both: Integers
    coordinates: Array
    full: Fit
    redundant: tuple[ParameterEstimate, ...]
    without_offsets: float

    @property
    def turn(self) -> float:
        """The turn in radians by multiple redundancy, or by the reversal if the former is
        undetermined.
        """
        estimates = {estimate.name: estimate.value for estimate in self.redundant}
        beta = estimates.get("beta", np.nan)
        return np.pi / 2.0 + (beta if np.isfinite(beta) else self.found.exact_beta)

    @property
    def distortion(self) -> float:
        """Largest error of a ball's co-ordinate by the first-order equations, in metres, in the
        plate's own axes.
        """
        every = of_all_balls(self.found.exact_coordinates, self.both, len(self.names))
        exact, _ = in_plate_axes(every, self.axes)
        return float(np.abs(self.coordinates - exact)[self.both].max())

    @property
    def names_of_both(self) -> tuple[str, ...]:
        """The balls that are read in both positions."""
        return tuple(self.names[ball] for ball in self.both)

    def residual_vectors(self) -> tuple[Vectors, ...]:
        """Readings in the first position less those that the second predicts."""
        label = f"{self.first}, less what {self.second} predicts"
        return (Vectors(label, self.places, self.found.residuals, self.names_of_both),)

    @property
    def observed(self) -> ObservedReadings:
        """The readings of both positions."""
        return self.full.observed

    @property
    def complaint(self) -> str:
        if not self.full.converged:
            return f"the estimate by multiple redundancy has {self.full.solution.status}"
        rank, neglected = self.full.verdict.complaint, self.found.bias > USELESS
        reason = rank or (self._neglected() if neglected else "")
        return "; ".join(filter(None, [reason, self.full.lack_of_fit.complaint]))

    def headline(self) -> str:
        values = (f"{p.name} {1e6 * p.value:.4g} {SHOWN[p.unit]}" for p in self.estimates)
        return f"reversal, {', '.join(values)}"

    def lines(self) -> list[str]:
        """The reversal as lines of text: parameters and co-ordinates, with those of multiple
        redundancy.
        """
        reversal, full = self.found, self.full
        turn = number(np.degrees(self.turn), 8)
        count = "five parameters" if self.offsets else "three parameters, no offsets"
        scale = "none (fitted, but not applied)" if self.scale == "none" else self.scale
        lines = [
            self.heading,
            f"reversal, {count}, scale difference: {scale}",
            (
                f'{len(self.both)} balls; "{self.second}" is turned by {turn} degrees, clockwise,'
                f' from "{self.first}"'
            ),
            (
                f"sigma = {number(1e6 * reversal.sigma)} µm with"
                f" {reversal.degrees_of_freedom} degrees of freedom, of the difference of two"
                " readings; of a single one"
                f" {number(1e6 * reversal.single)} µm"
            ),
            (
                "terms that the first-order equations neglect change no result by more than"
                f" {number(reversal.bias, 2)} standard uncertainties"
            ),
            (
                f"multiple redundancy: {full.solution.status}; sigma = {number(full.sigma)} times"
                " the stated uncertainties"
                f" ({'estimated from the residuals' if full.sigma_is_estimated else 'as given'})"
            ),
            "",
        ]
        return [*lines, *table_lines(COLUMNS, self.rows()), "", *_ball_lines(self)]

    def data(self) -> Data:
        """The reversal as plain data in metres and radians; `multiple_redundancy` has the full
        fit.
        """
        reversal = self.found
        return {
            **self.named,
            "estimator": "reversal",
            **picked(self, "scale", "offsets"),
            "positions": picked(self, "first", "second"),
            "sigma": reversal.sigma if reversal.degrees_of_freedom > 0 else None,
            "degrees_of_freedom": reversal.degrees_of_freedom,
            "neglected_standard_uncertainties": reversal.bias,
            "neglected_coordinates": self.distortion,
            "neglected_offset": float(np.abs(reversal.offset - reversal.exact_offset).max()),
            "estimates": by_name(self.estimates, *FIGURES),
            "axes": {
                "origin": self.names[self.axes.origin],
                "xy"[self.axes.axis]: self.names[self.axes.ball],
            },
            "balls": coordinates_data(self.names, self.coordinates),
            "residuals": coordinates_data(self.names_of_both, reversal.residuals),
            "multiple_redundancy": {
                "relation": by_name(self.redundant, *FIGURES),
                **self.full.to_dict(),
            },
            **self.notes_data(),
        }

    def columns(self) -> MainTable:
        """One row per parameter, with that of multiple redundancy."""
        redundant = {p.name: (p.value, p.standard_uncertainty) for p in self.redundant}
        pairs = [redundant.get(p.name, (np.nan, np.nan)) for p in self.estimates]
        columns = {
            "parameter": "name",
            "reversal": "value",
            "standard uncertainty": "standard_uncertainty",
            "multiple redundancy": [value for value, _ in pairs],
            "its standard uncertainty": [uncertainty for _, uncertainty in pairs],
            "unit": "unit",
        }
        return columns, self.estimates

    def plot(self, path: str | Path | None = None) -> Figure:
        return draw_vectors(self.residual_vectors(), self.title, path)

    def _neglected(self) -> str:
        """A sentence about the error of the first-order equations."""
        away = np.degrees(abs(self.turn - np.pi / 2.0))
        difference = f"{away:.4g} degrees" if away >= 1.0 else f"{3600.0 * away:.3g} arcsec"
        offset = float(np.abs(self.found.offset - self.found.exact_offset).max())
        shift = f" and offsets by up to {_length(offset)}" if self.offsets else ""
        return (
            f"the turn is {difference} from 90 degrees, too far for equations of the first order:"
            " neglected terms change co-ordinates of balls by up to"
            f" {_length(self.distortion)}{shift}, and results by up to {number(self.found.bias, 2)}"
            " of their standard uncertainties; turn the plate closer to 90 degrees, or take the"
            " results of multiple redundancy"
        )

    @property
    def cautions(self) -> tuple[str, ...]:
        warnings = []
        omitted = [name for name in self.names if name not in self.names_of_both]
        if omitted:
            warnings.append(
                f"the reversal omits balls that are not read in both positions: {listing(omitted)}"
            )
        if NOTICEABLE < self.found.bias <= USELESS:
            warnings.append(self._neglected())
        if self.without_offsets < SIGNIFICANCE_LEVEL:
            warnings.append(
                "the residuals are those of an offset between the positions; fit without"
                " --no-offsets"
            )
        if self.full.converged and self.full.too_large:
            warnings.append(
                "the residuals are larger than the stated repeatability explains; standard"
                " uncertainties of multiple "
                + (
                    "redundancy are scaled by them"
                    if self.full.sigma_is_estimated
                    else "redundancy are too small"
                )
            )
        return tuple(warnings)


def _ball_lines(fit: ReversalFit) -> list[str]:
    plate = fit.full.plates[0] if fit.full.plates else None
    missing = np.full_like(fit.coordinates, np.nan)
    full, us = (plate.coordinates, plate.standard_uncertainties) if plate else (missing, missing)
    (x, y), (full_x, full_y), (u, v) = (
        array[:MOST_BALLS].T for array in (fit.coordinates, full, us)
    )
    columns = [
        ("ball", list(fit.names[:MOST_BALLS])),
        ("x, mm", (x, u)),
        ("y, mm", (y, v)),
        ("multiple redundancy: x, mm", (full_x, u)),
        ("y, mm", (full_y, v)),
        ("standard uncertainty of x, µm", (u, 3)),
        ("of y, µm", (v, 3)),
    ]
    omitted = len(fit.names) - MOST_BALLS
    return [
        f"co-ordinates of the balls in the plate's own axes ({axes_words(fit.axes, fit.names)})",
        *table_lines(columns),
        *([f"({omitted} balls more in --json)"] if omitted > 0 else []),
    ]


FIGURES = ("value", "standard_uncertainty", "unit")
COLUMNS = {
    "parameter": "parameter",
    "reversal": ("reversal", "standard uncertainty"),
    "u": ("standard uncertainty", 3),
    "multiple redundancy": ("multiple redundancy", "its standard uncertainty"),
    "its u": ("its standard uncertainty", 3),
    "unit": "unit",
}


def _length(value: float) -> str:
    return f"{number(1e3 * value, 2)} mm" if value >= 1e-3 else f"{number(1e6 * value, 2)} µm"
