"""Positions that have been read already, in full or in part, according to a file of readings."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from ballplate.simulator.design import Design
from ballplate.simulator.experiment import Candidate, Experiment, Position, ReadingGroup, lay_out
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import ExperimentError, GivenText, hint, length_text
from ballplate.simulator.machines import Array
from ballplate.simulator.readings import named_rows, read_readings

from ..planning import REST, SetUp, base_name, position_of, renamed, with_chosen

# What an experiment file says of the readings of a position.
GROUP = ("probes", "balls", "repeats", "standard_uncertainty", "readings")

# How a plan names positions.
SHORT = re.compile(r"[Pp][1-9][0-9]*")

# How often a ball is read with a probe, by ball and probe.
Amounts = dict[tuple[int, str], int]


def done_candidates(
    path: Path | GivenText, experiment: Experiment, names: Mapping[str, str] | None = None
) -> tuple[SetUp, ...]:
    """Return set-ups of a pool's candidates in a file of readings, in its order.

    A position may have several set-ups: "low again" is another one of the candidate "low". `names`
    are the file's names of candidates with short names in a plan.

    :raises ExperimentError: the file is wrong, or names a position that is no candidate.
    """
    assert experiment.pool is not None
    candidates = experiment.pool.candidates
    places = {c.name: k for k, c in enumerate(candidates) if isinstance(c.item, Position)}
    planned = {short: name for name, short in (names or {}).items()}
    names_by_column = {"position": tuple(places), "probe": tuple(experiment.probes)}
    settings, d = experiment.readings, experiment.dimension
    # Where decimals could be thousands, the whole is refused when it is read below.
    in_plane = any(artefact.reads == "in plane" for artefact in experiment.artefacts.values())
    empty = AXIS_NAMES[:d] if in_plane else ()
    rows = named_rows(path, names_by_column, settings, d, empty)
    messages = {}
    counts = {}
    name = ""
    for row in rows:
        name = row.texts[0]
        meant = _meant(name, planned)
        base = places.get(meant, places.get(base_name(meant)))
        if base is not None:
            counts[name] = base
        elif name not in messages:
            text = f'no position "{name}" in the file or its pool; {hint(name, places)}'
            if not planned and SHORT.fullmatch(name):
                text += "; if a plan named it, give the file of that plan with --from"
            messages[name] = row.mark.message("", text)
    if messages:
        raise ExperimentError(list(messages.values()))
    drawn = [renamed(candidates[base], own_name) for own_name, base in counts.items()]
    chosen = lay_out(with_chosen(experiment, drawn))
    design = read_readings(path, chosen, every_ball=False, settings=settings).design
    result = []
    for number, (as_read, base) in enumerate(zip(drawn, counts.values(), strict=True)):
        own_name = _meant(as_read.name, planned)
        candidate = renamed(candidates[base], own_name)
        item = position_of(candidate)
        groups = groups_taken(design, number, experiment, item)
        result.append(_set_up(experiment, candidate, base, groups, as_read.name == name))
    return tuple(result)


def _meant(name: str, planned: Mapping[str, str]) -> str:
    """Return the pool's name for a name in a file of readings."""
    if name in planned:
        return planned[name]
    base = base_name(name)
    return planned[base] + name[len(base) :] if base in planned else name


