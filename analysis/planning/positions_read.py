"""Positions that have been read already, in full or in part, according to a file of readings."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Candidate, Experiment, Position, ReadingGroup
from ballplate.simulator.experiment.pool import with_chosen
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.messages import ExperimentError, Message
from ballplate.simulator.inputs.quantities import length_text
from ballplate.simulator.inputs.settings import hint
from ballplate.simulator.inputs.yamltree import GivenText
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.readings.reading_files import read_readings
from ballplate.simulator.readings.reading_sources import named_rows

# What an experiment file says of the readings of a position.
GROUP = ("probes", "balls", "repeats", "standard_uncertainty", "readings")

# How what completes a position, and what sets it up again, is named.
REST = "rest of "
SHORT = re.compile(r"[Pp][1-9][0-9]*")
AGAIN = re.compile(r"(.*) again(?: ([1-9][0-9]*))?", re.DOTALL)

# How often a ball is read with a probe, by ball and probe.
Amounts = dict[tuple[int, str], int]


@dataclass(frozen=True)
class SetUp:
    """Readings of one set-up of the candidate `base` of a pool.

    `read` has the readings that were taken, `whole` those that were planned as well, and `rest`
    what is still missing, None where nothing is. `is_last` marks the set-up that was read last.
    """

    base: int
    read: Candidate
    whole: Candidate
    rest: Candidate | None
    is_last: bool

    @property
    def name(self) -> str:
        return self.read.name


def done_candidates(
    path: Path | GivenText, experiment: Experiment, names: Mapping[str, str] | None = None
) -> tuple[SetUp, ...]:
    """Set-ups of a pool's candidates that a file of readings has readings of, in its order.

    A position may have been set up more than once: "low again" is another set-up of the candidate
    "low". `names` tell what the file calls candidates that a plan gave short names.

    :raises ExperimentError: the file is wrong, or names a position that is no candidate.
    """
    assert experiment.pool is not None
    candidates = experiment.pool.candidates
    places = {c.name: k for k, c in enumerate(candidates) if isinstance(c.item, Position)}
    planned = {short: name for name, short in (names or {}).items()}
    known = {"position": tuple(places), "probe": tuple(experiment.probes)}
    settings, d = experiment.readings, experiment.dimension
    # Where decimals could be thousands, the whole is refused when it is read below.
    in_plane = any(one.reads == "in plane" for one in experiment.artefacts.values())
    empty = AXIS_NAMES[:d] if in_plane else ()
    rows = named_rows(path, known, settings, d, empty)
    messages: dict[str, Message] = {}
    found: dict[str, int] = {}
    name = ""
    for row in rows:
        name = row.texts[0]
        meant = _meant(name, planned)
        base = places.get(meant, places.get(base_name(meant)))
        if base is not None:
            found[name] = base
        elif name not in messages:
            text = f'no position "{name}" in the file or its pool; {hint(name, places)}'
            if not planned and SHORT.fullmatch(name):
                text += "; if a plan named it, give the file of that plan with --from"
            messages[name] = row.mark.message("", text)
    if messages:
        raise ExperimentError(list(messages.values()))
    drawn = [renamed(candidates[base], own) for own, base in found.items()]
    chosen = lay_out(with_chosen(experiment, drawn))
    design = read_readings(path, chosen, every_ball=False, settings=settings).design
    result = []
    for number, (as_read, base) in enumerate(zip(drawn, found.values(), strict=True)):
        own = _meant(as_read.name, planned)
        candidate = renamed(candidates[base], own)
        item = _position(candidate)
        taken = groups_taken(design, number, experiment, item)
        result.append(_set_up(experiment, candidate, base, taken, as_read.name == name))
    return tuple(result)


def _meant(name: str, planned: Mapping[str, str]) -> str:
    """The name in the pool of what a file of readings calls so."""
    if name in planned:
        return planned[name]
    base = base_name(name)
    return planned[base] + name[len(base) :] if base in planned else name


def renamed(candidate: Candidate, name: str) -> Candidate:
    """A position under another name."""
    if candidate.name == name:
        return candidate
    settings = {**candidate.settings, "name": name}
    return replace(
        candidate,
        name=name,
        item=replace(_position(candidate), name=name),
        settings=settings,
        drawn=False,
    )


def next_name(name: str, taken: Sequence[str]) -> str:
    """The name of a further set-up of a position, which nothing else has.

    >>> next_name("low", ["low"]), next_name("low", ["low", "low again"])
    ('low again', 'low again 2')
    """
    found, k = f"{name} again", 1
    while found in taken:
        k += 1
        found = f"{name} again {k}"
    return found


def base_name(name: str) -> str:
    """The name of a position that another set-up of it has, too.

    >>> base_name("low again 2"), base_name("low")
    ('low', 'low')
    """
    again = AGAIN.fullmatch(name)
    return name if again is None else again[1]


def _position(candidate: Candidate) -> Position:
    assert isinstance(candidate.item, Position)
    return candidate.item


def groups_taken(
    design: Design, place: int, experiment: Experiment, item: Position
) -> tuple[ReadingGroup, ...]:
    """Readings in a position, by its `place` in a design, as groups of those of equal uncertainty
    and repeats.
    """
    own = design.readings.select(np.flatnonzero(design.readings.position == place))
    first = int(design.balls.of(design.artefacts.names.index(item.artefact))[0])
    probes, groups = design.probes.names, []
    names = experiment.layouts[item.artefact].names
    by_probe: dict[tuple[str, tuple[float, ...] | None], dict[int, int]] = {}
    for i in range(len(own)):
        stated = None if own.uncertainty is None else tuple(own.uncertainty[i].tolist())
        balls = by_probe.setdefault((probes[own.probe[i]], stated), {})
        ball = int(own.ball[i]) - first
        balls[ball] = balls.get(ball, 0) + int(own.repeats[i])
    same: dict[tuple[tuple[float, ...] | None, int, tuple[int, ...]], list[str]] = {}
    for (probe, stated), balls in by_probe.items():
        for repeats in sorted(set(balls.values())):
            read_so = tuple(sorted(ball for ball, count in balls.items() if count == repeats))
            same.setdefault((stated, repeats, read_so), []).append(probe)
    for (stated, repeats, read_so), with_probes in same.items():
        uncertainty = None if stated is None else np.array(stated)
        if stated == tuple(experiment.machine.repeatability.tolist()):
            uncertainty = None
        groups.append(
            ReadingGroup(
                tuple(with_probes),
                tuple(names[k] for k in read_so),
                np.array(read_so),
                repeats,
                uncertainty,
            )
        )
    return tuple(groups)


def _set_up(
    experiment: Experiment,
    candidate: Candidate,
    base: int,
    taken: tuple[ReadingGroup, ...],
    is_last: bool,
) -> SetUp:
    assert experiment.pool is not None
    item = _position(candidate)
    planned = item.readings
    missing = tuple(_missing(planned, taken, experiment.layouts[item.artefact].names))
    read = candidate if not missing and _same(taken, planned) else _with_readings(candidate, taken)
    if not missing:
        return SetUp(base, read, read, None, is_last)
    whole = (
        candidate
        if _same((*taken, *missing), planned)
        else _with_readings(candidate, (*taken, *missing))
    )
    rest = _with_readings(candidate, missing)
    changes = (len(_position(rest).probes) - 1) * experiment.pool.changes.probe
    seconds = rest.readings * candidate.reading_seconds + changes
    rest = replace(rest, name=f"{REST}{candidate.name}", seconds=seconds, drawn=False)
    return SetUp(base, read, whole, rest, is_last)


def _missing(
    planned: Sequence[ReadingGroup], taken: Sequence[ReadingGroup], names: Sequence[str]
) -> Iterator[ReadingGroup]:
    """What of the planned readings has not been taken, whatever their uncertainty; balls left alike
    make a group.
    """
    left = _amounts(taken)
    for group in planned:
        alike: dict[tuple[int, tuple[int, ...]], list[str]] = {}
        for probe in group.probes:
            by_count: dict[int, list[int]] = {}
            for ball in group.ball_indices.tolist():
                done = min(left.get((ball, probe), 0), group.repeats)
                if done:
                    left[ball, probe] -= done
                if done < group.repeats:
                    by_count.setdefault(group.repeats - done, []).append(ball)
            for count, balls in by_count.items():
                alike.setdefault((count, tuple(balls)), []).append(probe)
        for (count, chosen), probes in alike.items():
            yield ReadingGroup(
                tuple(probes),
                tuple(names[k] for k in chosen),
                np.array(chosen),
                count,
                group.standard_uncertainty,
            )


def _amounts(readings: Sequence[ReadingGroup]) -> Amounts:
    """How often each ball is read with each probe."""
    found: Amounts = {}
    for group in readings:
        for pair in product(group.ball_indices.tolist(), group.probes):
            found[pair] = found.get(pair, 0) + group.repeats
    return found


def _same(one: Sequence[ReadingGroup], other: Sequence[ReadingGroup]) -> bool:
    """Whether both read the same balls as often with the same probes and uncertainties."""

    def by_uncertainty(groups: Sequence[ReadingGroup]) -> dict[tuple[float, ...] | None, Amounts]:
        kinds: dict[tuple[float, ...] | None, list[ReadingGroup]] = {}
        for group in groups:
            stated = group.standard_uncertainty
            kinds.setdefault(None if stated is None else tuple(stated.tolist()), []).append(group)
        return {stated: _amounts(some) for stated, some in kinds.items()}

    return by_uncertainty(one) == by_uncertainty(other)


def _with_readings(candidate: Candidate, readings: tuple[ReadingGroup, ...]) -> Candidate:
    """A position with these readings, and what a file says of it."""
    said = {key: value for key, value in candidate.settings.items() if key not in GROUP}
    groups = []
    for one in readings:
        group: dict[str, Any] = {
            "probes": list(one.probes),
            "balls": list(one.balls),
            "repeats": one.repeats,
        }
        if one.standard_uncertainty is not None:
            group["standard_uncertainty"] = _exactly(one.standard_uncertainty)
        groups.append(group)
    item = replace(_position(candidate), readings=readings)
    return replace(candidate, item=item, settings={**said, "readings": groups})


def _exactly(lengths: Array) -> str | list[str]:
    """Lengths (d,) as a file says them, one for all axes where they are the same."""
    texts = [length_text(length) for length in lengths.tolist()]
    return texts[0] if len(set(texts)) == 1 else texts
