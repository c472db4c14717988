"""Sag of a plate on its supports under its own weight.

A ball at y in its plate's frame without weight is at R (y + A f(y) (g n) n) + o, where n is the
plate's normal, g the direction of gravity in the plate's frame, and A f(y) the sag with the normal
up. An upright plate does not sag; with its normal down it sags the other way in its own frame.
Terms linear in y belong to the pose.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from ballplate.simulator.design import DesignParts, Disturbed, Influence, InfluenceParameter
from ballplate.simulator.experiment import InfluenceSettings, References
from ballplate.simulator.geometry import AXIS_NAMES, Name
from ballplate.simulator.inputs import (
    ExperimentError,
    Forms,
    Length,
    Message,
    NonEmpty,
    Settings,
    Steps,
    Text,
    hint,
    listing,
)
from ballplate.simulator.machines import Array
from pydantic import Field

from .temperature import or_unknown

QUADRATIC = {"x": ("x",), "y": ("y",), "both": ("x", "y")}
Direction = Literal["x", "y", "z", "-x", "-y", "-z"]


class TermSettings(Settings):
    """A term of a polynomial in the co-ordinates of balls, about the middle of the plate."""

    factor: float = Field(1.0, description="size of the term relative to others; default 1")
    x: Annotated[int, Field(ge=0, le=12)] = Field(0, description="power of x; default 0")
    y: Annotated[int, Field(ge=0, le=12)] = Field(0, description="power of y; default 0")


class SagSettings(InfluenceSettings):
    """Sag of a plate on its supports under its own weight."""

    kind: Literal["sag"] = Field(description="sag of a plate under its own weight")
    artefact: Name | None = Field(
        None, description="plate that sags; optional if there is exactly one artefact"
    )
    value: Length | None = Field(
        None,
        description=(
            "largest sag of a ball, of the plate with its normal up; default 0 um, or that in"
            " the file of values"
        ),
    )
    standard_uncertainty: Length | None = Field(
        None, description="of it; 0 um: exactly known; left out: unknown"
    )
    shape: Forms[Literal["x", "y", "both"], NonEmpty[TermSettings], TermSettings] | None = Field(
        None,
        description=(
            "quadratic along x, y or both (default) of the plate, largest at its middle and zero"
            " at the outermost balls, or terms of a polynomial in the co-ordinates of balls,"
            " which are 0 at the middle and 1 at the outermost"
        ),
    )
    values: Text | None = Field(
        None, description="CSV file with the sag of each ball, columns ball and sag_um"
    )
    gravity: Direction | None = Field(
        None, description="its direction in the machine; default -z, in two dimensions -y"
    )

    def check(self, steps: Steps, positions: Mapping[str, str], references: References) -> None:
        """Report unknown names, two shapes at once, invalid files, and artefacts that do not
        bend.
        """
        name = references.artefact(self.artefact, steps)
        d = references.dimension
        references.is_not_negative(self.standard_uncertainty, (*steps, "standard_uncertainty"))
        references.require(
            self.shape is None or self.values is None,
            (*steps, "shape"),
            "stands beside values, which are a shape; remove one of them",
        )
        references.require(
            d != 2 or self.gravity in (None, "x", "y", "-x", "-y"),
            (*steps, "gravity"),
            "is across the plane of the experiment, where nothing is read; give x, y, -x or -y",
        )
        if name is None or name not in references.layouts:
            return
        layout = references.layouts[name]
        try:
            if self.values is not None:
                references.file(self.values)
            places = layout.coordinates[:, : d or 3]
            shape = _shape(self, layout.names, places, d or 3, references.folder)
        except ExperimentError as error:
            references.problems.take(error, (*steps, "values"))
            return
        references.require(
            bool(np.abs(shape).max(initial=0.0) > 0.0),
            (*steps, "values" if self.values is not None else "shape"),
            f"bends no ball of {name}; give a shape that is not zero at all of them",
        )

    def influence(self, design: DesignParts) -> Sag:
        """The sag in a design."""
        d, names = design.machine.dimension, design.artefacts.names
        artefact = names.index(self.artefact) if self.artefact is not None else 0
        balls_of_artefact = design.balls.of(artefact)
        deflections = np.zeros(len(design.balls.names))
        labels = tuple(design.balls.names[k] for k in balls_of_artefact)
        deflections[balls_of_artefact] = _shape(
            self, labels, design.balls.places[balls_of_artefact], d, design.folder
        )
        largest = float(np.abs(deflections).max())
        value = self.value
        if value is None:
            value = largest if self.values is not None else 0.0
        u = or_unknown(self.standard_uncertainty)
        gravity = self.gravity or ("-z" if d == 3 else "-y")
        down = np.eye(d)[AXIS_NAMES.index(gravity[-1])] * (-1.0 if gravity[0] == "-" else 1.0)
        parameter = InfluenceParameter(f"sag of {names[artefact]}", "m", value, u, 1.0)
        return Sag(deflections / largest, down, parameter)


@dataclass(frozen=True)
class Sag(Influence):
    """A `shape` (n,) over all balls, 1 at its largest, the direction `down` (d,) of gravity in the
    machine, and the largest sag.
    """

    shape: Array
    down: Array
    parameter: InfluenceParameter

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        return (self.parameter,)

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """A displacement along the normal, if gravity is along it."""
        normal = at.rotations[:, :, -1]
        derivative = (self.shape[at.ball] * (normal @ self.down))[:, None] * normal
        return self.parameter.value * derivative, derivative[:, :, None]


def _shape(
    settings: SagSettings, names: tuple[str, ...], places: Array, d: int, folder: Path
) -> Array:
    """Return the sag of balls (n,) at `places` (n, d) of the plate, in any unit.

    :raises ExperimentError: a file of values is invalid, or of other balls.
    """
    if settings.values is not None:
        return _values(folder / settings.values, names)
    flat = places[:, : d - 1] - 0.5 * (places.min(axis=0) + places.max(axis=0))[: d - 1]
    extent = np.abs(flat).max(axis=0, initial=0.0)
    u = np.zeros((len(flat), 2))
    u[:, : d - 1] = flat / np.where(extent > 0.0, extent, 1.0)
    shape = settings.shape
    if shape is not None and not isinstance(shape, str):
        listed = shape if isinstance(shape, tuple) else (shape,)
        terms = [term.factor * u[:, 0] ** term.x * u[:, 1] ** term.y for term in listed]
        return np.sum(terms, axis=0)
    along = [AXIS_NAMES.index(component) for component in QUADRATIC[shape or "both"]]
    size = np.append(extent, 0.0)[along]
    squared = ((u[:, along] * size) ** 2).sum(axis=1)
    largest = squared.max(initial=0.0)
    return 1.0 - squared / largest if largest > 0.0 else np.zeros(len(u))


def _values(path: Path, names: tuple[str, ...]) -> Array:
    """Values (n,) of a file for each of the balls.

    :raises ExperimentError: the file is invalid; a ball is unknown, missing or there twice.
    """
    from ballplate.simulator.inputs import read_table

    values_by_name = {}
    messages = []
    for row in read_table(path, ["ball"], ["sag"]):
        (ball,), (value,) = row.texts, row.lengths
        if ball not in names:
            messages.append(row.mark.message("", f'unknown ball "{ball}"; {hint(ball, names)}'))
        elif ball in values_by_name:
            messages.append(row.mark.message("", f'ball "{ball}" is there twice; remove a line'))
        values_by_name[ball] = value
    missing = [name for name in names if name not in values_by_name]
    if missing:
        text = f"no line for {listing(missing)}; give what each ball sags by"
        messages.append(Message(str(path), 1, 1, "", text))
    if messages:
        raise ExperimentError(messages)
    return np.array([values_by_name[name] for name in names])


SETTINGS = SagSettings
