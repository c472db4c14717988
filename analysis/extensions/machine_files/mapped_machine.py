"""True machine of a map file."""

from __future__ import annotations

import hashlib
from typing import Annotated, Literal

import numpy as np
from ballplate.simulator.design import Machine
from ballplate.simulator.experiment import References
from ballplate.simulator.inputs import read_bytes
from ballplate.simulator.machines import Corner, ErrorModel, FurtherTrueMachine, TrueMachine
from pydantic import Field, PrivateAttr

from .framing import in_frame_of
from .map_priors import read_named
from .volume_ends import check_within


class TrueMapSettings(FurtherTrueMachine):
    """The machine of a map file."""

    kind: Literal["map"] = Field(description="the machine that a fit has found")
    file: str = Field(description="Map file, as ballplate fit -o writes it.")
    draw: Annotated[int, Field(ge=0)] | None = Field(
        default=None,
        description=(
            "Seed with which the machine is drawn about the estimates, within their covariance;"
            " default: the estimates themselves."
        ),
    )

    # Content of the file; set when the experiment is loaded.
    _machine: TrueMachine | None = PrivateAttr(default=None)
    _content: str = PrivateAttr(default="")

    def true_machine(self, fitted: ErrorModel, lower: Corner, upper: Corner) -> TrueMachine:
        """Return the estimated or drawn errors."""
        machine = self._machine
        assert machine is not None
        return machine if machine.model == fitted else in_frame_of(fitted, machine, lower, upper)


SETTINGS = TrueMapSettings


def read(
    truth: TrueMapSettings, machine: Machine | None, references: References
) -> TrueMapSettings:
    """Return the true machine with that of its map; faults go to the problems."""
    steps = ("true_machine", "file")
    true_map = read_named(truth.file, steps, references)
    if true_map is None:
        return truth
    a = true_map.values
    if truth.draw is not None:
        generator = np.random.default_rng(np.random.SeedSequence(truth.draw))
        root = true_map.root
        a = a + (root @ generator.standard_normal(root.shape[1]))[: len(a)]
    content = hashlib.sha256(read_bytes(references.file(truth.file))).hexdigest()
    truth = truth.completed(_machine=TrueMachine(true_map.model, a), _content=content)
    if true_map.undetermined.shape[1]:
        text = (
            f"has {true_map.undetermined.shape[1]} undetermined directions, in which the true"
            " machine keeps arbitrary values of the fit"
        )
        references.problems.doubt(steps, text)
    if machine is None:
        return truth
    if machine.dimension != true_map.dimension:
        text = f"is of {true_map.dimension} axes, but machine.volume of {machine.dimension}"
        references.problems.add(steps, f"{text}; name another map")
        return truth
    check_within(*true_map.volume.corners, machine, steps, references)
    return truth
