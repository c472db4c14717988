"""Designs that may be wrong in some place: as they are drawn and changed, and as far as they can be
evaluated.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import to_python

from .document import DesignDocument, experiment_of

# A position in the path of a message, by its number.
POSITION = re.compile(r"positions\[(\d+)\]")


def draft_of(document: DesignDocument, planning: bool = False) -> Experiment:
    """Return the experiment of a text with its faults, to be drawn and changed.

    :raises ExperimentError: the text cannot be understood, or has no such variant.
    """
    return experiment_of(document, planning, tolerant=True)


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
    entries = to_python(draft.tree).get("positions") or ()
    drawn = {place.name for place in draft.positions}
    changes: dict[str, Any] = {}
    # From the last on: what is taken out changes the numbers of those after it.
    for i in sorted(faulty(draft), reverse=True):
        name = entries[i].get("name") if isinstance(entries[i], Mapping) else None
        if str(name) in drawn:
            changes[f"positions[{i}].enabled"] = False
        else:
            changes[f"positions[{i}]"] = None
    return draft.with_(changes)


def faulty(draft: Experiment) -> dict[int, str]:
    """Return the first fault of each position that has any, by its number."""
    faults: dict[int, str] = {}
    for message in draft.faults or ():
        if found := POSITION.match(message.path):
            faults.setdefault(int(found[1]), message.text)
    return faults


def problems(draft: Experiment) -> dict[str, str]:
    """Return the first fault of each position that has any and a name, by its name."""
    entries = to_python(draft.tree).get("positions") or ()
    return {
        str(entries[i].get("name")): text
        for i, text in faulty(draft).items()
        if isinstance(entries[i], Mapping)
    }
