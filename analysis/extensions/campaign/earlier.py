"""Identification of a design that was chosen earlier from the same pool."""

from __future__ import annotations

from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np
from ballplate.simulator.design import Calibration, CovarianceRoot
from ballplate.simulator.experiment import Experiment, Position, load
from ballplate.simulator.inputs import ExperimentError, GivenText, Message, hint, refused

from ..planning import Offer, names_of_plan, offer
from .positions_read import done_candidates


def earlier_choice(chosen: Experiment, offered: Offer) -> tuple[int, ...]:
    """Return indices of the candidates in an experiment: positions by name, or by description of a
    short name; calibration items by content.

    An interrupted position counts as its completion or second set-up, unless its planned readings
    are complete. Calibration items outside the pool belong to the experiment in any case.

    :raises ExperimentError: a position is no candidate.
    """
    message = partial(Message, str(chosen.source), 0, 0, "positions")
    candidates = offered.candidates
    rests = {interrupted.rest for interrupted in offered.interrupted}
    places = {
        candidate.name: k
        for k, candidate in enumerate(candidates)
        if isinstance(candidate.item, Position) and k not in rests
    }
    named = {
        position.name: position.description if position.description in places else position.name
        for position in chosen.positions
        if position.name not in places
    }
    unknown = [name for name, meant in named.items() if meant not in places]
    if unknown:
        raise ExperimentError(
            message(f'"{name}" is not a candidate of the pool; {hint(name, places)}')
            for name in unknown
        )
    moved = [
        position.name
        for position in chosen.positions
        if not _same_place(
            position, candidates[places[named.get(position.name, position.name)]].item
        )
    ]
    if moved:
        remedy = "has another location or artefact in the pool; give it another name"
        raise ExperimentError(message(f'"{name}" {remedy}') for name in moved)
    starts = [
        _now(offered, places[named.get(position.name, position.name)], position)
        for position in chosen.positions
    ]
    for k, candidate in enumerate(candidates):
        item = candidate.item
        if not isinstance(item, Position) and any(
            _equal(item, calibration) for calibration in chosen.calibration
        ):
            starts.append(k)
    return tuple(sorted(set(starts)))


def _now(offered: Offer, k: int, wanted: Position) -> int:
    for interrupted in offered.interrupted:
        if interrupted.part == k and wanted.count > offered.candidates[k].readings:
            return interrupted.again if interrupted.rest is None else interrupted.rest
    return k


def _same_place(position: Position, earlier: object) -> bool:
    return (
        isinstance(earlier, Position)
        and position.artefact == earlier.artefact
        and np.allclose(position.pose.rotation, earlier.pose.rotation, atol=1e-9)
        and np.allclose(position.pose.origin, earlier.pose.origin, atol=1e-9)
    )


def _equal(calibration: Calibration, earlier: Calibration) -> bool:
    return type(calibration) is type(earlier) and all(
        np.array_equal(
            _plain(getattr(calibration, field.name)), _plain(getattr(earlier, field.name))
        )
        for field in fields(cast(Any, calibration))
    )


def _plain(value: Any) -> Any:
    """Return the content of a field: the root of a covariance, the names of a user's functions."""
    if isinstance(value, CovarianceRoot):
        return value.drawn(np.eye(len(value.own)))
    return value.names if hasattr(value, "derivatives") else value


def begun(
    experiment: Experiment,
    readings_done: Path | GivenText | None = None,
    moved: bool = False,
    earlier: Path | None = None,
) -> tuple[Offer | None, tuple[int, ...] | None]:
    """Return the candidates on offer after `readings_done`, and the indices of an `earlier` choice
    of a file; None if absent.

    If the artefact has `moved` since, an interrupted position needs a second set-up.

    :raises ExperimentError: what is wrong with both files.
    """
    if experiment.pool is None:
        return None, None
    pool, messages = experiment.pool, list[Message]()
    chosen, before, names = None, None, dict[str, str]()
    try:
        if earlier is not None:
            variants = load(earlier)
            if len(variants) > 1:
                text = "the file has several variants; name a design that was chosen"
                raise refused(earlier, text, "variants")
            before = variants[0]
            names = names_of_plan(before, {candidate.name for candidate in pool.candidates})
    except ExperimentError as error:
        messages += error.messages
    offered = offer(pool, known_names=names)
    try:
        if readings_done is not None:
            candidates_read = done_candidates(readings_done, experiment, names)
            offered = offer(pool, candidates_read, not moved, names)
    except ExperimentError as error:
        messages += error.messages
    try:
        if before is not None:
            chosen = earlier_choice(before, offered)
    except ExperimentError as error:
        messages += error.messages
    if messages:
        raise ExperimentError(messages)
    return offered, chosen
