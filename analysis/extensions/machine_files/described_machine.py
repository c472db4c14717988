"""True machine that a machine file describes."""

from __future__ import annotations

from typing import Literal

from ballplate.simulator.design import Machine
from ballplate.simulator.experiment import References
from ballplate.simulator.inputs import ExperimentError, Length, format_length, listing
from ballplate.simulator.machines import (
    Corner,
    ErrorModel,
    FurtherTrueMachine,
    PlaneModel,
    TrueMachine,
)
from pydantic import Field, PrivateAttr

from .description import MachineDescription, random_part, true_volumetric
from .framing import in_frame_of
from .machine_file import load_machine
from .volume_ends import check_within


class TrueMachineFileSettings(FurtherTrueMachine):
    """The machine in a machine file."""

    kind: Literal["machine"] = Field(description="the machine that a file describes")
    file: str = Field(description="Machine file (YAML), as for ballplate map.")
    level: Length | None = Field(
        default=None,
        description=(
            "In two dimensions the position of the z axis; default: that of the reference point."
        ),
    )
    random_part: Literal["omitted"] | None = Field(
        default=None,
        description=(
            '"omitted": simulate without the random part of the file, which machine.repeatability '
            "covers. Without this key, a file with a random part is refused."
        ),
    )

    # Content of the file; set when the experiment is loaded.
    _machine: MachineDescription | None = PrivateAttr(default=None)

    def true_machine(self, fitted: ErrorModel, lower: Corner, upper: Corner) -> TrueMachine:
        """Return the systematic errors of the machine, in two dimensions those at the level."""
        assert self._machine is not None
        machine = true_volumetric(self._machine)
        if len(lower) == 2:
            level = self._machine.reference[2] if self.level is None else self.level
            machine = TrueMachine(PlaneModel(machine.model, level), machine.a)
        return in_frame_of(fitted, machine, lower, upper)


SETTINGS = TrueMachineFileSettings


def read(
    truth: TrueMachineFileSettings, machine: Machine | None, references: References
) -> TrueMachineFileSettings:
    """Return the true machine with that of its file; faults go to the problems."""
    steps, doubts = ("true_machine", "file"), references.problems.doubts
    try:
        true_machine = load_machine(references.file(truth.file), doubts, references.trust)
    except ExperimentError as error:
        references.problems.take(error, steps)
        return truth
    truth = truth.completed(_machine=true_machine)
    random = random_part(true_machine)
    if random and truth.random_part is None:
        text = (
            f"has a random part that simulated readings would lack: {listing(random)}; let"
            " machine.repeatability cover it and add random_part: omitted, or leave it out of the"
            " machine file"
        )
        references.problems.add(steps, text)
    if machine is None:
        return truth
    level = truth.level
    if level is not None and machine.dimension == 3:
        references.problems.add(("true_machine", "level"), "is for two dimensions; remove it")
    elif level is not None and not true_machine.lower[2] <= level <= true_machine.upper[2]:
        ends = " to ".join(
            format_length(end[2]) for end in (true_machine.lower, true_machine.upper)
        )
        text = f"is outside the file's volume ({ends} in z); stay within it"
        references.problems.add(("true_machine", "level"), text)
    d = machine.dimension
    check_within(true_machine.lower[:d], true_machine.upper[:d], machine, steps, references)
    return truth
