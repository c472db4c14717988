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
    """Return the experiment without its pool, artefacts without a position and priors about other
    positions.
    """
    placed = {position.artefact for position in experiment.positions}
    names = {position.name for position in experiment.positions}
    return replace(
        experiment,
        artefacts={name: prior for name, prior in experiment.artefacts.items() if name in placed},
        layouts={name: prior for name, prior in experiment.layouts.items() if name in placed},
        calibration=tuple(
            calibration
            for calibration in experiment.calibration
            if not calibration.artefact or calibration.artefact in placed
        ),
        priors=tuple(
            prior
            for prior in experiment.priors
            if prior.position is None or prior.position in names
        ),
        pool=None,
    )
