"""Points corrected by a fitted map, and lengths between them, with their uncertainties."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TextIO

import numpy as np
from ballplate.presentation import (
    Data,
    MainTable,
    Result,
    by_axis,
    number,
    picked,
    records,
    table_lines,
)
from ballplate.results import few_degrees_of_freedom, freedom_words, verdict_data, verdict_line
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Flags, Tasks
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import CsvWriter, listing, number_of
from ballplate.simulator.machines import Array
from ballplate.uncertainty import stretches

from ..machine_files import FittedMap, left_out_words
from .corrected_points import corrected_with_blocks, corrected_with_root, tips
from .mapped_lengths import CorrectedLength, mapped_lengths
from .point_files import GivenPoints

# Points and lengths that the text shows.
SHOWN = 20
# Co-ordinates of a covariance, whose size grows with their square.
MOST_CO_ORDINATES = 2000


@dataclass(frozen=True, eq=False, repr=False)
class Correction(Result):
    """Corrected scale readings `given`: `points` (n, d) in metres and covariance `blocks` (n, d, d)
    of each point in square metres, NaN where undetermined.

    `scatter` multiplies the stated repeatability, whose variance is part of all uncertainties; 0
    excludes it. `coverage_factor` applies to expanded uncertainties. `outside` (n,) flags
    extrapolated points.
    """

    fitted: FittedMap
    given: GivenPoints
    points: Array
    blocks: Array
    lengths: tuple[CorrectedLength, ...]
    coverage_factor: float
    scatter: float = 0.0

    @property
    def label(self) -> str:
        return self.fitted.experiment or "map"

    @property
    def title(self) -> str:
        return self.fitted.title

    @property
    def standard_uncertainties(self) -> Array:
        """Of each co-ordinate (n, d), in metres."""
        return np.sqrt(np.diagonal(self.blocks, axis1=1, axis2=2))

    @property
    def expanded_uncertainties(self) -> Array:
        """Coverage factor times the standard uncertainties (n, d), in metres."""
        return self.coverage_factor * self.standard_uncertainties

    @property
    def corrections(self) -> Array:
        """Corrections (n, d) added to the tips by scales and stated probe offsets, in metres; the
        error of indication has the opposite sign.
        """
        return self.points - tips(self.fitted, self.given.points, self.given.probes)

    @property
    def outside(self) -> Flags:
        x, (lower, upper) = self.given.points, self.fitted.volume.of_readings
        return np.asarray(((x < lower) | (x > upper)).any(axis=1))

    @property
    def is_open(self) -> bool:
        """True if a co-ordinate or a length is undetermined."""
        lengths = [length.standard_uncertainty for length in self.lengths]
        return bool(np.isnan(self.points).any() or np.isnan(lengths).any())

    def covariance(self) -> Array:
        """Of all co-ordinates together (n d, n d), those of a point side by side, in square metres;
        NaN where undetermined.

        :raises ValueError: there are too many.
        """
        if self.points.size > MOST_CO_ORDINATES:
            text = (
                f"the covariance of {self.points.size} co-ordinates is too large; at most"
                f" {MOST_CO_ORDINATES} are possible: correct fewer points at once"
            )
            raise ValueError(text)
        _, root = corrected_with_root(self.fitted, self.given.points, self.given.probes)
        flat = root.reshape(-1, root.shape[2])
        of_readings = np.tile((self.scatter * self.fitted.repeatability) ** 2, len(self.points))
        return flat @ flat.T + np.diag(of_readings)

    def headline(self) -> str:
        u = self.expanded_uncertainties
        open_ = int(np.isnan(u).any(axis=1).sum())
        count = number_of(len(self.points), "point")
        if np.isnan(u).all():
            return f"{count}, undetermined"
        missing = f", {open_} undetermined" if open_ else ""
        largest = float(np.nanmax(u))
        u_text = f"U = {self.coverage_factor:g} u = {number(1e6 * largest)} µm at most"
        return f"{count}{missing}; {u_text}"

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings: extrapolation, few degrees of freedom, effects not applied."""
        lack, *cautions = map_cautions(self.fitted, self.coverage_factor)
        outside = np.flatnonzero(self.outside)
        if len(outside):
            words = listing((self.given.name(int(i)) for i in outside), 3)
            cautions.insert(
                0,
                f"{len(outside)} of {len(self.points)} points lie outside the volume of the map;"
                f" corrections are extrapolated and U need not hold: {words}",
            )
        return tuple(filter(None, [lack, *cautions]))

    def lines(self) -> list[str]:
        fitted, k = self.fitted, self.coverage_factor
        how = "estimated" if fitted.sigma_is_estimated else "as given"
        dated = f" of {fitted.date}" if fitted.date else ""
        scatter = "with" if self.scatter else "without"
        lines = [
            f"{fitted.title}: {self.headline()}",
            f"map{dated}: sigma {fitted.sigma:.4g} ({how}),"
            f" {freedom_words(fitted.degrees_of_freedom)}; U = {k:g} u, {scatter} the noise of the"
            " corrected readings",
            verdict_line(fitted.lack_of_fit),
            "a correction is added to the scale readings with the stated offset of the probe; the"
            " error of indication has the opposite sign",
            *self._temperature_lines(),
            "",
            *self._point_table(),
        ]
        return [*lines, "", *self._length_table()] if self.lengths else lines

    def _temperature_lines(self) -> list[str]:
        temperatures = self.fitted.temperatures
        if not temperatures:
            return []
        words = ", ".join(f"{word} {value:.4g} °C" for word, value in temperatures.items())
        return [f"temperatures of the campaign: {words}; not applied to points"]

    def _columns(self, most: int | None = None) -> dict[str, Any]:
        """The columns of the first points."""
        u = self.standard_uncertainties[:most]
        return {
            "point": [self.given.name(i) for i in range(len(u))],
            "probe": [self.fitted.probes.names[probe] for probe in self.given.probes[:most]],
            **by_axis("{}, mm", self.points[:most], u),
            **by_axis("correction {}, µm", self.corrections[:most], u),
        }

    def _point_table(self) -> list[str]:
        u = by_axis("U {}, µm", self.expanded_uncertainties[:SHOWN], 3)
        table = table_lines(self._columns(SHOWN) | u, unknown="undetermined")
        more = len(self.points) - SHOWN
        return [*table, f"(and {more} more points, which -o writes)"] if more > 0 else table

    def _length_table(self) -> list[str]:
        k, u = self.coverage_factor, "standard_uncertainty"
        columns = {
            "length": "name",
            "corrected, mm": ("value", u),
            "correction, µm": (lambda length: length.value - length.read, u),
            "U, µm": (lambda length: k * length.standard_uncertainty, 3),
            "k": (lambda length: k, "{:g}".format),
            "within target": "is_met",
        }
        without = (
            None if any(length.target is not None for length in self.lengths) else "within target"
        )
        table = table_lines(columns, self.lengths[:SHOWN], without, "undetermined")
        more = len(self.lengths) - SHOWN
        return [*table, f"(and {more} more lengths, which --json has)"] if more > 0 else table

    def write_points(self, stream: TextIO) -> None:
        """Write the points as CSV with units in column names; undetermined cells are empty."""
        CsvWriter(stream).writerows(self._point_cells())

    def write_covariance(self, stream: TextIO) -> None:
        """Write the covariance of all co-ordinates as CSV, in square micrometres; undetermined
        cells are empty.

        :raises ValueError: there are too many.
        """
        CsvWriter(stream).writerows(self._covariance_cells())

    def _point_cells(self) -> Iterator[list[str | float]]:
        axes = AXIS_NAMES[: self.fitted.dimension]
        heads = ("{}_mm", "correction_{}_um", "U_{}_um")
        numbers = np.concatenate(
            [1e3 * self.points, 1e6 * self.corrections, 1e6 * self.expanded_uncertainties], axis=1
        )
        names = self._columns()
        yield [
            "name",
            "probe",
            *(template.format(a) for template in heads for a in axes),
            "k",
            "outside",
        ]
        for name, probe, row, is_outside in zip(
            names["point"], names["probe"], _cells(numbers), self.outside, strict=True
        ):
            yield [name, probe, *row, self.coverage_factor, "yes" if is_outside else "no"]

    def _covariance_cells(self) -> Iterator[list[str | float]]:
        axes = AXIS_NAMES[: self.fitted.dimension]
        names = [f"{self.given.name(i)}: {axis}" for i in range(len(self.points)) for axis in axes]
        yield ["covariance_um2", *names]
        for name, row in zip(names, _cells(1e12 * self.covariance()), strict=True):
            yield [name, *row]

    def data(self) -> Data:
        fitted, names = self.fitted, self._columns()
        return {
            **picked(fitted, "title", "sigma", "sigma_is_estimated", "degrees_of_freedom"),
            "lack_of_fit": verdict_data(fitted.lack_of_fit),
            "coverage_factor": self.coverage_factor,
            "with_repeatability": bool(self.scatter),
            "points": records(
                name=names["point"],
                probe=names["probe"],
                point=self.points,
                correction=self.corrections,
                standard_uncertainty=self.standard_uncertainties,
                outside=self.outside,
            ),
            "lengths": [
                {
                    **picked(length, "name", "value"),
                    "correction": length.value - length.read,
                    "standard_uncertainty": length.standard_uncertainty,
                    "within_target": length.is_met,
                }
                for length in self.lengths
            ],
            "warnings": self.warnings,
        }

    def columns(self) -> MainTable:
        """One row for each point, in metres."""
        u = by_axis("u {}, µm", self.standard_uncertainties)
        return {**self._columns(), **u, "unit": ["m"] * len(self.points)}, ()


