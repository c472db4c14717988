"""Volumetric errors of a machine as they show themselves: on a grid, at points or along a line."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.presentation import (
    Data,
    MainTable,
    Result,
    given,
    records,
    table_lines,
)
from ballplate.simulator.experiment import load_machine
from ballplate.simulator.inputs import Message

from .fitted_tables import realisation_lines
from .machine_budget import NOTE, machine_budget
from .map_places import MapPlaces, PlacesAsked, map_places
from .realisations import Draws, Realisations
from .volumetric_errors import (
    LengthErrors,
    Volumetric,
    VolumetricErrors,
    drawn_machine_errors,
)
from .volumetric_plots import draw_grid, draw_line, draw_points
from .volumetric_tables import (
    diagonal_lines,
    error_columns,
    error_data,
    error_lines,
    errors_csv,
    length_data,
    length_line,
    machine_data,
    machine_lines,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class MachineErrors(Result):
    """Volumetric errors of the machine of a file at `places`: `errors` at points, and those of
    `lengths`; `realisations` are optional draws of the random part, `budget` the optional columns
    of what each error contributes.

    `doubts` are improbable statements of the file.
    """

    label: str
    machine: Volumetric
    doubts: tuple[str, ...]
    places: MapPlaces
    errors: VolumetricErrors
    lengths: LengthErrors
    realisations: Realisations | None = None
    budget: Data | None = None

    @property
    def title(self) -> str:
        return self.machine.machine.title

    @property
    def warnings(self) -> tuple[str, ...]:
        return self.doubts

    def headline(self) -> str:
        largest = 1e6 * float(self.errors.resultant.max())
        return f"{len(self.errors.points)} points, resultant {largest:.4g} µm at most"

    def lines(self) -> list[str]:
        diagonals = diagonal_lines(self.lengths)
        points = error_lines(self.errors)
        return [*machine_lines(self.machine), "", *diagonals, "", *points, *self._more()]

    def data(self) -> Data:
        return {
            **machine_data(self.machine),
            "diagonals": [
                {"diagonal": k, **row} for k, row in enumerate(length_data(self.lengths), 1)
            ],
            self.places.kind: error_data(self.errors),
            **self._more_data(),
        }

    def _more(self) -> list[str]:
        """Return the budget and realisations, if requested, as lines of text."""
        lines = []
        if self.budget is not None:
            lines += ["", *table_lines(self.budget), NOTE]
        if self.realisations is not None:
            lines += ["", *realisation_lines(self.realisations, self.places.names)]
        return lines

    def _more_data(self) -> Data:
        """Return the same in metres."""
        keys = ("error", "meaning", "rms", "random_rms", "length_error", "random_length_error")
        budget = self.budget and records(**dict(zip(keys, self.budget.values(), strict=True)))
        return given(realisations=self.realisations and self.realisations.to_dict(), budget=budget)

    def columns(self) -> MainTable:
        """One row for each point, in metres."""
        return {**error_columns(self.errors), "unit": ["m"] * len(self.errors.points)}, ()

    def point_lines(self) -> Iterable[str]:
        """The points alone as lines of a CSV file, in units that its columns name."""
        names = self.places.names_of_points
        return errors_csv(self.errors, self.realisations, error_columns, names)

    def plot(self, path: str | Path | None = None) -> Figure:
        """The errors as vectors, magnified, seen from the front and above.

        With a path, which ends in .svg, .png or .pdf, the picture is written as well.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path ends in something else.
        """
        return draw_points(self.errors, self.machine.volume, self.title, path)


@dataclass(frozen=True, eq=False, repr=False)
class VolumetricMap(MachineErrors):
    """Errors on a grid over the volume, and of the four body diagonals."""

    def plot(self, path: str | Path | None = None) -> Figure:
        """The outside of the grid, nominal and displaced by its magnified errors."""
        return draw_grid(self.errors, self.lengths, self.places.counts, path)


@dataclass(frozen=True, eq=False, repr=False)
class ErrorsOnLine(MachineErrors):
    """Errors along a line, and that of its length."""

    def lines(self) -> list[str]:
        return [*error_lines(self.errors), length_line(self.lengths), *self._more()]

    def data(self) -> Data:
        return {
            **machine_data(self.machine),
            "length": length_data(self.lengths)[0],
            "line": error_data(self.errors),
            **self._more_data(),
        }

    def plot(self, path: str | Path | None = None) -> Figure:
        return draw_line(self.errors, path)


def machine_errors(
    file: Path, asked: PlacesAsked, draws: Draws | None = None, with_budget: bool = False
) -> MachineErrors:
    """Return errors of a machine file at requested locations, with the budget if requested.

    :raises ExperimentError: the file is wrong.
    :raises ValueError: what does not go together, or is not in the machine.
    """
    doubts: list[Message] = []
    machine = load_machine(file, doubts)
    built = Volumetric(machine)
    if draws is not None and not built.is_random:
        raise ValueError("this machine has no random part; leave the realisations out")
    places = map_places(built.volume, asked)
    kind = {"grid": VolumetricMap, "line": ErrorsOnLine}.get(places.kind, MachineErrors)
    return kind(
        file.stem,
        built,
        tuple(map(str, doubts)),
        places,
        built.errors(places.points),
        built.lengths(places.starts, places.ends),
        None if draws is None else drawn_machine_errors(built, places, draws),
        machine_budget(built, places) if with_budget else None,
    )
