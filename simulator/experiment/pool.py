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


def enabled_only(experiment: Experiment) -> Experiment:
    """Return the experiment without positions that are switched off and priors about them, and
    without a pool also without artefacts that are in no other position.

    :raises ExperimentError: no position is left, and there is no pool.
    """
    off = tuple(position.name for position in experiment.positions if not position.enabled)
    if not off:
        return experiment
    positions = tuple(position for position in experiment.positions if position.enabled)
    priors = tuple(prior for prior in experiment.priors if prior.position not in off)
    kept = replace(experiment, positions=positions, priors=priors, switched_off=off)
    if experiment.pool is not None:
        return kept
    if not positions:
        text = "all are switched off; remove enabled: false from at least one"
        raise experiment.refused(("positions",), text)
    return placed_only(kept)


def placed_only(experiment: Experiment) -> Experiment:
    """Return the experiment without its pool, artefacts without a position and priors about other
    positions.
    """
    placed = {position.artefact for position in experiment.positions}
    names = {position.name for position in experiment.positions}
    return replace(
        experiment,
        artefacts={name: each for name, each in experiment.artefacts.items() if name in placed},
        layouts={name: layout for name, layout in experiment.layouts.items() if name in placed},
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