def groups_taken(
    design: Design, place: int, experiment: Experiment, item: Position
) -> tuple[ReadingGroup, ...]:
    """Return readings in a position, by its `place` in a design, in groups of equal uncertainty and
    repeats.
    """
    own_readings = design.readings.select(np.flatnonzero(design.readings.position == place))
    first = int(design.balls.of(design.artefacts.names.index(item.artefact))[0])
    probes, groups = design.probes.names, []
    names = experiment.layouts[item.artefact].names
    by_probe: dict[tuple[str, tuple[float, ...] | None], dict[int, int]] = {}
    for i in range(len(own_readings)):
        deviations = (
            None
            if own_readings.uncertainty is None
            else tuple(own_readings.uncertainty[i].tolist())
        )
        balls = by_probe.setdefault((probes[own_readings.probe[i]], deviations), {})
        ball = int(own_readings.ball[i]) - first
        balls[ball] = balls.get(ball, 0) + int(own_readings.repeats[i])
    same: dict[tuple[tuple[float, ...] | None, int, tuple[int, ...]], list[str]] = {}
    for (probe, deviations), balls in by_probe.items():
        for repeats in sorted(set(balls.values())):
            read_so = tuple(sorted(ball for ball, count in balls.items() if count == repeats))
            same.setdefault((deviations, repeats, read_so), []).append(probe)
    for (deviations, repeats, read_so), with_probes in same.items():
        uncertainty = None if deviations is None else np.array(deviations)
        if deviations == tuple(experiment.machine.repeatability.tolist()):
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
    groups_read: tuple[ReadingGroup, ...],
    is_last: bool,
) -> SetUp:
    assert experiment.pool is not None
    item = position_of(candidate)
    planned = item.readings
    missing = tuple(_missing(planned, groups_read, experiment.layouts[item.artefact].names))
    position_read = (
        candidate
        if not missing and _same(groups_read, planned)
        else _with_readings(candidate, groups_read)
    )
    if not missing:
        return SetUp(base, position_read, position_read, None, is_last)
    whole = (
        candidate
        if _same((*groups_read, *missing), planned)
        else _with_readings(candidate, (*groups_read, *missing))
    )
    remainder = _with_readings(candidate, missing)
    changes = (len(position_of(remainder).probes) - 1) * experiment.pool.changes.probe
    seconds = remainder.readings * candidate.reading_seconds + changes
    remainder = replace(remainder, name=f"{REST}{candidate.name}", seconds=seconds, drawn=False)
    return SetUp(base, position_read, whole, remainder, is_last)


def _missing(
    planned: Sequence[ReadingGroup], groups_read: Sequence[ReadingGroup], names: Sequence[str]
) -> Iterator[ReadingGroup]:
    """Yield groups of planned readings that are missing, regardless of uncertainty; equally
    incomplete balls make a group.
    """
    amounts_left = _amounts(groups_read)
    for group in planned:
        alike: dict[tuple[int, tuple[int, ...]], list[str]] = {}
        for probe in group.probes:
            by_count: dict[int, list[int]] = {}
            for ball in group.ball_indices.tolist():
                repeats_done = min(amounts_left.get((ball, probe), 0), group.repeats)
                if repeats_done:
                    amounts_left[ball, probe] -= repeats_done
                if repeats_done < group.repeats:
                    by_count.setdefault(group.repeats - repeats_done, []).append(ball)
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
    """Return the number of readings by ball and probe."""
    amounts: Amounts = {}
    for group in readings:
        for pair in product(group.ball_indices.tolist(), group.probes):
            amounts[pair] = amounts.get(pair, 0) + group.repeats
    return amounts


def _same(first: Sequence[ReadingGroup], second: Sequence[ReadingGroup]) -> bool:
    """Compare numbers of readings by ball, probe and uncertainty."""

    def by_uncertainty(groups: Sequence[ReadingGroup]) -> dict[tuple[float, ...] | None, Amounts]:
        kinds: dict[tuple[float, ...] | None, list[ReadingGroup]] = {}
        for group in groups:
            uncertainty = group.standard_uncertainty
            kinds.setdefault(
                None if uncertainty is None else tuple(uncertainty.tolist()), []
            ).append(group)
        return {uncertainty: _amounts(some) for uncertainty, some in kinds.items()}

    return by_uncertainty(first) == by_uncertainty(second)


def _with_readings(candidate: Candidate, readings: tuple[ReadingGroup, ...]) -> Candidate:
    """Return a position with these readings, and its settings for a file."""
    settings = {key: value for key, value in candidate.settings.items() if key not in GROUP}
    groups = []
    for reading in readings:
        group = {
            "probes": list(reading.probes),
            "balls": list(reading.balls),
            "repeats": reading.repeats,
        }
        if reading.standard_uncertainty is not None:
            group["standard_uncertainty"] = _exactly(reading.standard_uncertainty)
        groups.append(group)
    item = replace(position_of(candidate), readings=readings)
    return replace(candidate, item=item, settings={**settings, "readings": groups})


def _exactly(lengths: Array) -> str | list[str]:
    """Return lengths (d,) as a file states them, one for all axes if equal."""
    texts = [length_text(length) for length in lengths.tolist()]
    return texts[0] if len(set(texts)) == 1 else texts
