"""Checks of the error model and of the true machine, which complete them from their files."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ballplate.simulator.design.objects import Machine
from ballplate.simulator.inputs.extensions import provided
from ballplate.simulator.inputs.messages import ExperimentError, Steps
from ballplate.simulator.machines.protocol import CustomModelError
from ballplate.simulator.machines.settings import build_error_model, kind_of
from ballplate.simulator.machines.truth import (
    FurtherTrueMachine,
    RandomSettings,
    TruthError,
    true_machine,
)

from .references import References
from .validation import Sections

_TRUE_MODEL = ("true_machine", "error_model")


def with_usable_error_model(
    sections: Sections, machine: Machine | None, references: References
) -> Sections:
    """Return the sections, without an error model of which nothing can be built, as what is wrong
    stands in another file; faults go to the problems, also those of an error model for another
    number of dimensions than the volume has, or of a user's own.
    """
    settings = sections.error_model
    if settings is None or _check_model(settings, ("error_model",), machine, references):
        return sections
    return replace(sections, error_model=None)


def _check_model(
    settings: Any, steps: Steps, machine: Machine | None, references: References
) -> bool:
    """Report faults; return true if the settings can be used further."""
    kind, dimension = kind_of(settings), references.dimension
    try:
        kind.read(settings, references.folder, references.trust)
    except ExperimentError as error:
        references.problems.take(error, (*steps, "file"))
        return False
    if kind.is_code:
        if machine is None:
            return True
        try:
            build_error_model(settings, *machine.volume.corners)
        except CustomModelError as error:
            references.problems.add((*steps, error.key), str(error))
        return True
    if dimension is None:
        return True
    if dimension not in kind.dimensions:
        text = (
            f'kind "{settings.kind}" has {kind.dimensions[0]} dimensions, but machine.volume has'
            f" {dimension}; change one of the two"
        )
        references.problems.add((*steps, "kind"), text)
        return True
    wrong = list(kind.wrong(settings, dimension))
    for below, text in wrong:
        references.problems.add((*steps, *below), text)
    return not wrong


def check_true_machine(sections: Sections, machine: Machine | None, references: References) -> None:
    """Report a true machine whose own error model is wrong, or values that its error model cannot
    have.
    """
    settings, truth = sections.error_model, sections.true_machine
    if truth is None:
        return
    true_model = getattr(truth, "error_model", None)
    if true_model is not None and not _check_model(true_model, _TRUE_MODEL, machine, references):
        return
    if isinstance(truth, FurtherTrueMachine):
        read = provided("true_machines", vars(truth)["kind"], "read")
        assert read is not None
        read(truth, machine, references)
        return
    problems = references.problems
    if isinstance(truth, RandomSettings) and truth.position is None and truth.rotation is None:
        text = (
            "without sizes it is a machine without errors; give position: 2 um, rotation: 4 urad,"
            " or both"
        )
        problems.add(("true_machine",), text)
    if (
        settings is None
        or machine is None
        or problems.has_below(("error_model",))
        or problems.has_below(_TRUE_MODEL)
    ):
        return
    corners = machine.volume.corners
    model = build_error_model(settings, *corners)
    if isinstance(truth, RandomSettings):
        # Whatever is drawn is right.
        return
    try:
        true_machine(truth, model, *corners)
    except TruthError as error:
        for name, text in error.problems:
            problems.add(("true_machine", "values", name), text)