def map_cautions(fitted: FittedMap, coverage_factor: float) -> list[str]:
    """Return what uncertainties by a map take for granted, the lack of fit first; some are
    empty.
    """
    cautions = [fitted.lack_of_fit.caution]
    if fitted.without_scatter:
        cautions.append(
            "the readings of the map agree with its model except for rounding, as computed ones"
            " do: its uncertainties are zero, too, and cannot be relied on"
        )
    if fitted.sigma_is_estimated:
        remedy = f"expanded uncertainties with k = {coverage_factor:g} may be too small"
        cautions.append(few_degrees_of_freedom(fitted.degrees_of_freedom, "sigma", remedy))
    if not stretches(fitted.model, fitted.volume, fitted.values):
        cautions.append(OWN_SCALES)
    return [*cautions, left_out_words(fitted) if fitted.left_out else ""]


OWN_SCALES = (
    "the error model cannot change the scale: lengths are those of the machine's own scales, and"
    " U excludes their errors"
)


def _cells(rows: Array) -> list[list[str | float]]:
    return [["" if value != value else value for value in row] for row in rows.tolist()]


@single_threaded
def correction(
    fitted: FittedMap,
    given: GivenPoints,
    lengths: Tasks | None = None,
    coverage_factor: float | None = None,
    with_repeatability: bool = False,
) -> Correction:
    """Return corrected scale readings `given`, and lengths; default coverage factor: that of the
    map.

    :raises ValueError: both points of a length are at the same place.
    """
    scatter = fitted.sigma if with_repeatability else 0.0
    places, blocks = corrected_with_blocks(fitted, given.points, given.probes)
    blocks = blocks + np.diag((scatter * fitted.repeatability) ** 2)
    places = np.where(np.isnan(np.diagonal(blocks, axis1=1, axis2=2)), np.nan, places)
    mapped = () if lengths is None else tuple(mapped_lengths(fitted, lengths, scatter))
    factor = coverage_factor or fitted.coverage_factor
    return Correction(fitted, given, places, blocks, mapped, factor, scatter)
