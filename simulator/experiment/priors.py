"""Conversion of the settings of priors into priors of poses and machine errors."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..design.lookup import Floats, References
from ..design.objects import Machine
from ..geometry.artefacts import BryanGaugeSettings
from ..geometry.motions import AXIS_NAMES, pose_parameter_names
from ..inputs.messages import Steps, format_path
from ..inputs.quantities import QuantityError, parse_angle, parse_length, parse_ratio
from ..inputs.settings import hint, shorten
from ..inputs.yamltree import mark_of
from ..machines.custom import CustomModelError
from ..machines.protocol import ErrorModel, Unit
from ..machines.settings import build_error_model, kind_of
from .model import Position, Prior, Probe
from .sections import MapPriorSettings, PriorSettings
from .structure import Sections

MOST_PRIORS = 5000
PARSERS = {"m": parse_length, "rad": parse_angle, "1": parse_ratio}


def resolve_priors(
    sections: Sections,
    machine: Machine | None,
    positions: dict[int, Position],
    probes: Mapping[str, Probe],
    references: References,
) -> tuple[Prior, ...]:
    """Return the priors; what is wrong goes to the problems."""
    settings, entries = sections.get("error_model"), sections.entries("priors")
    if not entries or settings is None or machine is None:
        return ()
    if machine.dimension not in kind_of(settings).dimensions:
        return ()
    try:
        model = build_error_model(settings, *machine.volume.corners)
    except CustomModelError:
        # Told already, with the error model.
        return ()
    known = _known(model, positions, references)
    found: list[Prior] = []
    for i, entry in entries.items():
        steps: Steps = ("priors", int(i))
        if isinstance(entry, MapPriorSettings):
            # Loaded where a map is named: few experiments have any.
            from .used_maps import resolve_map_prior

            found += resolve_map_prior(entry, steps, model, machine, references, probes)
        else:
            found += _prior(entry, steps, known, references)
        if len(found) > MOST_PRIORS:
            text = (
                f"there are {len(found)} priors up to here, coefficients counted; at most"
                f" {MOST_PRIORS} are possible"
            )
            references.problems.add(("priors", int(i)), text)
            break
    return tuple(found)


# What a name stands for: name of the parameter, position, probe, component, row over the model,
# unit, nominal value.
_Known = tuple[str, str | None, str | None, int, Floats, Unit, float]


def _known(
    model: ErrorModel, positions: dict[int, Position], references: References
) -> dict[str, tuple[_Known, ...]]:
    """Every name that a prior may have, and the parameters it stands for."""
    known: dict[str, tuple[_Known, ...]] = {}
    own = np.eye(len(model.parameters))
    for row, parameter in zip(own, model.parameters, strict=True):
        one: _Known = (parameter.name, None, None, -1, row, parameter.unit, 0.0)
        known[parameter.name] = (one,)
        if parameter.function != parameter.name:
            known[parameter.function] = (*known.get(parameter.function, ()), one)
    reported = model.reported()
    for name, k in reported.known_names().items():
        known.setdefault(
            name, ((reported.names[k], None, None, -1, reported.matrix[k], reported.units[k], 0.0),)
        )
    of_no_error = np.zeros(len(own))
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
            known[name] = ((name, position.name, None, k, of_no_error, unit, nominal),)
    return known


def _prior(
    settings: PriorSettings,
    steps: Steps,
    known: dict[str, tuple[_Known, ...]],
    references: References,
) -> list[Prior]:
    problems, name = references.problems, settings.parameter
    if name not in known:
        advice = hint(name, known)
        if ": " in name and name.endswith(tuple(f": {axis}" for axis in AXIS_NAMES)):
            advice = "of ball co-ordinates state a calibration of kind: coordinates"
        elif name.startswith("probe "):
            advice = "of probe offsets state the standard_uncertainty with the probe"
        problems.add((*steps, "parameter"), f'unknown parameter "{shorten(name)}"; {advice}')
        return []
    mark, place = mark_of(problems.root, (*steps, "parameter")), format_path((*steps, "parameter"))
    found = []
    for full, position, probe, component, row, unit, nominal in known[name]:
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
            found.append(
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
    return found
