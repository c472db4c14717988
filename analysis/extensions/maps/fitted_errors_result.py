"""Errors of a fitted machine as they show themselves: on a grid, in a plane, along a line, or at
the points of a file, with their expanded uncertainties.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.presentation import (
    Data,
    MainTable,
    Result,
    given,
    records,
)
from ballplate.results import few_degrees_of_freedom, left_out_words
from ballplate.simulator.inputs import hint, number_of
from ballplate.simulator.machines import Integers
from ballplate.simulator.maps import FittedMap

from .fitted_errors import (
    drawn_errors,
    fitted_errors,
    fitted_lengths,
)
from .fitted_tables import (
    error_columns,
    error_lines,
    head_lines,
    length_lines,
    map_data,
    realisation_lines,
)
from .map_places import MapPlaces, PlacesAsked, map_places
from .realisations import Draws, Realisations
from .volumetric_errors import LengthErrors, VolumetricErrors
from .volumetric_plots import draw_grid, draw_line, draw_points
from .volumetric_tables import errors_csv

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def map_cautions(fitted: FittedMap) -> tuple[str, ...]:
    """Return cautions on all uncertainties of a map."""
    cautions = [fitted.lack_of_fit.caution]
    if fitted.sigma_is_estimated:
        remedy = "with few, take a larger coverage factor"
        cautions.append(few_degrees_of_freedom(fitted.degrees_of_freedom, "sigma", remedy))
    if fitted.left_out:
        cautions.append(left_out_words(fitted))
    count = fitted.undetermined.shape[1]
    if count:
        words = f"{number_of(count, 'direction')} of the parameters"
        cautions.append(f"the readings left {words} undetermined; what these change is not stated")
    return tuple(filter(None, cautions))


@dataclass(frozen=True, eq=False, repr=False)
class FittedErrorMap(Result):
    """Errors of a fitted machine at points, and of `lengths`: body diagonals or the line's.

    `places` are the locations, `probes` (m,) the indices of the points' probes, `probe` that of
    lengths. `realisations` are optional draws.
    """

    label: str
    fitted: FittedMap
    places: MapPlaces
    probes: Integers
    probe: int
    errors: VolumetricErrors
    lengths: LengthErrors
    realisations: Realisations | None = None

    @property
    def title(self) -> str:
        return self.fitted.title

    def headline(self) -> str:
        resultant = self.errors.resultant
        determined = resultant[~np.isnan(resultant)]
        words = f"{len(resultant)} points"
        if len(determined) < len(resultant):
            words += f", {len(resultant) - len(determined)} undetermined"
        return (
            f"{words}, resultant {1e6 * determined.max():.4g} µm at most"
            if len(determined)
            else words
        )

    def lines(self) -> list[str]:
        fitted = self.fitted
        lines = head_lines(self.label, fitted, self.probe)
        other_probes = np.unique(self.probes[self.probes != self.probe])
        if len(other_probes):
            probe_names = ", ".join(fitted.probes.names[k] for k in other_probes)
            lines.append(f"points that the table has with other probes: {probe_names}")
        lines += ["", *length_lines(self.lengths, self.places.names, fitted.coverage_factor)]
        lines += [
            "",
            *error_lines(self.errors, fitted.coverage_factor, self.places.names_of_points),
        ]
        if self.realisations is not None:
            lines += ["", *realisation_lines(self.realisations, self.places.names)]
        return lines

    def data(self) -> Data:
        fitted, k = self.fitted, self.fitted.coverage_factor
        data = map_data(self.label, fitted, self.probe)
        ends, errors = self.lengths, self.errors
        data["lengths"] = records(
            name=self.places.names,
            **{"from": ends.starts, "to": ends.ends},
            length=ends.nominal,
            error=ends.errors,
            expanded_uncertainty=k * ends.uncertainties,
        )
        data[self.places.kind] = records(
            **self._of_table(),
            position=errors.points,
            error=errors.errors,
            expanded_uncertainty=k * errors.uncertainties,
            resultant=errors.resultant,
        )
        if self.realisations is not None:
            data["realisations"] = self.realisations.to_dict()
        return data | {"warnings": self.warnings}

    def columns(self) -> MainTable:
        """One row for each point, in metres."""
        columns = error_columns(self.errors, self.fitted.coverage_factor)
        return {**self._of_table(), **columns, "unit": ["m"] * len(self.errors.points)}, ()

    def _of_table(self) -> dict[str, list[str]]:
        """Return names and probes of tabulated points."""
        probes = self.fitted.probes.names
        of_points = [] if self.places.probes is None else [probes[k] for k in self.probes]
        return given(point=list(self.places.names_of_points), probe=of_points)

    def point_lines(self) -> Iterator[str]:
        """The points alone as lines of a CSV file, in units that its columns name."""
        columns = partial(error_columns, factor=self.fitted.coverage_factor)
        return errors_csv(self.errors, self.realisations, columns, self.places.names_of_points)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Cautions of the map, and extrapolated points."""
        volume, points = self.fitted.volume, self.errors.points
        slightly = 1e-9 * volume.size
        is_outside = ((points < volume.lower - slightly) | (points > volume.upper + slightly)).any(
            1
        )
        outside = int(is_outside.sum())
        if not outside:
            return map_cautions(self.fitted)
        words = f"{outside} of {len(points)} points are outside the volume"
        return (*map_cautions(self.fitted), f"{words}, where errors are extrapolated")

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw magnified errors at points or, along a line, errors with bands of expanded
        uncertainty.

        A path in .svg, .png or .pdf saves the plot.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path ends in something else, or nothing is determined.
        """
        k, errors_at_points = self.fitted.coverage_factor, self.errors
        if np.isnan(errors_at_points.resultant).all():
            raise ValueError("all errors are undetermined; leave the picture out")
        if self.places.kind == "line":
            return draw_line(errors_at_points, path, k, f"U, k = {k:g}", "correction")
        if self.places.kind == "grid" and self.fitted.dimension == 3:
            counts = self.places.counts
            return draw_grid(errors_at_points, self.lengths, counts, path)
        title = f"{self.title}: corrections"
        return draw_points(errors_at_points, self.fitted.volume, title, path)


def fitted_map_errors(
    fitted: FittedMap,
    label: str,
    asked: PlacesAsked,
    probe: str | None = None,
    draws: Draws | None = None,
) -> FittedErrorMap:
    """Return errors of a fitted machine at places, with a named probe (default: that of the map).

    :raises ValueError: what does not go together, is not in the volume, or no probe of the map.
    """
    names = fitted.probes.names
    chosen = fitted.probe if probe is None else probe
    if chosen not in names:
        raise ValueError(f'no probe "{chosen}"; {hint(chosen, names)}')
    index = names.index(chosen)
    places = map_places(fitted.volume, asked, names, chosen)
    probes = np.full(len(places.points), index) if places.probes is None else places.probes
    return FittedErrorMap(
        label,
        fitted,
        places,
        probes,
        index,
        fitted_errors(fitted, places.points, probes),
        fitted_lengths(fitted, places, index),
        None if draws is None else drawn_errors(fitted, places, draws, probes, index),
    )
