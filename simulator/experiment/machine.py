"""Volume and repeatability of the machine, noise of its readings, and where it is evaluated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from ballplate.simulator.design.objects import Machine, Noise, NoiseSettings, Volume
from ballplate.simulator.geometry.ball_layouts import frozen
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.messages import ExperimentError, Steps
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.problems import Problems
from ballplate.simulator.inputs.quantities import LengthFunction, Target
from ballplate.simulator.inputs.units import format_length, typed_length

from .bounds import TOLERANCE, check_points
from .model import Evaluation, Probe, Task
from .references import References
from .sections import MOST_POINTS, MachineSettings, PointsSettings, TaskSettings
from .validation import Sections


def check_ends(ends: Mapping[str, tuple[float, float]], steps: Steps, problems: Problems) -> bool:
    """True if each axis of a volume ends above its beginning; others are reported."""
    wrong = {axis: (low, high) for axis, (low, high) in ends.items() if high <= low}
    for axis, (low, high) in wrong.items():
        text = f"ends at {format_length(high)}, not above its beginning, {format_length(low)}"
        problems.add((*steps, axis), f"{text}; exchange or correct them")
    return not wrong


# A repeatability (m) that is rather a slip of the unit.
LARGE_REPEATABILITY = 1e-4


def resolve_machine(settings: MachineSettings, problems: Problems) -> Machine | None:
    """Return the machine, or None after reporting faults."""
    ends: dict[str, tuple[float, float]]
    if isinstance(settings.volume, tuple):
        ends = {axis: (0.0, edge) for axis, edge in zip(AXIS_NAMES, settings.volume, strict=False)}
    else:
        ends = settings.volume.stated
    is_right = check_ends(ends, ("machine", "volume"), problems)
    steps = ("machine", "repeatability")
    by_axis: dict[str, float]
    if isinstance(settings.repeatability, float):
        by_axis = dict.fromkeys(ends, settings.repeatability)
    elif isinstance(settings.repeatability, tuple):
        by_axis = dict(zip(AXIS_NAMES, settings.repeatability, strict=False))
    else:
        by_axis = settings.repeatability.stated
    if by_axis.keys() != ends.keys():
        text = (
            f"has {len(by_axis)} axes, but machine.volume has {len(ends)}; give one length for all,"
            f" or {len(ends)}"
        )
        problems.add(steps, text)
        is_right = False
    if not is_right:
        return None
    largest = max(by_axis.values())
    if largest >= LARGE_REPEATABILITY:
        text = (
            f"{format_length(largest)} is far above the repeatability of a co-ordinate measuring"
            f" machine; write {typed_length(largest / 1000)} if that is meant"
        )
        problems.doubt(steps, text)
    lower_corner, upper_corner = zip(*ends.values(), strict=True)
    return Machine(
        Volume(frozen(lower_corner), frozen(upper_corner)), frozen(list(by_axis.values()))
    )


def resolve_noise(settings: str | NoiseSettings | None, problems: Problems) -> Noise:
    """Return the distribution of noise after reporting faults."""
    if settings is None:
        return Noise()
    if isinstance(settings, str):
        settings = NoiseSettings.model_validate({"distribution": settings})
    freedom, steps = settings.degrees_of_freedom, ("noise",)
    if settings.distribution == "student t" and freedom is None:
        text = "student t has no degrees of freedom; write {distribution: student t, degrees_of_"
        problems.add(steps, text + "freedom: 5}")
    elif settings.distribution != "student t" and freedom is not None:
        text = (
            f"{settings.distribution} noise has no degrees of freedom; remove the key, or write"
            " student t"
        )
        problems.add((*steps, "degrees_of_freedom"), text)
    if settings.correlation:
        text = (
            "applies to simulated readings only: U1 to U6 assume independent noise in all"
            " readings; determine uncertainties with it by Monte Carlo (run --trials)"
        )
        problems.doubt((*steps, "correlation"), text)
    return Noise(settings.distribution, freedom or np.inf, settings.correlation)


def resolve_evaluation(
    sections: Sections,
    machine: Machine | None,
    probes: Mapping[str, Probe],
    references: References,
) -> Evaluation | None:
    """Return where to evaluate, or None after reporting faults."""
    settings = sections.evaluation
    probe = references.probes[0] if references.probes else ""
    nowhere = np.zeros((0, references.dimension or 0))
    if settings is None:
        return Evaluation(nowhere, probe)
    if settings.probe is not None:
        probe = settings.probe
        references.is_probe(probe, ("evaluation", "probe"))
    if settings.points is None and settings.tasks is None:
        text = (
            'has neither points nor tasks; add "points", such as {random: 200, seed: 1}, or "tasks"'
        )
        references.problems.add(("evaluation",), text)
        return None
    tasks = [
        _task(i, settings.tasks or (), probe, machine, probes, sections, references)
        for i in range(len(settings.tasks or ()))
    ]
    points = nowhere if settings.points is None else _points(settings.points, machine, references)
    resolved = tuple(task for task in tasks if task is not None)
    return (
        None
        if points is None or len(resolved) < len(tasks)
        else Evaluation(frozen(points), probe, resolved)
    )


def _task(
    i: int,
    tasks: Sequence[TaskSettings],
    probe: str,
    machine: Machine | None,
    probes: Mapping[str, Probe],
    sections: Sections,
    references: References,
) -> Task | None:
    """Return a task, or None after reporting faults."""
    steps = ("evaluation", "tasks", i)
    problems, dimension = references.problems, references.dimension
    before = len(problems.messages)
    settings, names = tasks[i], [task.name for task in tasks]
    if settings.name in names[:i]:
        text = (
            f'"{settings.name}" is the name of tasks[{names.index(settings.name)}] already; names'
            " must differ"
        )
        problems.add((*steps, "name"), text)
    if settings.probe is not None and settings.probes is not None:
        problems.add(
            (*steps, "probe"),
            'cannot be combined with "probes"; give only one of the two',
            of_key=True,
        )
    used = settings.probes or (settings.probe or probe,) * 2
    if settings.probe is not None or settings.probes is not None:
        for k, name in enumerate(used):
            where = ("probe",) if settings.probes is None else ("probes", k)
            references.is_probe(name, (*steps, *where))
    for key, point in (("from", settings.start), ("to", settings.to)):
        is_right = references.has_dimension(point, (*steps, key))
        if is_right and machine is not None and machine.dimension == len(point):
            check_points(np.array([point]), (*steps, key), machine.volume, problems, of_one=True)
    if len(problems.messages) > before or dimension is None or not set(used) <= set(probes):
        return None
    points = np.array([settings.start, settings.to])
    ends = points + [probes[name].offset for name in used]
    if np.linalg.norm(np.diff(ends, axis=0)) <= TOLERANCE:
        problems.add((*steps, "to"), "coincides with the start of the length; give two points")
        return None
    return Task(
        settings.name, frozen(points), used, target_of(sections, settings.target_uncertainty)
    )


def target_of(sections: Sections, own_target: LengthFunction | None = None) -> Target | None:
    """Return the target of uncertainties, a task's `own_target` or else the file's, with the
    coverage factor of what is compared with it.
    """
    target = own_target or sections.target_uncertainty
    return None if target is None else Target(target, sections.coverage_factor)


def _points(settings: Any, machine: Machine | None, references: References) -> Array | None:
    problems, dimension, steps = references.problems, references.dimension, ("evaluation", "points")
    if dimension is None:
        return None
    if isinstance(settings, PointsSettings):
        if (settings.random is None) == (settings.file is None):
            problems.add(
                steps, 'needs either "random" or "file"; write for example {random: 200, seed: 1}'
            )
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
    if not all([references.has_dimension(entry, (*steps, i)) for i, entry in enumerate(settings)]):
        return None
    points = np.array(settings)
    if machine is not None and machine.dimension == dimension:
        check_points(points, steps, machine.volume, problems)
    return points


def _points_of_file(
    file: str, steps: Steps, machine: Machine | None, references: References
) -> Array | None:
    from ballplate.simulator.inputs.tables import read_table

    assert references.dimension is not None
    try:
        rows = read_table(references.file(file), [], AXIS_NAMES[: references.dimension])
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
