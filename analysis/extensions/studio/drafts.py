"""Designs that may be wrong in some place: as they are drawn and changed, and as far as they can be
evaluated.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from ballplate.extensions.repair.yamltext import TextChange, changed_data
from ballplate.simulator.experiment import Experiment, build, node_of
from ballplate.simulator.inputs import ExperimentError, to_python

from .document import DesignDocument, experiment_of


def draft_of(document: DesignDocument, planning: bool = False) -> Experiment:
    """Return the experiment of a text with its faults, to be drawn and changed.

    :raises ExperimentError: the text cannot be understood, or has no such variant.
    """
    return experiment_of(document, planning, tolerant=True)


def draft_with(draft: Experiment, changes: Iterable[TextChange]) -> Experiment:
    """Return a draft, not for planning, after changes of its file that are not written.

    :raises ExperimentError: the changed file could not be understood.
    """
    data = to_python(draft.tree)
    for change in changes:
        data = changed_data(data, change)
    tree = node_of(data, draft.tree.mark)
    changed, faults = build(tree, draft.source, draft.name, draft.trust, tolerant=True)
    if changed is None:
        raise ExperimentError(faults)
    return replace(changed, faults=tuple(faults))


def evaluable_of(document: DesignDocument, planning: bool = False) -> Experiment:
    """Return the experiment of a text without the positions that have faults.

    :raises ExperimentError: something else is wrong too, or nothing is left.
    """
    return evaluable(draft_of(document, planning))


def evaluable(draft: Experiment) -> Experiment:
    """Return the experiment without the positions that have faults.

    :raises ExperimentError: something else is wrong too, or nothing is left.
    """
    if not draft.faults and all(place.enabled for place in draft.positions):
        return draft
    entries, drawn = entries_of(draft), {place.name for place in draft.positions}
    changes: dict[str, Any] = {}
    # From the last on: what is taken out changes the numbers of those after it.
    for i in sorted(faulty(draft), reverse=True):
        if str(entries[i].get("name")) in drawn:
            changes[f"positions[{i}].enabled"] = False
        else:
            changes[f"positions[{i}]"] = None
    return draft.with_(changes)


def entries_of(draft: Experiment) -> list[Mapping[str, Any]]:
    """Return the positions as the file states them, empty ones for what is no mapping."""
    entries = to_python(draft.tree).get("positions") or ()
    return [entry if isinstance(entry, Mapping) else {} for entry in entries]


def faulty(draft: Experiment) -> dict[int, str]:
    """Return the first fault of each position that has any, by its number."""
    faults: dict[int, str] = {}
    for message in draft.faults or ():
        if message.steps[:1] == ("positions",) and len(message.steps) > 1:
            faults.setdefault(int(message.steps[1]), message.text)
    return faults


def problems(draft: Experiment) -> dict[str, str]:
    """Return the first fault of each position that has any and a name, by its name."""
    entries = entries_of(draft)
    return {
        str(entries[i]["name"]): text for i, text in faulty(draft).items() if "name" in entries[i]
    }
