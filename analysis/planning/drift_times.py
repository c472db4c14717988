"""Times of a plan's readings, on which drifts depend."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ballplate.simulator.design.influences.drift import (
    DriftPositionSettings,
    DriftSettings,
    DriftTimesSettings,
)
from ballplate.simulator.experiment.model import ChangeTimes, Experiment
from ballplate.simulator.experiment.pool import with_chosen
from ballplate.simulator.inputs.quantities import format_duration

from .schedule import RunSheet
from .short_names import with_names


def without_drift(experiment: Experiment) -> Experiment:
    """The experiment without what depends on the order of readings."""
    steady = tuple(influence for influence in experiment.influences if not influence.in_order)
    return replace(experiment, influences=steady)


def in_time(
    experiment: Experiment,
    sheet: RunSheet,
    changes: ChangeTimes,
    names: Mapping[str, str] | None = None,
) -> Experiment:
    """An experiment of the positions of a run sheet in their order, whose drifts have the times of
    that; `names` are the short names of positions.
    """
    chosen = with_chosen(with_names(experiment, names or {}), sheet.written)
    placed = {position.name for position in chosen.positions}
    positions = {
        step.name: DriftPositionSettings.model_construct(
            start=sheet.first_readings[step.name], reading=step.candidate.reading_seconds
        )
        for step in sheet.steps
        if step.name in placed and not step.done
    }
    times = DriftTimesSettings.model_construct(probe_change=changes.probe)
    timed = tuple(
        influence.model_copy(update={"positions": positions, "times": times})
        if isinstance(influence, DriftSettings)
        else influence
        for influence in chosen.influences
    )
    return replace(chosen, influences=timed)


def in_order_settings(experiment: Experiment) -> dict[int, dict[str, Any]]:
    """Return an experiment file's times of its drifts, by index of the influence quantity."""
    settings_by_index = {}
    for k, influence in enumerate(experiment.influences):
        if isinstance(influence, DriftSettings):
            places = (influence.positions or {}).items()
            times = influence.times or DriftTimesSettings.model_construct()
            settings_by_index[k] = {
                "times": {"probe_change": format_duration(times.probe_change)},
                "positions": {
                    name: {key: format_duration(value) for key, value in place.stated.items()}
                    for name, place in places
                },
            }
    return settings_by_index
