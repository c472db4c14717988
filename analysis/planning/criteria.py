"""What a plan makes small: uncertainties that do not depend on the frame.

Every criterion is a standard uncertainty, or a mean or a largest of some, and falls with the root of the information:
all of it fourfold makes it half. The reciprocal of its square is then a concave function of the information, so that
a tangent bounds what any selection can reach. A largest value is no smooth function; it is bounded by a weighted
mean, whose weights are on the largest ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, get_args

import numpy as np
from ballplate.simulator.estimation.observations import offset_sensitivity
from ballplate.simulator.experiment.messages import ExperimentError, Message
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.geometry.motions import without_rigid_motion
from ballplate.simulator.machines.protocol import Array, Integers

from ..tasks import task_differences, task_rows
from .information import Information
from .rows import STEP

CriterionName = Literal["U6", "U6-maximum", "U5", "U5-maximum", "tasks", "tasks-maximum", "A", "D", "E", "condition"]
NAMES: tuple[CriterionName, ...] = get_args(CriterionName)

DESCRIPTIONS: dict[str, str] = {
    "U6": "average uncertainty of distances between corrected points",
    "U6-maximum": "largest uncertainty of distances between corrected points",
    "U5": "average uncertainty of distances between balls",
    "U5-maximum": "largest uncertainty of distances between balls",
    "tasks": "average uncertainty of the measuring tasks",
    "tasks-maximum": "largest uncertainty of the measuring tasks",
    "A": "root mean square uncertainty of the machine's parameters",
    "D": "geometric mean of the semi-axes of the parameters' uncertainty ellipsoid",
    "E": "uncertainty of the least certain direction of the machine's parameters",
    "condition": "ratio of the uncertainties of the least and the most certain direction of the parameters",
}

# Powers that put the weight of a largest value's bound on the largest ones.
SHARP = 24

# A function counts as open when what the pool leaves open changes it by this, in micrometres for a micrometre.
OPEN = 1e-7


class Functions(Protocol):
    """Quantities whose uncertainties count, as functions of z."""

    @property
    def count(self) -> int: ...

    @property
    def lengths(self) -> Array:
        """Lengths (count,) in metres that the functions are uncertainties of."""
        ...

    def uncertainties(self, root: Array) -> Array:
        """Standard uncertainties (count,) in metres, where root root' is the covariance of z."""
        ...

    def squares(self, weights: Array) -> Array:
        """Sum (z, z) of the functions' squares with `weights` (count,)."""
        ...


@dataclass(frozen=True)
class Criterion:
    """A criterion by its `name`: the mean of `functions`, or their largest if `largest`.

    `about_balls` tells whether it concerns all z, or only those of shared parameters. `excluded` counts functions that
    the pool leaves open, whatever is chosen. `functions` are None of criteria that are about eigenvalues; these are of
    the model's parameters, `scaled` (n, z), in metres. `target` is the criterion at which the target accuracy is met on
    the average, None where there is none. `needed` holds, for each artefact whose own distances count, its name and the
    candidates that place it: without one of them the distances are undetermined, whatever certificates say of them.
    """

    name: CriterionName
    about_balls: bool
    functions: Functions | None
    scaled: Array
    excluded: int = 0
    target: float | None = None
    needed: tuple[tuple[str, tuple[int, ...]], ...] = ()

    @property
    def largest(self) -> bool:
        return self.name.endswith("-maximum")

    @property
    def unit(self) -> str:
        return "1" if self.name == "condition" else "m"

    @property
    def is_bounded(self) -> bool:
        """Whether a convex relaxation bounds it."""
        return self.name != "condition"

    def value(self, root: Array) -> float:
        """Value in metres, or a ratio, where root root' is the covariance of z."""
        if self.functions is not None:
            found = self.functions.uncertainties(root)
            return float(found.max() if self.largest else found.mean())
        sizes = np.linalg.svd(self.scaled @ root, compute_uv=False)
        if self.name == "A":
            return float(np.sqrt((sizes**2).mean()))
        if self.name == "D":
            return float(np.exp(np.log(np.maximum(sizes, np.finfo(float).tiny)).mean()))
        return float(sizes[0]) if self.name == "E" else float(sizes[0] / sizes[-1])

    @property
    def is_sharp(self) -> bool:
        """Whether it is a largest value, for which a mean of high power stands."""
        return self.largest or self.name == "E"

    def tangent(self, root: Array, power: float = SHARP) -> tuple[float, float, Array]:
        """A smooth function near the criterion; a value no larger than it; the derivative (z, z) of this by the
        covariance.

        The value is a mean with fixed weights, which is a bound for any selection: of all functions, or mostly of the
        largest. The smooth function is the mean of that `power`; its logarithm and that of the value have the same
        derivative.
        """
        if self.functions is not None:
            found = self.functions.uncertainties(root)
            relative = found / max(float(found.max()), np.finfo(float).tiny)
            weights = relative ** (power - 1) if self.largest else np.ones(len(found))
            weights /= weights.sum()
            value = float(weights @ found)
            smooth = float(found.max() * (relative**power).mean() ** (1 / power)) if self.largest else value
            # What is known without any uncertainty stays so.
            known = found > 0.0
            return (
                smooth,
                value,
                self.functions.squares(np.where(known, 0.5 * weights, 0.0) / np.where(known, found, 1.0)),
            )
        left, sizes, _ = np.linalg.svd(self.scaled @ root, full_matrices=False)
        n, value = len(sizes), self.value(root)
        if self.name == "A":
            return value, value, self.scaled.T @ self.scaled / (2 * n * value)
        if self.name == "D":
            half = (left / sizes).T @ self.scaled
            return value, value, value / (2 * n) * half.T @ half
        relative = sizes / sizes[0]
        weights = relative**power / (relative**power).sum()
        value = float(np.sqrt(weights @ sizes**2))
        smooth = float(sizes[0] * (relative ** (power + 2)).mean() ** (1 / (power + 2)))
        half = (left * np.sqrt(weights)).T @ self.scaled
        return smooth, value, half.T @ half / (2 * value)


