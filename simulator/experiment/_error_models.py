"""Error model, true machine and correction of an experiment, completed from their files."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ballplate.simulator.design.objects import Machine
from ballplate.simulator.inputs.extensions import UnusableError, provided
from ballplate.simulator.inputs.messages import ExperimentError, Steps
from ballplate.simulator.machines.protocol import CustomModelError
from ballplate.simulator.machines.settings import build_error_model, kind_of
from ballplate.simulator.machines.truth import (
    FurtherTrueMachine,
    RandomSettings,
    TruthError,
    true_machine,
)

from .own_sections import needed_service
from .readings_section import CompensationSettings, ReadingsSettings
from .references import References
from .validation import Sections

_TRUE_MODEL = ("true_machine", "error_model")


def with_machines(sections: Sections, machine: Machine | None, references: References) -> Sections:
    """Return the sections with error model, true machine and the correction of readings completed
    from their files; faults go to the problems.

    An error model of which nothing can be built, as what is wrong stands in another file, is left
    out.
    """
    error_model = sections.error_model
    if error_model is not None:
        error_model = _completed(error_model, ("error_model",), machine, references)
    sections = replace(sections, error_model=error_model)
    true_machine = _true_machine(sections, machine, references)
    readings = _with_correction(sections.readings, references)
    return replace(sections, true_machine=true_machine, readings=readings)


def _completed(
    settings: Any, steps: Steps, machine: Machine | None, references: References
) -> Any | None:
    """Return the settings of an error model, or None if they cannot be used further, after
    reporting faults, also those of another number of dimensions than the volume has.
    """
    kind, dimension = kind_of(settings), references.dimension
    try:
        settings = kind.read(settings, references.folder, references.trust)
    except ExperimentError as error:
        references.problems.take(error, (*steps, "file"))
        return None
    if kind.is_code:
        if machine is not None:
            try:
                build_error_model(settings, *machine.volume.corners)
            except CustomModelError as error:
                references.problems.add((*steps, error.key), str(error))
        return settings
    if dimension is None:
        return settings
    if dimension not in kind.dimensions:
        text = (
            f'kind "{settings.kind}" has {kind.dimensions[0]} dimensions, but machine.volume has'
            f" {dimension}; change one of the two"
        )
        references.problems.add((*steps, "kind"), text)
        return settings
    wrong = list(kind.wrong(settings, dimension))
    for below, text in wrong:
        references.problems.add((*steps, *below), text)
    return None if wrong else settings


def _true_machine(sections: Sections, machine: Machine | None, references: References) -> Any:
    """Return the true machine; one whose own error model is wrong, or with values that its error
    model cannot have, is reported.
    """
    settings, truth = sections.error_model, sections.true_machine
    own_model = getattr(truth, "error_model", None)
    if own_model is not None:
        own_model = _completed(own_model, _TRUE_MODEL, machine, references)
        if own_model is None:
            return truth
        truth = truth.model_copy(update={"error_model": own_model})
    if isinstance(truth, FurtherTrueMachine):
        read = provided("true_machines", vars(truth)["kind"], "read")
        assert read is not None
        completed = read(truth, machine, references)
        if not isinstance(completed, type(truth)):
            text = f"read of kind {vars(truth)['kind']} returns {completed!r}; return the settings"
            raise UnusableError(text)
        return completed
    problems = references.problems
    if isinstance(truth, RandomSettings) and truth.position is None and truth.rotation is None:
        text = (
            "without sizes it is a machine without errors; give position: 2 um, rotation: 4 urad,"
            " or both"
        )
        problems.add(("true_machine",), text)
    if (
        truth is None
        or settings is None
        or machine is None
        or problems.has_below(("error_model",))
        or problems.has_below(_TRUE_MODEL)
    ):
        return truth
    corners = machine.volume.corners
    model = build_error_model(settings, *corners)
    if isinstance(truth, RandomSettings):
        # Whatever is drawn is right.
        return truth
    try:
        true_machine(truth, model, *corners)
    except TruthError as error:
        for name, text in error.problems:
            problems.add(("true_machine", "values", name), text)
    return truth


def _with_correction(
    settings: ReadingsSettings | None, references: References
) -> ReadingsSettings | None:
    """Return the settings of readings with the machine whose correction is subtracted."""
    correction = None if settings is None else settings.compensation
    if settings is None or not isinstance(correction, CompensationSettings):
        return settings
    steps = ("readings", "compensation", "file")
    if references.dimension == 2:
        text = "a machine file has 3 dimensions, but machine.volume has 2"
        references.problems.add(steps, text)
        return settings
    read = needed_service("machine_of_file", steps, references.problems)
    if read is None:
        return settings
    try:
        machine = read(references.file(correction.file), references.trust)
    except ExperimentError as error:
        references.problems.take(error, steps)
        return settings
    return settings.model_copy(update={"compensation": correction.completed(_machine=machine)})
