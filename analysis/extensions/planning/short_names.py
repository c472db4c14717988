"""Short names of planned positions, which a person can type at a machine."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

from ballplate.simulator.experiment import Candidate, Experiment, Position

from .set_ups import base_name, position_of

# A column whose name begins so has the rest of it in all rows.
OF_ALL = "="


def short_names(
    order: Iterable[Candidate],
    names_known: Mapping[str, str],
    names_taken: Collection[str],
    names_kept: Collection[str] = (),
) -> dict[str, str]:
    """Return short names by the names of candidates, P1, P2 … in the order of measuring.

    Positions named in the file, and `names_kept`, keep their names, and those `names_known` from an
    earlier plan keep these. No name is `names_taken`, or differs from another in capitals alone;
    numbers in use are skipped, so that each number means one position.
    """
    used = {name.casefold() for name in (*names_taken, *names_known.values())}
    names_found = {}
    number = 0
    for place, candidate in enumerate(order, 1):
        if candidate.name in names_known:
            names_found[candidate.name] = names_known[candidate.name]
        elif is_composed(candidate) and candidate.name not in names_kept:
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
    item = position_of(candidate)
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


def stated_names(experiment: Experiment) -> set[str]:
    """Names of positions that influence quantities or the columns of readings state, which a plan
    keeps.
    """
    stated = {
        name
        for influence in experiment.influences
        for name in getattr(influence, "positions", None) or ()
    }
    columns = experiment.readings.columns
    column = None if columns is None else columns.position
    if column is not None and column.startswith(OF_ALL):
        stated.add(column.removeprefix(OF_ALL))
    return stated


def names_of_plan(chosen: Experiment, candidates: Collection[str]) -> dict[str, str]:
    """Return the candidates' names in the file of an earlier plan, by their names in the pool."""
    return {
        position.description: position.name
        for position in chosen.positions
        if position.description and position.name not in candidates
    }
