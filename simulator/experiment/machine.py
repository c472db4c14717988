"""From the settings of the machine and of its evaluation to volume, repeatability and points."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..quantities import format_length
from ..settings import hint
from .checks import check_points
from .messages import ExperimentError, Steps
from .model import Evaluation, Floats, Machine, Volume
from .problems import Problems
from .references import References, frozen
from .sections import MOST_POINTS, MachineSettings, PointsSettings
from .structure import Sections
from .tables import read_table

AXES = ("x", "y", "z")


def resolve_machine(settings: MachineSettings, problems: Problems) -> Machine | None:
    """Return the machine, or None after saying what is wrong."""
    ends: dict[str, tuple[float, float]]
    if isinstance(settings.volume, tuple):
        ends = {axis: (0.0, edge) for axis, edge in zip(AXES, settings.volume, strict=False)}
    else:
        volume = settings.volume
        ends = {axis: getattr(volume, axis) for axis in AXES if getattr(volume, axis) is not None}
    is_right = True
    for axis, (lower, upper) in ends.items():
        if upper <= lower:
            text = (
                f"ends at {format_length(upper)}, not above its beginning, {format_length(lower)}; "
                "exchange or correct them"
            )
            problems.add(("machine", "volume", axis), text)
            is_right = False
    steps: Steps = ("machine", "repeatability")
    by_axis: dict[str, float]
    if isinstance(settings.repeatability, float):
        by_axis = dict.fromkeys(ends, settings.repeatability)
    elif isinstance(settings.repeatability, tuple):
        by_axis = dict(zip(AXES, settings.repeatability, strict=False))
    else:
        listed = settings.repeatability
        by_axis = {axis: getattr(listed, axis) for axis in AXES if getattr(listed, axis) is not None}
    if by_axis.keys() != ends.keys():
        text = f"has {len(by_axis)} axes, but machine.volume has {len(ends)}; give one length for all, or {len(ends)}"
        problems.add(steps, text)
        is_right = False
    if not is_right:
        return None
    lower_corner, upper_corner = zip(*ends.values(), strict=True)
    return Machine(Volume(frozen(lower_corner), frozen(upper_corner)), frozen(list(by_axis.values())))


def resolve_evaluation(sections: Sections, machine: Machine | None, references: References) -> Evaluation | None:
    """Return where to evaluate, or None after saying what is wrong."""
    settings = sections.get("evaluation")
    probe = references.probes[0] if references.probes else ""
    if settings is None:
        return Evaluation(frozen(np.zeros((0, references.dimension or 0))), probe)
    if settings.probe is not None:
        probe = settings.probe
        text = f'unknown probe "{probe}"; {hint(probe, references.probes)}'
        references.require(probe in references.probes, ("evaluation", "probe"), text)
    points = _points(settings.points, machine, references)
    return None if points is None else Evaluation(frozen(points), probe)


def _points(settings: Any, machine: Machine | None, references: References) -> Floats | None:
    problems, dimension, steps = references.problems, references.dimension, ("evaluation", "points")
    if dimension is None:
        return None
    if isinstance(settings, PointsSettings):
        if (settings.random is None) == (settings.file is None):
            problems.add(steps, 'needs either "random" or "file"; write for example {random: 200, seed: 1}')
            return None
        if settings.file is not None:
            if settings.seed is not None:
                problems.add((*steps, "seed"), 'has no meaning with "file"; remove it', of_key=True)
            return _points_of_file(settings.file, (*steps, "file"), machine, references)
        if machine is None or settings.random is None:
            return None
        volume, seed = machine.volume, 1 if settings.seed is None else settings.seed
        size = (settings.random, dimension)
        return np.random.default_rng(seed).uniform(volume.lower, volume.upper, size)
    is_right = True
    for i, point in enumerate(settings):
        text = f"has {len(point)} co-ordinates, but the experiment has {dimension} dimensions; give {dimension}"
        is_right &= references.require(len(point) == dimension, (*steps, i), text)
    if not is_right:
        return None
    points = np.array(settings)
    if machine is not None and machine.dimension == dimension:
        check_points(points, steps, machine.volume, problems)
    return points


def _points_of_file(file: str, steps: Steps, machine: Machine | None, references: References) -> Floats | None:
    assert references.dimension is not None
    try:
        rows = read_table(references.folder / file, [], AXES[: references.dimension])
    except ExperimentError as error:
        references.problems.take(error, steps)
        return None
    text = f"{len(rows)} points are too many; at most {MOST_POINTS} are possible"
    if not references.require(len(rows) <= MOST_POINTS, steps, text):
        return None
    points = np.array([row.lengths for row in rows])
    if machine is not None and machine.dimension == references.dimension:
        marks = [row.mark for row in rows]
        check_points(points, steps, machine.volume, references.problems, marks)
    return points