@dataclass(frozen=True)
class Linear:
    """Functions with rows (count, z), in metres, of `lengths` (count,)."""

    rows: Array
    lengths: Array

    @property
    def count(self) -> int:
        return len(self.rows)

    def uncertainties(self, root: Array) -> Array:
        return np.asarray(np.sqrt(((self.rows @ root) ** 2).sum(axis=1)))

    def squares(self, weights: Array) -> Array:
        return np.asarray((self.rows * weights[:, None]).T @ self.rows)


@dataclass(frozen=True)
class Pairs:
    """Distances between all pairs of places, or those `chosen` (pairs,) of them.

    `places` (n, d) in metres; `displacement` (n, d, z) of them. Pairs are in the order of `numpy.triu_indices`.
    """

    places: Array
    displacement: Array
    chosen: Integers

    @property
    def count(self) -> int:
        return len(self.chosen)

    @cached_property
    def _weights(self) -> tuple[tuple[int, int, Array], ...]:
        """Products (n, n) of the components i and j of all directions, those of i < j twice."""
        n, d = self.places.shape
        apart = self.places[:, None] - self.places[None]
        length = np.sqrt((apart**2).sum(axis=2))
        apart /= np.where(length > 0, length, 1.0)[:, :, None]
        return tuple(
            (i, j, (1.0 if i == j else 2.0) * apart[:, :, i] * apart[:, :, j]) for i in range(d) for j in range(i, d)
        )

    @cached_property
    def _flat(self) -> Integers:
        n = len(self.places)
        first, second = np.triu_indices(n, 1)
        return (first * n + second)[self.chosen]

    @cached_property
    def lengths(self) -> Array:
        apart = self.places[:, None] - self.places[None]
        return np.asarray(np.sqrt((apart**2).sum(axis=2)).ravel()[self._flat])

    def uncertainties(self, root: Array) -> Array:
        n, d = self.places.shape
        spread = (self.displacement.reshape(n * d, -1) @ root).reshape(n, d, -1)
        total = np.zeros((n, n))
        for i, j, weight in self._weights:
            product = spread[:, i] @ spread[:, j].T
            own = np.diagonal(product)
            apart = own[:, None] + own[None] - product
            apart -= product.T
            apart *= weight
            total += apart
        return np.asarray(np.sqrt(np.maximum(total.ravel()[self._flat], 0.0)))

    def squares(self, weights: Array) -> Array:
        n = len(self.places)
        total = np.zeros((self.displacement.shape[2],) * 2)
        each = np.zeros((n, n))
        each.ravel()[self._flat] = weights
        for i, j, weight in self._weights:
            amount = each * weight
            amount += amount.T
            between = np.diag(amount.sum(axis=1)) - amount
            part = self.displacement[:, i].T @ (between @ self.displacement[:, j])
            total += part if i == j else 0.5 * (part + part.T)
        return total


@dataclass(frozen=True)
class Several:
    """Functions of several kinds, one after the other."""

    parts: tuple[Functions, ...]

    @property
    def count(self) -> int:
        return sum(part.count for part in self.parts)

    @property
    def lengths(self) -> Array:
        return np.concatenate([part.lengths for part in self.parts])

    def uncertainties(self, root: Array) -> Array:
        return np.concatenate([part.uncertainties(root) for part in self.parts])

    def squares(self, weights: Array) -> Array:
        ends = np.cumsum([part.count for part in self.parts])[:-1]
        each = zip(self.parts, np.split(weights, ends), strict=True)
        return np.asarray(sum(part.squares(own) for part, own in each))


def is_about_balls(name: CriterionName) -> bool:
    """Whether a criterion needs all balls, and not only what they tell of the machine."""
    return name.startswith("U5")


