"""A drafted file as `ballplate init` writes it, checked as the file format allows it."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from math import ceil
from pathlib import Path

from ballplate.extensions.planning import HOUR, spent_as_drawn
from ballplate.simulator.experiment import Experiment, load

from .data_sheet import DataSheet
from .draft import draft
from .places import strategies_of


def checked_draft(
    path: Path, sheet: DataSheet, texts: Mapping[str, str]
) -> tuple[str, str, Experiment]:
    """Return the text of a file, the next command, and the experiment.

    :raises ValueError: the plate and the hours do not go with the machine.
    """
    chosen = path.with_name(f"{path.stem}-chosen.yaml")
    plan = ["ballplate", "plan", path, "--hours", f"{sheet.hours:g}", "-o", chosen]
    command = shlex.join(map(str, plan))
    text = drafted(path, sheet, texts, command)
    (experiment,) = load(path, planning=True, text=text)
    least = _least_hours(experiment)
    if sheet.hours < least:
        few = (
            "two positions" if len(sheet.volume) == 2 else "three positions with a change of plane"
        )
        raise ValueError(
            f"{sheet.hours:g} h is too short: {few} take {ceil(10 * least) / 10:g} h; give more"
        )
    return text, command, experiment


def drafted(path: Path, sheet: DataSheet, texts: Mapping[str, str], command: str) -> str:
    """Return the text of a file with the longest simple strategy for which the hours suffice, or
    the shortest.

    :raises ValueError: the plate, the tips and the volume do not go together.
    """
    for starts in reversed(list(strategies_of(sheet.tips_there, sheet.places))):
        (experiment,) = load(path, text=draft(sheet, texts, command, starts))
        hours = spent_as_drawn(experiment).seconds / HOUR
        if hours <= sheet.hours:
            break
    return draft(sheet, texts, command, starts, hours)


def _least_hours(experiment: Experiment) -> float:
    """Return the hours of the three quickest positions with a change of plane, in two dimensions of
    the two quickest; fewer positions, or those of one plane, leave something undetermined.
    """
    pool, space = experiment.pool, experiment.dimension == 3
    assert pool is not None
    quickest = sorted(candidate.seconds for candidate in pool.candidates)[: 3 if space else 2]
    return (sum(quickest) + pool.changes.plane * space) / 3600
