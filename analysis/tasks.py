"""Standard uncertainties of measuring tasks: lengths between two points that the corrected machine is to measure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design import Design, State
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.estimation.parameters import SharedLayout
from ballplate.simulator.machines.protocol import Array

from .corrections import corrected_points, correction_rows

# Coverage factor of expanded uncertainties.
COVERAGE = 2.0


@dataclass(frozen=True)
class TaskUncertainty:
    """A measuring task: its length, standard uncertainty and the one to be reached, in metres.

    The standard uncertainty is NaN where observations leave it open; `target` is None where nothing is to be reached,
    and otherwise compared with `coverage_factor` times the standard uncertainty.
    """

    name: str
    length: float
    standard_uncertainty: float
    target: float | None
    coverage_factor: float = 1.0

    @property
    def expanded_uncertainty(self) -> float:
        """With the coverage factor of the target, or 2 where that is 1."""
        return self.expansion * self.standard_uncertainty

    @property
    def expansion(self) -> float:
        """The coverage factor of the expanded uncertainty."""
        return expansion(self.coverage_factor)

    @property
    def is_within(self) -> bool | None:
        """Whether the uncertainty is within its target; None where there is none."""
        return None if self.target is None else self.coverage_factor * self.standard_uncertainty <= self.target


def expansion(coverage_factor: float) -> float:
    """The coverage factor of an expanded uncertainty that is shown: that of the target, or 2 where that is 1."""
    return coverage_factor if coverage_factor > 1.0 else COVERAGE


def task_differences(design: Design, state: State) -> Array:
    """Differences (t, d) of the corrected ends of all tasks, in metres."""
    d = design.dimension
    ends = corrected_points(design, state, design.task_points.reshape(-1, d), design.task_probes.ravel())
    first, second = ends.reshape(-1, 2, d).transpose(1, 0, 2)
    return np.asarray(second - first)


def task_rows(design: Design, layout: SharedLayout, state: State) -> Array:
    """Derivative (t, s) of the tasks' lengths by the shared parameters, estimated probe offsets included."""
    d = design.dimension
    apart = task_differences(design, state)
    direction = apart / np.linalg.norm(apart, axis=1)[:, None]
    rows = correction_rows(design, layout, state, design.task_points.reshape(-1, d), design.task_probes.ravel())
    first, second = rows.reshape(-1, 2, d, len(layout)).transpose(1, 0, 2, 3)
    return np.asarray(np.einsum("td,tds->ts", direction, second - first))


def task_uncertainties(at: Linearisation, sigma: float = 1.0) -> tuple[TaskUncertainty, ...]:
    """Standard uncertainties of the design's tasks, as U6 is that of all pairs of points; none without tasks.

    `sigma` multiplies all stated uncertainties.
    """
    design, layout = at.design, at.layout
    if not design.task_names:
        return ()
    lengths = np.linalg.norm(task_differences(design, at.state), axis=1)
    drawn = None if at.drawn is None else task_rows(design, layout, at.drawn.state)
    values = sigma * at.of_shared(task_rows(design, layout, at.state), drawn)
    told = zip(design.task_names, lengths.tolist(), values.tolist(), design.task_targets, strict=True)
    return tuple(
        TaskUncertainty(name, length, value, None)
        if target is None
        else TaskUncertainty(name, length, value, float(target.stated.at(length)), target.coverage_factor)
        for name, length, value, target in told
    )


def share_within(tasks: Sequence[TaskUncertainty]) -> float | None:
    """Share of the tasks with a target that are within theirs, undetermined ones counted as not; None without any."""
    judged = [task.is_within for task in tasks if task.is_within is not None]
    return sum(judged) / len(judged) if judged else None


def is_determined(task: TaskUncertainty) -> bool:
    """Whether the observations tell the task's length."""
    return not math.isnan(task.standard_uncertainty)
