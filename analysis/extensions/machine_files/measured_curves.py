"""True machine with measured error curves."""

from __future__ import annotations

from typing import Literal

import numpy as np
from ballplate.simulator.design import Machine
from ballplate.simulator.experiment import References
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import ExperimentError, NonEmpty, format_length, listing
from ballplate.simulator.machines import (
    ARRANGEMENT,
    AXIS_ERRORS,
    PRODUCTS,
    ArrangementName,
    ArrangementSettings,
    Corner,
    ErrorModel,
    FurtherTrueMachine,
    TrueMachine,
    arrangement_of,
)
from pydantic import Field, PrivateAttr

from .curve_files import read_numbered_curves
from .curves import Interpolation, Points, curves_model


class CurvesSettings(FurtherTrueMachine):
    """A machine with measured error curves."""

    kind: Literal["curves"] = Field(description="measured error curves")
    files: NonEmpty[str] = Field(
        description=(
            "CSV files, each with the columns position_mm and errors of one axis such as EXX_um and"
            " EAX_urad; errors that no file has are zero."
        )
    )
    interpolation: Interpolation = Field(
        default="linear",
        description="Interpolation between points: linear, cubic splines, or monotone cubics.",
    )
    arrangement: ArrangementName | ArrangementSettings = Field(
        default="MB2", description=ARRANGEMENT
    )
    rotations: Literal["linearised", "full"] = Field(default="linearised", description=PRODUCTS)

    # Curves by ISO 230-1 name; set when the experiment is loaded.
    _curves: dict[str, Points] = PrivateAttr(default_factory=dict)

    def true_machine(self, fitted: ErrorModel, lower: Corner, upper: Corner) -> TrueMachine:
        """Return the curves as an error model whose parameters are all one."""
        model = curves_model(
            self._curves,
            self.interpolation,
            arrangement_of(self.arrangement),
            lower,
            upper,
            self.rotations == "full",
        )
        return TrueMachine(model, np.ones(len(model.parameters)))


SETTINGS = CurvesSettings


def read(truth: CurvesSettings, machine: Machine | None, references: References) -> CurvesSettings:
    """Return the true machine with the curves of its files; faults go to the problems."""
    problems, curves = references.problems, dict[str, Points]()
    for i, file in enumerate(truth.files):
        steps = ("true_machine", "files", i)
        try:
            found, _, note = read_numbered_curves(references.file(file))
        except ExperimentError as error:
            problems.take(error, steps)
            continue
        if note:
            problems.note(steps, f"{file}: {note}")
        twice = [name for name in found if name in curves]
        if twice:
            problems.add(
                steps,
                f"{listing(twice)} is in an earlier file already; leave it out of one of the two",
            )
        curves |= found
        if machine is None:
            continue
        if machine.dimension == 2 and not any(AXIS_ERRORS[curve].in_plane for curve in found):
            text = "has no error that moves points within the plane of x and y; leave it out"
            problems.add(steps, text)
            continue
        name, points = next(iter(found.items()))
        axis = AXIS_ERRORS[name].axis
        lower, upper = machine.volume.lower[axis], machine.volume.upper[axis]
        covered = min(points.positions[-1], upper) - max(points.positions[0], lower)
        if covered < 0.5 * (upper - lower):
            text = (
                f"covers {format_length(points.positions[0])} to"
                f" {format_length(points.positions[-1])}, but machine.volume is"
                f" {format_length(lower)} to {format_length(upper)} in {AXIS_NAMES[axis]}; cover"
                " most of it"
            )
            problems.add(steps, text)
    return truth.completed(_curves=curves)
