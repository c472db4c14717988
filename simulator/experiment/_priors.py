"""Conversion of the settings of priors into priors of poses and machine errors."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from ballplate.simulator.design.objects import Machine
from ballplate.simulator.geometry.artefacts import BryanGaugeSettings
from ballplate.simulator.geometry.motions import AXIS_NAMES, pose_parameter_names
from ballplate.simulator.inputs.messages import Steps, format_path
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantities import PARSERS, QuantityError
from ballplate.simulator.inputs.settings import hint, shorten
from ballplate.simulator.inputs.yamltree import mark_of
from ballplate.simulator.machines.protocol import CustomModelError, ErrorModel, Unit
from ballplate.simulator.machines.settings import build_error_model, kind_of

from .model import Position, Prior, Probe
from .own_sections import needed_service
from .references import References
from .sections import MapPriorSettings, PriorSettings
from .validation import Sections

MOST_PRIORS = 5000


def resolve_priors(
    sections: Sections,
    machine: Machine | None,
    positions: dict[int, Position],
    probes: Mapping[str, Probe],
    references: References,
) -> tuple[Prior, ...]:
    """Return the priors; faults go to the problems."""
    settings, entries = sections.error_model, sections.priors
    if not entries or settings is None or machine is None:
        return ()
    if machine.dimension not in kind_of(settings).dimensions:
        return ()
    try:
        model = build_error_model(settings, *machine.volume.corners)
    except CustomModelError:
        # Told already, with the error model.
        return ()
    known_quantities = _known(model, positions, references)
    priors: list[Prior] = []
    for i, entry in entries.items():
        steps = ("priors", int(i))
        if isinstance(entry, MapPriorSettings):
            read = needed_service("resolve_map_prior", steps, references.problems)
            priors += read(entry, steps, model, machine, references, probes) if read else []
        else:
            priors += _prior(entry, steps, known_quantities, references)
        if len(priors) > MOST_PRIORS:
            text = (
                f"there are {len(priors)} priors up to here, coefficients counted; at most"
                f" {MOST_PRIORS} are possible"
            )
            references.problems.add(("priors", int(i)), text)
            break
    return tuple(priors)


# What a name stands for: name of the parameter, position, probe, component, row over the model,
# unit, nominal value.
_Known = tuple[str, str | None, str | None, int, Array, Unit, float]


def _known(
    model: ErrorModel, positions: dict[int, Position], references: References
) -> dict[str, tuple[_Known, ...]]:
    """Return the parameters of every name that a prior may have."""
    known_quantities: dict[str, tuple[_Known, ...]] = {}
    unit_rows = np.eye(len(model.parameters))
    for row, parameter in zip(unit_rows, model.parameters, strict=True):
        quantity = (parameter.name, None, None, -1, row, parameter.unit, 0.0)
        known_quantities[parameter.name] = (quantity,)
        if parameter.function != parameter.name:
            known_quantities[parameter.function] = (
                *known_quantities.get(parameter.function, ()),
                quantity,
            )
    reported = model.reported()
    for name, k in reported.known_names().items():
        # A quoted coefficient may have the name of a parameter, which is meant then.
        known_quantities.setdefault(
            name, ((reported.names[k], None, None, -1, reported.matrix[k], reported.units[k], 0.0),)
        )
    of_no_error = np.zeros(len(unit_rows))
    for position in positions.values():
        artefact = references.artefacts[position.artefact]
        words = pose_parameter_names(model.dimension)
        if isinstance(artefact, BryanGaugeSettings):
            # A pivot has a place and no turn.
            words = words[: model.dimension]
        elif artefact.role != "plate":
            continue
        for k, word in enumerate(words):
            name = f"{position.name}: {word}"
            unit: Unit
            unit, nominal = (
                ("m", float(position.pose.origin[k])) if k < model.dimension else ("rad", 0.0)
            )
            known_quantities[name] = ((name, position.name, None, k, of_no_error, unit, nominal),)
    return known_quantities


def _prior(
    settings: PriorSettings,
    steps: Steps,
    known_quantities: dict[str, tuple[_Known, ...]],
    references: References,
) -> list[Prior]:
    problems, name = references.problems, settings.parameter
    if name not in known_quantities:
        advice = hint(name, known_quantities)
        if ": " in name and name.endswith(tuple(f": {axis}" for axis in AXIS_NAMES)):
            advice = "of ball co-ordinates state a calibration of kind: coordinates"
        elif name.startswith("probe "):
            advice = "of probe offsets state the standard_uncertainty with the probe"
        problems.add((*steps, "parameter"), f'unknown parameter "{shorten(name)}"; {advice}')
        return []
    mark, place = mark_of(problems.root, (*steps, "parameter")), format_path((*steps, "parameter"))
    priors: list[Prior] = []
    for full, position, probe, component, row, unit, nominal in known_quantities[name]:
        parse, values = PARSERS[unit], []
        for key, text in (
            ("value", settings.value),
            ("standard_uncertainty", settings.standard_uncertainty),
        ):
            try:
                values.append(nominal if text is None else parse(text))
            except QuantityError as error:
                problems.add((*steps, key), str(error))
        if len(values) == 2:
            if values[1] <= 0.0:
                problems.add(
                    (*steps, "standard_uncertainty"),
                    "must be above zero; correct it, or remove the prior",
                )
            by_model = np.array(row)
            priors.append(
                Prior(
                    full,
                    position,
                    probe,
                    component,
                    by_model,
                    values[0],
                    values[1],
                    mark,
                    place,
                    unit,
                )
            )
    return priors
