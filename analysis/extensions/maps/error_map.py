"""Errors of a machine as they show themselves: on a grid, in a plane, along a line, or at points,
of a machine file with their random parts or of the map of a fit with their uncertainties.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.presentation import (
    ROUNDING,
    Data,
    MainTable,
    Result,
    by_axis,
    given,
    number,
    records,
    table_csv,
    table_lines,
)
from ballplate.simulator.computing import comparable
from ballplate.simulator.inputs import hint
from ballplate.simulator.machines import Array

from ..machine_files import FittedMap, is_map_file
from .error_sources import ErrorSource, map_of_source, source_of_machine, source_of_map
from .fitted_errors import drawn_errors, fitted_errors, fitted_lengths
from .machine_budget import NOTE, machine_budget
from .map_places import MapPlaces, PlacesAsked, map_places
from .realisations import Draws, Realisations
from .volumetric_errors import LengthErrors, VolumetricErrors, drawn_machine_errors
from .volumetric_plots import draw_grid, draw_line, draw_points

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNDETERMINED = "undetermined"


@dataclass(frozen=True, eq=False, repr=False)
class ErrorMap(Result):
    """Errors of a machine at points, and of `lengths`: body diagonals or the line's.

    `places` are the locations, `probes` the names of points' probes of a table, if it has them.
    `realisations` are optional draws, of the random part of a machine file or of the covariance of
    a map, `budget` optional columns of what each error of a machine file contributes.
    """

    source: ErrorSource
    places: MapPlaces
    errors: VolumetricErrors
    lengths: LengthErrors
    probes: tuple[str, ...] = ()
    realisations: Realisations | None = None
    budget: Data | None = None

    @property
    def label(self) -> str:
        return self.source.label

    @property
    def title(self) -> str:
        return self.source.title

    def headline(self) -> str:
        resultant = self.errors.resultant
        determined = resultant[~np.isnan(resultant)]
        words = f"{len(resultant)} points"
        if len(determined) < len(resultant):
            words += f", {len(resultant) - len(determined)} undetermined"
        largest = f", resultant {1e6 * determined.max():.4g} µm at most" if len(determined) else ""
        return words + largest

    def lines(self) -> list[str]:
        points = table_lines(self._columns(self.errors), unknown=UNDETERMINED)
        lines = [*self.source.lines, "", *self._length_table(), "", *points, self._extremes()]
        if self.budget is not None:
            lines += ["", *table_lines(self.budget), NOTE]
        if self.realisations is not None:
            lines += ["", *self._realisation_table(self.realisations)]
        return lines

    def _columns(self, errors: VolumetricErrors) -> Data:
        k, u = self.source.coverage_factor, errors.uncertainties
        return {
            **given(point=list(self.places.names_of_points), probe=list(self.probes)),
            **by_axis("{}, mm", errors.points, millimetres),
            **by_axis("error {}, µm", errors.errors, u if np.nan_to_num(u).any() else 4),
            **by_axis("U {}, µm", k * u, expanded),
            "resultant, µm": errors.resultant,
        }

    def _length_table(self) -> list[str]:
        lengths, k = self.lengths, self.source.coverage_factor
        columns = {
            "length error of": list(self.places.names),
            "from": list(map(point_text, lengths.starts)),
            "to": list(map(point_text, lengths.ends)),
            "length, mm": (lengths.nominal, lambda value: f"{1e3 * value:.3f}"),
            "error, µm": (lengths.errors, lengths.uncertainties),
            "U, µm": (k * lengths.uncertainties, expanded),
        }
        return table_lines(columns, unknown=UNDETERMINED)

    def _extremes(self) -> str:
        """Ranges of the components, the largest resultant and uncertainty."""
        errors, resultant = self.errors, self.errors.resultant
        determined = np.flatnonzero(~np.isnan(resultant))
        if not len(determined):
            return "all errors are undetermined"
        worst = int(determined[comparable(resultant[determined]).argmax()])
        ranges = [
            np.ptp(values) for values in (*errors.errors[determined].T, resultant[determined])
        ]
        names = [*"XYZ"[: errors.points.shape[1]], "resultant"]
        words = (f"{name} {number(1e6 * r)}" for name, r in zip(names, ranges, strict=True))
        largest = self.source.coverage_factor * float(np.nanmax(errors.uncertainties))
        text = (
            f"range in µm: {', '.join(words)}; largest resultant {number(1e6 * resultant[worst])}"
            f" µm at {point_text(errors.points[worst])} mm; largest U of a co-ordinate"
            f" {expanded(largest)} µm"
        )
        undetermined = len(resultant) - len(determined)
        if undetermined:
            text += f"; {undetermined} of {len(resultant)} points undetermined"
        return text

    def _realisation_table(self, realisations: Realisations) -> list[str]:
        """The largest error and the length errors of each realisation."""
        largest = np.linalg.norm(realisations.errors, axis=2).max(axis=1)
        columns = [
            ("realisation", range(1, len(largest) + 1)),
            ("largest resultant, µm", largest),
            *(
                (f"{name}, µm", lengths)
                for name, lengths in zip(self.places.names, realisations.lengths.T, strict=True)
            ),
        ]
        seed = realisations.draws.seed
        remark = f"drawn from seed {seed}; --format csv and --json have all points"
        return [*table_lines(columns, unknown=UNDETERMINED), remark]

    def data(self) -> Data:
        k, ends, errors = self.source.coverage_factor, self.lengths, self.errors
        keys = ("error", "meaning", "rms", "random_rms", "length_error", "random_length_error")
        budget = self.budget and records(**dict(zip(keys, self.budget.values(), strict=True)))
        return {
            **self.source.data,
            "lengths": records(
                name=self.places.names,
                **{"from": ends.starts, "to": ends.ends},
                length=ends.nominal,
                error=ends.errors,
                expanded_uncertainty=k * ends.uncertainties,
            ),
            self.places.kind: records(
                **given(point=list(self.places.names_of_points), probe=list(self.probes)),
                position=errors.points,
                error=errors.errors,
                expanded_uncertainty=k * errors.uncertainties,
                resultant=errors.resultant,
            ),
            **given(realisations=self.realisations and self.realisations.to_dict(), budget=budget),
            "warnings": self.warnings,
        }

    def columns(self) -> MainTable:
        """One row for each point, in metres."""
        return self._with_factor(self.errors) | {"unit": ["m"] * len(self.errors.points)}, ()

    def _with_factor(self, errors: VolumetricErrors) -> Data:
        return self._columns(errors) | {"k": [self.source.coverage_factor] * len(errors.points)}

    def point_lines(self) -> Iterator[str]:
        """Yield the points alone as lines of a CSV file, in units that its columns name; with
        realisations, which have no uncertainties, the first column numbers them, 0 for the
        estimate.
        """
        if self.realisations is None:
            yield from table_csv(self._with_factor(self.errors))
            return
        none = np.full_like(self.errors.uncertainties, np.nan)
        drawn = (
            VolumetricErrors(self.errors.points, errors, none)
            for errors in self.realisations.errors
        )
        for i, errors in enumerate((self.errors, *drawn)):
            numbers = {"realisation": [i] * len(errors.points)}
            # The headings stand above the first table alone.
            yield from table_csv(numbers | self._with_factor(errors))[int(i > 0) :]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Cautions of the source, and extrapolated points."""
        volume, points = self.source.volume, self.errors.points
        slightly = 1e-9 * volume.size
        lower, upper = volume.lower - slightly, volume.upper + slightly
        outside = int(((points < lower) | (points > upper)).any(axis=1).sum())
        if not outside:
            return self.source.cautions
        words = f"{outside} of {len(points)} points are outside the volume"
        return (*self.source.cautions, f"{words}, where errors are extrapolated")

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw the outside of a grid displaced by its magnified errors, magnified errors at points
        or, along a line, errors with bands of expanded uncertainty.

        A path in .svg, .png or .pdf saves the plot.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path ends in something else, or nothing is determined.
        """
        if np.isnan(self.errors.resultant).all():
            raise ValueError("all errors are undetermined; leave the picture out")
        if self.places.kind == "line":
            return draw_line(self.errors, self.source.coverage_factor, path)
        if self.places.kind == "grid" and self.errors.points.shape[1] == 3:
            return draw_grid(self.errors, self.lengths, self.places.counts, path)
        return draw_points(self.errors, self.source.volume, f"{self.title}: errors", path)


def map_errors(
    source: Path | FittedMap,
    asked: PlacesAsked,
    probe: str | None = None,
    draws: Draws | None = None,
    with_budget: bool = False,
) -> ErrorMap:
    """Return errors of a machine file, with their budget if requested, or of a map, with a named
    probe (default: that of the map), at places.

    :raises ExperimentError: the file is wrong.
    :raises ValueError: what does not go together, or is not in the machine.
    """
    if isinstance(source, Path) and not is_map_file(source):
        if probe is not None:
            raise ValueError("a machine file states its own probe; leave the probe out")
        return _errors_of_machine(source, asked, draws, with_budget)
    if with_budget:
        raise ValueError("a budget is made of a machine file alone; leave it out")
    fitted, label = map_of_source(source)
    names = fitted.probes.names
    chosen = fitted.probe if probe is None else probe
    if chosen not in names:
        raise ValueError(f'no probe "{chosen}"; {hint(chosen, names)}')
    index = names.index(chosen)
    places = map_places(fitted.volume, asked, names, chosen)
    probes = index if places.probes is None else places.probes
    return ErrorMap(
        source_of_map(fitted, label, index),
        places,
        fitted_errors(fitted, places.points, probes),
        fitted_lengths(fitted, places, index),
        () if places.probes is None else tuple(names[k] for k in places.probes),
        None if draws is None else drawn_errors(fitted, places, draws, probes, index),
    )


def _errors_of_machine(
    file: Path, asked: PlacesAsked, draws: Draws | None, with_budget: bool
) -> ErrorMap:
    built, source = source_of_machine(file)
    if draws is not None and not built.random.meanings:
        raise ValueError("this machine has no random part; leave the realisations out")
    places = map_places(built.volume, asked)
    return ErrorMap(
        source,
        places,
        built.errors(places.points),
        built.lengths(places.starts, places.ends),
        realisations=None if draws is None else drawn_machine_errors(built, places, draws),
        budget=machine_budget(built, places) if with_budget else None,
    )


def expanded(uncertainty: float) -> str:
    """An expanded uncertainty in millionths of its unit."""
    return number(0.0 if uncertainty < ROUNDING else 1e6 * uncertainty, 3)


def millimetres(value: float) -> str:
    """A length in millimetres."""
    return f"{1e3 * value + 0.0:.10g}"


def point_text(point: Array) -> str:
    """A point, in millimetres."""
    return f"({', '.join(map(millimetres, point))})"
