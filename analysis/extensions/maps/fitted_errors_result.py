"""Errors of a fitted machine as they show themselves: on a grid, in a plane, along a line, or at
the points of a file, with their expanded uncertainties.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.presentation import Result, Vectors, as_data, box_edges, draw_vectors, projection
from ballplate.results import few_degrees_of_freedom, left_out_words
from ballplate.simulator.design import Tasks
from ballplate.simulator.inputs import hint, number_of
from ballplate.simulator.machines import Array, Integers
from ballplate.simulator.maps import FittedMap

from .fitted_errors import (
    FittedErrors,
    FittedLengths,
    drawn_errors,
    fitted_errors,
    fitted_lengths,
)
from .fitted_tables import (
    error_lines,
    head_lines,
    length_lines,
    map_data,
    point_csv,
    realisation_lines,
)
from .map_places import MapPlaces, PlacesAsked, map_places
from .part_budget import PartBudget, fitted_budget
from .part_tables import budget_data, budget_lines
from .realisations import Draws, Realisations
from .volumetric_errors import LengthErrors, VolumetricErrors
from .volumetric_plots import draw_grid, draw_line

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def map_cautions(fitted: FittedMap) -> tuple[str, ...]:
    """What is to be known of all uncertainties of a map."""
    found = [fitted.known_lack_of_fit.caution]
    if fitted.sigma_is_estimated:
        remedy = "with few, take a larger coverage factor"
        found.append(few_degrees_of_freedom(fitted.degrees_of_freedom, "sigma", remedy))
    if fitted.left_out:
        found.append(left_out_words(fitted))
    count = fitted.undetermined.shape[1]
    if count:
        words = f"{number_of(count, 'direction')} of the parameters"
        found.append(f"the readings left {words} undetermined; what these change is not stated")
    return tuple(filter(None, found))


@dataclass(frozen=True, eq=False, repr=False)
class FittedErrorMap(Result):
    """Errors of a fitted machine at points: `errors`, and those of `lengths`: the body diagonals
    or, along a line, the line's, and measuring tasks that were asked for.

    `places` say where, `probes` (m,) are the indices of the points' probes, and `probe` that of the
    lengths'. `realisations` are drawn where they
    were asked for, and `with_budget` says whether the contributions of the parametric errors are
    shown.
    """

    label: str
    fitted: FittedMap
    places: MapPlaces
    probes: Integers
    probe: int
    errors: FittedErrors
    lengths: FittedLengths
    realisations: Realisations | None = None
    with_budget: bool = False

    @property
    def title(self) -> str:
        return self.fitted.title

    def headline(self) -> str:
        resultant = self.errors.resultant
        known = resultant[~np.isnan(resultant)]
        words = f"{len(resultant)} points"
        if len(known) < len(resultant):
            words += f", {len(resultant) - len(known)} undetermined"
        return f"{words}, resultant {1e6 * known.max():.4g} µm at most" if len(known) else words

    @cached_property
    def budget(self) -> tuple[PartBudget, ...]:
        """What each parametric error contributes: to the errors at the points, and to each of the
        lengths.
        """
        return fitted_budget(self.fitted, self.places, self.probes, self.probe)

    def lines(self) -> list[str]:
        fitted = self.fitted
        lines = head_lines(self.label, fitted, self.probe)
        others = np.unique(self.probes[self.probes != self.probe])
        if len(others):
            told = ", ".join(fitted.probes.names[k] for k in others)
            lines.append(f"points that the table has with other probes: {told}")
        lines += ["", *length_lines(self.lengths, self.places.names, fitted.coverage_factor)]
        lines += [
            "",
            *error_lines(self.errors, fitted.coverage_factor, self.places.names_of_points),
        ]
        if self.realisations is not None:
            lines += ["", *realisation_lines(self.realisations, self.places.names)]
        if self.with_budget:
            lines += ["", *budget_lines(self.budget, fitted.coverage_factor)]
        return lines

    def to_dict(self) -> dict[str, Any]:
        fitted, k = self.fitted, self.fitted.coverage_factor
        found = map_data(self.label, fitted, self.probe)
        found["lengths"] = [
            {
                "name": name,
                "from": self.lengths.starts[i],
                "to": self.lengths.ends[i],
                "length": self.lengths.nominal[i],
                "error": self.lengths.errors[i],
                "expanded_uncertainty": k * self.lengths.uncertainties[i],
            }
            for i, name in enumerate(self.places.names)
        ]
        one = self.errors
        found[self.places.kind] = [
            {
                **told,
                "position": one.points[i],
                "error": one.errors[i],
                "expanded_uncertainty": k * one.uncertainties[i],
                "resultant": one.resultant[i],
            }
            for i, told in enumerate(self._of_table())
        ]
        if self.realisations is not None:
            found["realisations"] = self.realisations.to_dict()
        if self.with_budget:
            found["budget"] = budget_data(self.budget, k)
        return dict(as_data(found)) | {"warnings": list(self.warnings)}

    def rows(self) -> list[dict[str, Any]]:
        """One row for each point, in metres."""
        found, k = self.errors, self.fitted.coverage_factor
        letters = "xyz"[: self.fitted.dimension]
        columns: dict[str, Array] = {
            **{letter: found.points[:, i] for i, letter in enumerate(letters)},
            **{f"error {letter}": found.errors[:, i] for i, letter in enumerate(letters)},
            **{f"U {letter}": k * found.uncertainties[:, i] for i, letter in enumerate(letters)},
            "resultant": found.resultant,
        }
        values = zip(*(column.tolist() for column in columns.values()), strict=True)
        return [
            told | dict(zip(columns, row, strict=True)) | {"k": k, "unit": "m"}
            for told, row in zip(self._of_table(), values, strict=True)
        ]

    def _of_table(self) -> list[dict[str, Any]]:
        """What a table of points says of each: its name and probe."""
        names, probes = self.places.names_of_points, self.fitted.probes.names
        found: list[dict[str, Any]] = [{} for _ in self.errors.points]
        for i, told in enumerate(found):
            told |= {"point": names[i]} if names else {}
            told |= {} if self.places.probes is None else {"probe": probes[self.probes[i]]}
        return found

    def point_lines(self) -> Iterator[str]:
        """The points alone as lines of a CSV file, in units that its columns name."""
        k, names = self.fitted.coverage_factor, self.places.names_of_points
        return point_csv(self.errors, k, self.realisations, names)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be known beside the figures."""
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

    @property
    def notes(self) -> tuple[str, ...]:
        return tuple(f"warning: {one}" for one in self.warnings)

    def plot(self, path: str | Path | None = None, magnification: float | None = None) -> Figure:
        """The errors as a picture: magnified at points, with the bands of their expanded
        uncertainty along a line. `magnification` is of a grid in three dimensions.

        With a path, which ends in .svg, .png or .pdf, the picture is written as well.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path ends in something else, or nothing is determined.
        """
        k, given = self.fitted.coverage_factor, self.errors
        if np.isnan(given.resultant).all():
            raise ValueError("all errors are undetermined; leave the picture out")
        found = VolumetricErrors(given.points, given.errors, given.uncertainties)
        if self.places.kind == "line":
            return draw_line(found, path, k, f"U, k = {k:g}", "correction")
        ends, u = self.lengths, np.full(len(self.lengths.nominal), np.nan)
        if self.places.kind == "grid" and self.fitted.dimension == 3:
            lengths = LengthErrors(
                *(one[:4] for one in (ends.starts, ends.ends, ends.nominal, ends.errors, u))
            )
            x, y, z = self.places.counts
            return draw_grid(found, lengths, (x, y, z), magnification, path)
        known = ~np.isnan(given.resultant)
        view, edges = np.eye(2), None
        if self.fitted.dimension == 3:
            view, towards = projection(3)
            volume = self.fitted.volume
            edges = box_edges(volume.lower, volume.upper, towards)[0] @ view.T
        vectors = Vectors("", given.points[known] @ view.T, given.errors[known] @ view.T)
        return draw_vectors((vectors,), f"{self.title}: corrections", path, edges, "errors")


def fitted_map_errors(
    fitted: FittedMap,
    label: str,
    asked: PlacesAsked,
    probe: str | None = None,
    draws: Draws | None = None,
    with_budget: bool = False,
    tasks: Tasks | None = None,
) -> FittedErrorMap:
    """Errors of a fitted machine at the places asked for, with a probe by its name, by default that
    of the map; the lengths of `tasks` come after the diagonals, or that of a line.

    :raises ValueError: what does not go together, is not in the volume, or no probe of the map.
    """
    names = fitted.probes.names
    chosen = fitted.probe if probe is None else probe
    if chosen not in names:
        raise ValueError(f'no probe "{chosen}"; {hint(chosen, names)}')
    index = names.index(chosen)
    places = map_places(fitted.volume, asked, names, chosen)
    if tasks is not None:
        own = np.full((len(places.names), 2), index)
        places = replace(
            places,
            starts=np.concatenate([places.starts, tasks.points[:, 0]]),
            ends=np.concatenate([places.ends, tasks.points[:, 1]]),
            names=places.names + tasks.names,
            length_probes=np.concatenate([own, tasks.probes]),
        )
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
        with_budget,
    )
