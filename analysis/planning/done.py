"""Positions that have been read already, as a file of readings tells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from simulator.experiment.messages import ExperimentError, Message
from simulator.experiment.model import Experiment, Position, ReadingGroup
from simulator.experiment.pool import Candidate, with_chosen
from simulator.experiment.tables import column_names, read_table
from simulator.layout import lay_out
from simulator.readings import AXES, read_readings
from simulator.settings import hint

# What an experiment file says of the readings of a position.
GROUP = ("probes", "balls", "repeats", "standard_uncertainty", "readings")


def done_candidates(path: Path, experiment: Experiment, candidates: Sequence[Candidate]) -> dict[int, Candidate]:
    """Candidates that a file of readings has readings of, by index, each with the readings that were taken.

    :raises ExperimentError: the file is wrong, names a position that is no candidate, or leaves balls of a plate
    unread.
    """
    places = {c.name: k for k, c in enumerate(candidates) if isinstance(c.item, Position)}
    texts = ["position", "ball", "probe"] if "probe" in column_names(path) else ["position", "ball"]
    messages: dict[str, Message] = {}
    found: dict[str, int] = {}
    for row in read_table(path, texts, AXES[: experiment.dimension], ["u"]):
        name = row.texts[0]
        if name in places:
            found[name] = places[name]
        elif name not in messages:
            text = f'no position "{name}" in the file or its pool; {hint(name, places)}'
            messages[name] = row.mark.message("", text)
    if messages:
        raise ExperimentError(list(messages.values()))
    read = [candidates[k] for k in found.values()]
    design = read_readings(path, lay_out(with_chosen(experiment, read))).design
    result = {}
    for number, (candidate, k) in enumerate(zip(read, found.values(), strict=True)):
        item = candidate.item
        assert isinstance(item, Position)
        own = design.readings.select(np.flatnonzero(design.readings.position == number))
        layout = experiment.layouts[item.artefact]
        groups: dict[tuple[str, tuple[float, ...] | None], dict[int, int]] = {}
        first = int(np.flatnonzero(design.ball_artefact == list(design.artefact_names).index(item.artefact))[0])
        for i in range(len(own)):
            uncertainty = None if own.uncertainty is None else tuple(own.uncertainty[i].tolist())
            balls = groups.setdefault((design.probe_names[own.probe[i]], uncertainty), {})
            ball = int(own.ball[i]) - first
            balls[ball] = balls.get(ball, 0) + int(own.repeats[i])
        same: dict[tuple[tuple[float, ...] | None, int, tuple[int, ...]], list[str]] = {}
        for (probe, uncertainty), balls in groups.items():
            for repeats in sorted(set(balls.values())):
                read_so = tuple(sorted(ball for ball, count in balls.items() if count == repeats))
                same.setdefault((uncertainty, repeats, read_so), []).append(probe)
        readings = []
        for (uncertainty, repeats, read_so), probes in same.items():
            names = tuple(layout.names[ball] for ball in read_so)
            stated = None if uncertainty is None else np.array(uncertainty)
            readings.append(ReadingGroup(tuple(probes), names, np.array(read_so), repeats, stated))
        settings = candidate.settings
        if _amounts(readings) != _amounts(item.readings):
            settings = _with_readings(settings, readings)
        result[k] = replace(candidate, item=replace(item, readings=tuple(readings)), settings=settings)
    return result


def _amounts(readings: Sequence[ReadingGroup]) -> dict[tuple[str, str], int]:
    """How often each ball is read with each probe."""
    found: dict[tuple[str, str], int] = {}
    for group in readings:
        for pair in product(group.probes, group.balls):
            found[pair] = found.get(pair, 0) + group.repeats
    return found


def _with_readings(settings: Mapping[str, Any], readings: Sequence[ReadingGroup]) -> dict[str, Any]:
    """What a file says of a position, with these readings."""
    said = {key: value for key, value in settings.items() if key not in GROUP}
    common = {"standard_uncertainty": settings["standard_uncertainty"]} if "standard_uncertainty" in settings else {}
    groups = [{"probes": list(one.probes), "balls": list(one.balls), "repeats": one.repeats} for one in readings]
    return {**said, "readings": [group | common for group in groups]}
