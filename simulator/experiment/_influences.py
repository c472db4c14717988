"""Influence quantities of an experiment: their faults, and their form in a design."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.influence_quantities import (
    InfluenceParameter,
    few,
    wrong_of_parameters,
    wrong_of_shifts,
)
from ballplate.simulator.design.measurement import (
    disturbed_readings,
    in_sequence,
    locations,
    nominal_state,
)
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.number_arrays import Integers

from .model import Experiment, Position
from .references import References
from .sections import InfluenceSettings
from .size_checks import MOST_SHARED
from .validation import Sections


def resolve_influences(
    sections: Sections, positions: dict[int, Position], references: References
) -> tuple[InfluenceSettings, ...]:
    """Return the influence quantities; faults go to the problems."""
    placed = {position.name: position.artefact for position in positions.values()}
    found = []
    standards = [
        name
        for name in dict.fromkeys(placed.values())
        if references.artefacts[name].role != "plate"
    ]
    for i, settings in sections.influences.items():
        steps = ("influences", i)
        text = (
            f'"{standards[0]}" is a length standard, and influence quantities are of plates only;'
            " give it role: plate, or remove influences"
            if standards
            else ""
        )
        if references.require(not text, steps, text):
            settings.check(steps, placed, references)
            found.append(settings)
    return tuple(found)


def with_influences(design: Design, experiment: Experiment, is_pool: bool = False) -> Design:
    """Return the design with the influence quantities of its experiment, and their priors.

    Of a pool only parameters that positions share count against the limit.

    :raises ExperimentError: they have more parameters than memory allows, or one twice; a class
        violates the protocol `Influence`.
    """
    if not experiment.influences:
        return design
    parts = design.parts(experiment.source.parent)
    influences = []
    for i, settings in enumerate(experiment.influences):
        try:
            influences.append(settings.influence(parts))
        except ValueError as error:
            raise experiment.refused(("influences", i), str(error)) from None
        text = wrong_of_parameters(influences[-1].parameters, len(design.positions.names))
        if text:
            raise _of_class(experiment, i, text)
    readings = in_sequence(design.readings, tuple(influences))
    disturbed = replace(design, readings=readings, influences=tuple(influences))
    chosen = readings.select(few(len(readings)))
    state = nominal_state(disturbed)
    x = locations(disturbed, state, chosen) - state.probes[chosen.probe]
    at = disturbed_readings(state, chosen, x)
    for i, influence in enumerate(influences):
        text = wrong_of_shifts(influence, at)
        if text:
            raise _of_class(experiment, i, text)
    parameters = disturbed.influence_parameters
    twice = [
        name
        for name, count in Counter(parameter.name for parameter in parameters).items()
        if count > 1
    ]
    if twice:
        text = f"{twice[0]} is stated by two of them; remove it from one"
        raise experiment.refused(("influences",), text)
    _refuse_too_many(disturbed, experiment, is_pool)
    known_indices = np.flatnonzero(np.isfinite([parameter.uncertainty for parameter in parameters]))
    known_parameters = [parameters[k] for k in known_indices]
    return disturbed.observed(_with_stated(design.of(Priors), known_indices, known_parameters))


def _with_stated(
    priors: Priors, known_indices: Integers, parameters: list[InfluenceParameter]
) -> Priors:
    """Return priors with the stated values of the known parameters of influence quantities."""
    none = np.full(len(known_indices), -1)
    offsets = priors.by_offset
    return Priors(
        (*priors.names, *(parameter.name for parameter in parameters)),
        np.append(priors.position, none),
        np.append(priors.probe, none),
        np.append(priors.component, none),
        np.concatenate([priors.by_model, np.zeros((len(known_indices), priors.by_model.shape[1]))]),
        np.append(priors.value, [parameter.value for parameter in parameters]),
        np.append(priors.uncertainty, [parameter.uncertainty for parameter in parameters]),
        np.append(np.full(len(priors), -1), known_indices),
        None if offsets is None else np.pad(offsets, ((0, len(known_indices)), (0, 0), (0, 0))),
        priors.units,
    )


def _refuse_too_many(disturbed: Design, experiment: Experiment, is_pool: bool) -> None:
    """Refuse more parameters than there is memory for.

    :raises ExperimentError: there are.
    """
    parameters = disturbed.influence_parameters
    shared = disturbed.parameter_count - disturbed.dimension * len(disturbed.plate_balls)
    if is_pool:
        poses = ~disturbed.positions.held[disturbed.posed_positions]
        shared -= int(poses.sum()) + sum(parameter.position >= 0 for parameter in parameters)
    if shared > MOST_SHARED:
        text = (
            f"their {len(parameters)} parameters make {shared} in addition to the balls; at most"
            f" {MOST_SHARED} are possible: leave positions or candidates out, or state parameters"
            " of single positions as exact"
        )
        raise experiment.refused(("influences",), text)


def _of_class(experiment: Experiment, i: int, text: str) -> ExperimentError:
    """Return the fault of the class of the i-th influence quantity."""
    name = type(experiment.influences[i]).__name__
    return experiment.refused(("influences", i), f"the class {name}: {text}")
