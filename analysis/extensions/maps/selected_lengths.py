"""Lengths that are to be corrected: between named points, and measuring tasks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from ballplate.simulator.design import Tasks
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import hint, listing, refused

from ..machine_files import FittedMap
from .point_files import GivenPoints


def between_named(points: GivenPoints, pairs: Sequence[Sequence[str | int]]) -> Tasks:
    """Return lengths between pairs of points by their names, or indices.

    :raises ValueError: a name that no point has, or several; an index of none.
    """
    return _between(points, [_ends(points, pair) for pair in pairs])


def tasks_of_experiment(fitted: FittedMap, experiment: Experiment) -> Tasks:
    """Return the measuring tasks of an experiment.

    :raises ExperimentError: there is none, of other dimensions, or with a probe that the map does
        not have.
    """
    tasks, probe_names = experiment.evaluation.tasks, fitted.probes.names
    if not tasks:
        raise refused(experiment.source, "has no measuring tasks", "evaluation.tasks")
    if experiment.dimension != fitted.dimension:
        text = f"has {experiment.dimension} axes, and the map {fitted.dimension}"
        raise refused(experiment.source, text, "machine.volume")
    absent = {name for task in tasks for name in task.probes if name not in probe_names}
    if absent:
        text = f"the map has no probe {listing(sorted(absent))}; known: {listing(probe_names)}"
        raise refused(experiment.source, text, "evaluation.tasks")
    return Tasks(
        tuple(task.name for task in tasks),
        np.array([task.points for task in tasks]),
        np.array([[probe_names.index(name) for name in task.probes] for task in tasks], np.int64),
        tuple(task.target for task in tasks),
    )


def _between(points: GivenPoints, pairs: Sequence[tuple[int, int]]) -> Tasks:
    places = np.array(pairs, np.int64).reshape(-1, 2)
    names = tuple(f"{points.name(i)} to {points.name(j)}" for i, j in pairs)
    return Tasks(names, points.points[places], points.probes[places], (None,) * len(names))


def _ends(points: GivenPoints, pair: Sequence[str | int]) -> tuple[int, int]:
    """Indices of two points by their names, or indices.

    :raises ValueError: see `between_named`.
    """
    if isinstance(pair, str) or len(pair) != 2:
        raise ValueError(f"a length between {pair!r}; give two points")
    first, second = (_end(points, end) for end in pair)
    return first, second


def _end(points: GivenPoints, end: str | int) -> int:
    if not isinstance(end, str):
        if not 0 <= end < len(points.points):
            raise ValueError(f"no point {end!r}; there are 0 to {len(points.points) - 1}")
        return int(end)
    count = points.times[end]
    if count != 1:
        fact = f"{count} points are called" if count else "no point is called"
        remedy = "names of ends must differ" if count else hint(end, points.times)
        raise ValueError(f'{fact} "{end}"; {remedy}')
    return points.places[end]
