"""Error model of the errors that a machine file states, and the correction of a controller."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from ballplate.simulator.inputs import Settings, Steps, Trust
from ballplate.simulator.machines import (
    Corner,
    ErrorModel,
    ErrorModelKind,
    PlaneModel,
    TrueMachine,
    in_space,
)
from pydantic import Field, PrivateAttr

from .description import MachineDescription, fitted_in_plane, fitted_volumetric, true_volumetric
from .machine_file import load_machine


class MachineFileSettings(Settings):
    """The errors in a machine file, without their values, as an error model to be estimated."""

    kind: Literal["machine"] = Field(description="the errors that a machine file states")
    file: str = Field(description="Machine file (YAML), as for ballplate map.")
    knots: int = Field(
        default=3,
        ge=0,
        le=50,
        description=(
            "Interior knots of the cubic splines that represent errors given as tables, evenly"
            " spaced."
        ),
    )

    # Content of the file; set when the experiment is loaded.
    _machine: MachineDescription | None = PrivateAttr(default=None)


def _read(settings: MachineFileSettings, folder: Path, trust: Trust) -> MachineFileSettings:
    machine = load_machine(trust.file(folder, settings.file), trust=trust)
    return settings.completed(_machine=machine)


def _build(settings: MachineFileSettings, lower: Corner, upper: Corner) -> ErrorModel:
    assert settings._machine is not None
    machine = settings._machine if len(lower) == 3 else fitted_in_plane(settings._machine)
    model = fitted_volumetric(machine, *in_space(lower, upper), settings.knots)
    return model if len(lower) == 3 else PlaneModel(model, 0.0)


def _wrong(settings: MachineFileSettings, dimension: int) -> list[tuple[Steps, str]]:
    if _build(settings, (0.0,) * dimension, (1.0,) * dimension).parameters:
        return []
    plane_note = " in the plane of x and y" if dimension == 2 else ""
    text = (
        f"{settings.file} states no error that could be estimated{plane_note}; give polynomials or"
        " tables"
    )
    return [(("file",), text)]


SETTINGS = MachineFileSettings
ERROR_MODEL = ErrorModelKind(MachineFileSettings, _build, wrong=_wrong, read=_read)


def machine_of_file(path: Path, trust: Trust) -> TrueMachine:
    """Return the systematic errors of the machine in a file.

    :raises ExperimentError: the file is invalid.
    """
    return true_volumetric(load_machine(path, trust=trust))
