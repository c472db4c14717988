"""What a case of a sweep costs, and the choice of one that is planned."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from ballplate.extensions.planning import HOUR, Budget, Campaign, Request, Spent
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import ball_coordinates

from .model import Sweep
from .store_columns import unit_suffix


def request_of(sweep: Sweep, number: int) -> Request | None:
    """Return the request for the plan of a case; None of a sweep whose cases are not planned."""
    if sweep.planning is None:
        return None
    chosen = (choice.limit for choice in sweep.choices(number))
    limits: dict[str, Any] = dict([*sweep.planning.limits, *filter(None, chosen)])
    budget = Budget(**limits) if limits else None
    return Request(sweep.planning.criterion, budget, seed=sweep.planning.seed)


def cost_figures(spent: Spent) -> dict[str, float]:
    """Return the cost of a case by the names of its columns."""
    return {
        "positions": float(spent.positions),
        "readings": float(spent.readings),
        "hours": spent.seconds / HOUR,
    }


def choice_figures(planned: Campaign) -> dict[str, float]:
    """Return the cost of a plan, its criterion and the bound, by the names of their columns."""
    unit = unit_suffix(planned.unit)
    found = {f"bound_{unit}": planned.bound, f"criterion_{unit}": planned.value}
    return cost_figures(planned.spent) | found


def drawing(experiment: Experiment, names: Mapping[str, str]) -> str:
    """Return what a drawing of a design needs, as JSON: the `volume` and, by their names, the outer
    balls of the `positions`, in metres; `names` are those that replace short ones.
    """
    volume = experiment.machine.volume
    ends = np.stack([volume.lower, volume.upper], axis=1)
    places = [[names.get(name, name), corners] for name, corners in _corners(experiment)]
    return json.dumps({"volume": ends.tolist(), "positions": places})


def _corners(experiment: Experiment) -> Iterator[tuple[str, list[list[float]]]]:
    """Yield the outer balls of each position, in turn around the plate."""
    for position in experiment.positions:
        layout = experiment.layouts[position.artefact]
        chosen = list(layout.corner_set or range(len(layout.names)))
        x, y = (layout.coordinates[chosen] - layout.coordinates[chosen].mean(axis=0)).T[:2]
        order = np.argsort(np.arctan2(y, x), kind="stable")
        balls = ball_coordinates(position.pose, layout)[chosen][order]
        yield position.name, np.round(balls, 6).tolist()