def criterion(information: Information, experiment: Experiment, name: CriterionName) -> Criterion:
    """A criterion for a pool.

    :raises ExperimentError: it is about something that the experiment does not have, or that no selection determines.
    """
    drawn, basis = information.drawn, information.basis
    scale = drawn.scale
    model = slice(0, len(drawn.design.model.parameters))
    scaled = np.zeros((0, information.basis.size))
    functions: Functions | None = None
    about_balls, excluded = is_about_balls(name), 0
    needed: list[tuple[str, tuple[int, ...]]] = []
    kind = name.partition("-")[0]
    if kind == "U6":
        displacement, touched = _of_points(information)
        functions, excluded = _pairs(drawn.design.points, displacement, touched)
    elif kind == "U5":
        parts = []
        for artefact in np.flatnonzero(drawn.design.is_plate):
            plate = drawn.design.artefact_names[artefact]
            placing = information.placing(plate)
            if not placing:
                continue
            needed.append((plate, placing))
            own = np.flatnonzero(drawn.design.ball_artefact == artefact)
            n, d = drawn.design.balls[own].shape
            amounts = basis.balls[own].reshape(n * d, -1)
            displacement = STEP * basis.rows(amounts, np.zeros((n * d, drawn.shared))).reshape(n, d, -1)
            open_ = np.concatenate([basis.ball_open, -basis.ball_shared @ information.open_], axis=1)
            part, left = _pairs(drawn.design.balls[own], displacement, STEP * (amounts @ open_).reshape(n, d, -1))
            parts.append(part)
            excluded += left
        functions = Several(tuple(parts))
    elif kind == "tasks":
        rows = task_rows(drawn.design, drawn.layout, drawn.state)[:, drawn.own]
        rows = np.concatenate([rows, np.zeros((len(rows), drawn.certificates))], axis=1) * scale
        kept = np.abs(rows @ information.open_).max(axis=1, initial=0.0) <= OPEN * STEP
        lengths = np.linalg.norm(task_differences(drawn.design, drawn.state), axis=1)
        functions = Linear(_of_shared(information, rows[kept]), lengths[kept])
        excluded = int((~kept).sum())
    else:
        units = np.eye(drawn.shared)[model]
        kept = np.abs(information.open_[model]).max(axis=1, initial=0.0) <= OPEN
        if not kept.all():
            raise _impossible(experiment, f"{name} takes in parameters that even all candidates leave undetermined")
        scaled = _of_shared(information, STEP * units)
    if functions is not None and not functions.count:
        raise _impossible(experiment, f"{name} has nothing to make small: " + _nothing(kind, excluded))
    target = _target(experiment, name, functions)
    return Criterion(name, about_balls, functions, scaled, excluded, target, tuple(needed))


def _target(experiment: Experiment, name: str, functions: Functions | None) -> float | None:
    """The target accuracy of the functions: its mean for an average, for a largest value only where it is constant."""
    target = experiment.target_accuracy
    if functions is None or target is None:
        return None
    if name.endswith("-maximum"):
        return target.standard.constant if target.standard.slope == 0 else None
    return float(target.at(functions.lengths).mean())


def _of_shared(information: Information, rows: Array) -> Array:
    """Rows (m, z) of the shared part of z from rows (m, c) of shared columns."""
    return np.asarray(rows @ information.basis.shared_root)


def _of_points(information: Information) -> tuple[Array, Array]:
    """Displacements of corrected evaluation points (n, d, z), and those that the pool leaves open, in metres."""
    drawn = information.drawn
    design = drawn.design
    n, d = design.points.shape
    offsets = np.broadcast_to(design.probes[design.point_probe], design.points.shape)
    rows = np.zeros((n, d, drawn.shared))
    rows[:, :, : len(design.model.parameters)] = design.model.jacobian(design.points, drawn.state.a, offsets)
    columns = drawn.layout.offset_columns[design.point_probe]
    if (columns >= 0).any():
        by_offset = offset_sensitivity(design.model, design.points, drawn.state.a, offsets)
        rows[:, :, columns[columns >= 0] - drawn.own.start] = by_offset[:, :, columns >= 0]
    rows *= drawn.scale
    displacement = _of_shared(information, rows.reshape(n * d, -1)).reshape(n, d, -1)
    return displacement, (rows.reshape(n * d, -1) @ information.open_).reshape(n, d, -1)


def _pairs(places: Array, displacement: Array, open_: Array) -> tuple[Pairs, int]:
    """All pairs of places that are apart and determined, and the number of those that are not."""
    first, second = np.triu_indices(len(places), 1)
    apart = places[first] - places[second]
    length = np.sqrt((apart**2).sum(axis=1))
    used = length > 0
    moved = without_rigid_motion(places, open_)
    change = np.einsum("md,mdk->mk", apart, moved[first] - moved[second])
    touched = used & (np.abs(change).max(axis=1, initial=0.0) > OPEN * STEP * np.where(used, length, 1.0))
    # Without the motion of all places together, no digits are lost where distances are formed.
    return Pairs(places, without_rigid_motion(places, displacement), np.flatnonzero(used & ~touched)), int(
        touched.sum()
    )


def _impossible(experiment: Experiment, text: str) -> ExperimentError:
    return ExperimentError([Message(str(experiment.source), 0, 0, "pool", text)])


def _nothing(kind: str, excluded: int) -> str:
    if excluded:
        return "no selection determines any of it; offer other candidates"
    what = {"U6": "two evaluation points", "U5": "plates of two balls", "tasks": "evaluation.tasks"}[kind]
    return f"the experiment has no {what}"
