"""The key `part` of an experiment: the part whose dimensions are evaluated."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs import ExperimentError, Settings
from pydantic import Field

if TYPE_CHECKING:
    from ballplate.simulator.experiment import References
    from ballplate.simulator.inputs import Steps

    from .part import Workpiece


class PartOfExperiment(Settings):
    """A part whose dimensions the corrected machine is to measure."""

    file: str = Field(description="part file (YAML), as for ballplate part")


SETTINGS = PartOfExperiment


def read(settings: PartOfExperiment, steps: Steps, references: References) -> Workpiece | None:
    """Return the part of a file; faults go to the problems."""
    from .part_file import load_part

    try:
        return load_part(references.file(settings.file), references.trust)
    except ExperimentError as error:
        references.problems.take(error, (*steps, "file"))
        return None
