"""True machine that a machine file describes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.simulator.design import Machine
from ballplate.simulator.experiment import References
from ballplate.simulator.inputs import ExperimentError, Length, format_length, listing
from ballplate.simulator.machines import (
    Array,
    Corner,
    ErrorModel,
    FurtherTrueMachine,
    PlaneModel,
    TrueMachine,
)
from ballplate.simulator.readings import HasRandomPart
from pydantic import Field, PrivateAttr

from .description import MachineDescription, true_volumetric
from .framing import FramedModel, in_frame_of
from .machine_file import load_machine
from .random_errors import RandomPart, random_part, random_roots
from .volume_ends import check_within


@dataclass(frozen=True)
class PartlyRandom(FramedModel, HasRandomPart):
    """Errors with a random part, in two dimensions that at a `level` of the z axis, in metres."""

    random: RandomPart
    level: float

    def random_roots(self, x: Array, p: Array) -> tuple[Array, Array]:
        """Return roots as a model with a random part does."""
        d = self.dimension
        beyond = np.zeros((len(x), 3 - d))
        in_space = np.hstack([x, beyond + self.level]), np.hstack([p, beyond])
        approach, lasting = random_roots(self.random, *in_space)
        return approach[:, :d], lasting[:, :d]


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
    random_part: Literal["drawn", "omitted"] = Field(
        default="drawn",
        description=(
            "Whether simulated readings have the random part of the file: errors within bandwidths"
            " and of probing anew in each reading, those of squareness and temperature once in each"
            " simulated campaign. Where it is omitted, machine.repeatability covers it."
        ),
    )

    # Content of the file; set when the experiment is loaded.
    _machine: MachineDescription | None = PrivateAttr(default=None)

    def true_machine(self, fitted: ErrorModel, lower: Corner, upper: Corner) -> TrueMachine:
        """Return the errors of the machine, in two dimensions those at the level."""
        assert self._machine is not None
        machine = true_volumetric(self._machine)
        level = self._machine.reference[2] if self.level is None else self.level
        if len(lower) == 2:
            machine = TrueMachine(PlaneModel(machine.model, level), machine.a)
        framed = in_frame_of(fitted, machine, lower, upper)
        if self.random_part == "omitted":
            return framed
        random = random_part(self._machine)
        return TrueMachine(PartlyRandom(machine.model, lower, random, level), framed.a)


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
    random = random_part(true_machine).meanings
    if random and truth.random_part == "drawn":
        text = (
            f"has a random part ({listing(random)}) that simulated readings alone have; predicted"
            " uncertainties have as much of it as machine.repeatability covers: determine them by"
            " Monte Carlo (run --trials), or write random_part: omitted"
        )
        references.problems.doubt(steps, text)
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
