"""Experiments that consist of a choice from a pool."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from .model import Candidate, Experiment, Position


def with_chosen(experiment: Experiment, chosen: Sequence[Candidate]) -> Experiment:
    """The experiment with chosen candidates, in their order, as its positions, and as further
    calibration.
    """
    items = [candidate.item for candidate in chosen]
    positions = tuple(item for item in items if isinstance(item, Position))
    calibration = tuple(item for item in items if not isinstance(item, Position))
    return placed_only(
        replace(
            experiment, positions=positions, calibration=(*experiment.calibration, *calibration)
        )
    )


def placed_only(experiment: Experiment) -> Experiment:
    """The experiment without its pool, artefacts that no position places and priors about other
    positions.
    """
    placed = {position.artefact for position in experiment.positions}
    names = {position.name for position in experiment.positions}
    return replace(
        experiment,
        artefacts={name: one for name, one in experiment.artefacts.items() if name in placed},
        layouts={name: one for name, one in experiment.layouts.items() if name in placed},
        calibration=tuple(
            one for one in experiment.calibration if not one.artefact or one.artefact in placed
        ),
        priors=tuple(
            one for one in experiment.priors if one.position is None or one.position in names
        ),
        pool=None,
    )
