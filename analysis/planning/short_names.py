"""Short names of planned positions, which a person can type at a machine."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ballplate.simulator.experiment.model import Candidate, Experiment, Position

from .set_ups import base_name

# A column whose name begins so has the rest of it in all rows.
OF_ALL = "="


def short_names(
    order: Iterable[Candidate], names_known: Mapping[str, str], names_taken: Collection[str]
) -> dict[str, str]:
    """Return short names by the names of candidates, P1, P2 … in the order of measuring.

    Positions named in the file keep their names, and those `names_known` from an earlier plan keep
    these. No name is `names_taken`, or differs from another in capitals alone; numbers in use are
    skipped, so that each number means one position.
    """
    used = {name.casefold() for name in (*names_taken, *names_known.values())}
    names_found = {}
    number = 0
    for place, candidate in enumerate(order, 1):
        if candidate.name in names_known:
            names_found[candidate.name] = names_known[candidate.name]
        elif is_composed(candidate):
            number = max(number + 1, place)
            while f"p{number}" in used:
                number += 1
            names_found[candidate.name] = f"P{number}"
            used.add(f"p{number}")
    return names_found


def is_composed(candidate: Candidate) -> bool:
    """True if the pool composed the candidate's name."""
    return (
        isinstance(candidate.item, Position)
        and not candidate.drawn
        and candidate.group not in ("", base_name(candidate.name))
    )


def with_short_name(candidate: Candidate, name: str, probes: tuple[str, ...]) -> Candidate:
    """A position under a short name, described by the name that it had, with its probes in the
    order of measuring.

    Probes of several groups of readings stay in the order of the groups.
    """
    item = candidate.item
    assert isinstance(item, Position)
    settings = dict(candidate.settings)
    description = item.description
    if name != candidate.name:
        description = candidate.name
        settings = {"name": name, "description": description} | {
            key: value for key, value in settings.items() if key not in ("name", "description")
        }
    readings = item.readings
    if len(readings) == 1 and settings.get("probes") and set(probes) == set(readings[0].probes):
        settings["probes"] = list(probes)
        readings = (replace(readings[0], probes=probes),)
    item = replace(item, name=name, description=description, readings=readings)
    return replace(candidate, name=name, item=item, settings=settings)


def with_names(experiment: Experiment, names: Mapping[str, str]) -> Experiment:
    """Return the experiment with its statements on single positions under short names."""
    influences = tuple(
        influence.model_copy(update={"positions": renamed(old_positions, names)})
        if (old_positions := getattr(influence, "positions", None)) is not None
        else influence
        for influence in experiment.influences
    )
    readings = experiment.readings
    if readings.columns is not None:
        old_positions = renamed_of_all(readings.columns.position, names)
        columns = readings.columns.model_copy(update={"position": old_positions})
        readings = readings.model_copy(update={"columns": columns})
    return replace(experiment, influences=influences, readings=readings)


def renamed_of_all(column: str | None, names: Mapping[str, str]) -> str | None:
    """Return a table's column of positions, or the position of all rows stated as =NAME, by short
    name.
    """
    if column is None or not column.startswith(OF_ALL):
        return column
    name = column.removeprefix(OF_ALL)
    return OF_ALL + names.get(name, name)


def renamed(settings: Mapping[str, Any] | Sequence[str], names: Mapping[str, str]) -> Any:
    """Return settings by position, or a list of positions, by short names."""
    if isinstance(settings, Mapping):
        return {names.get(name, name): value for name, value in settings.items()}
    new_names = [names.get(name, name) for name in settings]
    return tuple(new_names) if isinstance(settings, tuple) else new_names


def names_of_plan(chosen: Experiment, candidates: Collection[str]) -> dict[str, str]:
    """Return the candidates' names in the file of an earlier plan, by their names in the pool."""
    return {
        position.description: position.name
        for position in chosen.positions
        if position.description and position.name not in candidates
    }
