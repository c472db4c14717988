"""Estimates of a fit as functions of its parameters: names, values, uncertainties and
covariances.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.estimation.corrections import corrected_points, correction_rows
from ballplate.simulator.estimation.functions import linear_functions
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.geometry.motions import (
    AXIS_NAMES,
    pose_parameter_names,
    vector_from_rotation,
)
from ballplate.simulator.inputs.arguments import ensure_type
from ballplate.simulator.inputs.settings import hint, number_of
from ballplate.simulator.machines.protocol import Array, Integers, Unit

from ..uncertainty.kernel_quantities import task_distances

ParameterKind = Literal["machine", "origin", "rotation", "offset", "length", "influence", "ball"]
FunctionKind = Literal[ParameterKind, "task"]

# What may be asked for in place of a kind of its own.
KINDS: dict[str, tuple[FunctionKind, ...]] = {
    "pose": ("origin", "rotation"),
    **{kind: (kind,) for kind in (*get_args(ParameterKind), "task")},
}


@dataclass(frozen=True)
class ParameterEstimate:
    """One estimated parameter; the standard uncertainty is NaN, and so the value, where it is
    undetermined.

    `kind` says what it is of: the machine, origin or rotation of a pose, a probe's offset, a
    standard's length, an influence quantity, a ball.
    """

    name: str
    value: float
    standard_uncertainty: float
    unit: Unit
    kind: ParameterKind = "machine"


@dataclass(frozen=True)
class Function:
    """What a row of `EstimatedFunctions` is: its name, its kind and its unit."""

    name: str
    kind: FunctionKind
    unit: Unit


@dataclass(frozen=True, eq=False)
class EstimatedFunctions:
    """Functions (m,) of the parameters at a fit, with their `values` (m,) there.

    `rows` (m, s) are their derivatives by the shared parameters, `drawn` (m, s) the same at the
    design as drawn; those of a co-ordinate of a ball are zero, of which `ball` and `axis` (m,) are
    the indices, -1 for all others.
    """

    at: Linearisation
    functions: tuple[Function, ...]
    values: Array
    rows: Array
    drawn: Array
    ball: Integers
    axis: Integers

    @property
    def labels(self) -> list[str]:
        """Names, with the kind in front where a model or a file gives the same name to two."""
        return labels(self.functions)

    def uncertainties(self) -> Array:
        """Standard deviations (m,) in units of that of a unit-weight observation; NaN where
        undetermined.
        """
        result = self.at.of_shared(self.rows, self.drawn)
        of_balls = self.ball >= 0
        if of_balls.any():
            result[of_balls] = self.at.of_balls()[self.ball[of_balls], self.axis[of_balls]]
        return result

    def choose(self, asked: Sequence[str]) -> EstimatedFunctions:
        """Those of some kinds, or with some names, in the order asked for; all where nothing is
        asked for.

        :raises ValueError: there is no such kind and no such name.
        """
        found: dict[int, None] = {}
        names = self.labels
        for k, words in enumerate(asked):
            ensure_type(
                str, "the name of an estimate, or a kind of them", **{f"chosen[{k}]": words}
            )
            chosen = [i for i, one in enumerate(self.functions) if one.kind in KINDS.get(words, ())]
            if words not in KINDS:
                told = [(one.name, f"{one.kind}: {one.name}") for one in self.functions]
                chosen = [i for i, both in enumerate(told) if words in both]
                if not chosen:
                    raise ValueError(f'no estimate "{words}"; {hint(words, [*KINDS, *names])}')
            found |= dict.fromkeys(chosen)
        if not asked:
            return self
        some = np.array(list(found), np.int64)
        return EstimatedFunctions(
            self.at,
            tuple(self.functions[i] for i in found),
            self.values[some],
            self.rows[some],
            self.drawn[some],
            self.ball[some],
            self.axis[some],
        )

    @single_threaded
    def covariance(self) -> Array:
        """Covariance (m, m) in units of the variance of a unit-weight observation.

        Rows and columns of what is undetermined are NaN.
        """
        at, common = self.at, self.rows @ self.at.shared
        of_balls = np.flatnonzero(self.ball >= 0)
        if len(of_balls):
            ball, axis = self.ball[of_balls], self.axis[of_balls]
            kept = at.balls.common.shape[2] - common.shape[1]
            common = np.concatenate([common, np.zeros((len(common), kept))], axis=1)
            common[of_balls] = at.balls.common[ball, axis]
        result = common @ common.T
        if len(of_balls):
            own = at.balls.own[ball, axis]
            result[np.ix_(of_balls, of_balls)] += np.where(ball[:, None] == ball, own @ own.T, 0.0)
        is_open = np.isnan(self.uncertainties())
        result[is_open] = np.nan
        result[:, is_open] = np.nan
        return result


def labels(functions: Sequence[Function | ParameterEstimate]) -> list[str]:
    """Names, with the kind in front where a model or a file gives the same name to two.

    >>> kinds = [("EXX", "machine"), ("a", "machine"), ("a", "task")]
    >>> labels([Function(name, kind, "m") for name, kind in kinds])
    ['EXX', 'machine: a', 'task: a']
    """
    times = Counter(one.name for one in functions)
    return [one.name if times[one.name] == 1 else f"{one.kind}: {one.name}" for one in functions]


# In one piece: names, values and derivatives of each kind of parameter are added side by side.
@single_threaded
def estimated_functions(at: Linearisation, monomials: bool) -> EstimatedFunctions:
    """All that a fit estimates: the machine, poses, offsets, lengths of standards and balls;
    measuring tasks last.

    With `monomials` the machine's parameters are the coefficients of t, t^2, ... on [0, 1] instead
    of those of the stable basis.
    """
    design, layout, state = at.design, at.layout, at.state
    own, size = np.eye(len(layout)), len(layout)
    functions: list[Function] = []
    values: list[Array] = []
    rows: list[Array] = []

    def add(
        kind: FunctionKind,
        names: Sequence[str],
        units: Sequence[Unit],
        value: Array,
        derivative: Array,
    ) -> None:
        functions.extend(
            Function(*one) for one in zip(names, [kind] * len(names), units, strict=True)
        )
        values.append(np.atleast_1d(value))
        rows.append(derivative.reshape(len(names), size))

    parameters = layout.parameters
    if monomials:
        reported = design.model.reported()
        matrix = reported.matrix
        add("machine", reported.names, reported.units, matrix @ state.a, matrix @ own[layout.model])
    else:
        machine = design.model.parameters
        add(
            "machine",
            [p.name for p in machine],
            [p.unit for p in machine],
            state.a,
            own[layout.model],
        )

    turned = vector_from_rotation(state.rotations @ design.positions.rotations.transpose(0, 2, 1))
    poses = np.concatenate([state.origins, turned], axis=1)
    words = pose_parameter_names(design.dimension)
    for k, j in np.argwhere(layout.pose_columns >= 0).tolist():
        is_origin, name = j < design.dimension, f"{design.positions.names[k]}: {words[j]}"
        unit: Unit = "m" if is_origin else "rad"
        add(
            "origin" if is_origin else "rotation",
            [name],
            [unit],
            poses[k, j],
            own[layout.pose_columns[k, j]],
        )

    estimated = layout.offset_columns >= 0
    columns = layout.offset_columns[estimated]
    names = [parameters[column].name for column in columns]
    add("offset", names, ["m"] * len(names), state.probes[estimated], own[columns])

    names = list(design.unknown_lengths.names)
    add("length", names, ["m"] * len(names), state.lengths, own[layout.lengths])
    disturbing = design.influence_parameters
    names, units = [one.name for one in disturbing], [one.unit for one in disturbing]
    add("influence", names, units, state.influences, own[layout.influences])

    d, balls = design.dimension, design.plate_balls
    names = [f"{design.ball_label(ball)}: {letter}" for ball in balls for letter in AXIS_NAMES[:d]]
    add("ball", names, ["m"] * len(names), state.balls[balls].ravel(), np.zeros((len(names), size)))
    ball = np.full(len(functions), -1)
    ball[len(functions) - len(names) :] = np.repeat(balls, d)
    axis = np.where(ball < 0, -1, (np.arange(len(ball)) - len(ball)) % d)

    drawn, count = list(rows), len(design.tasks.names)
    if count:
        distances = task_distances(design)
        ends = distances.places.at(design, state).reshape(count, 2, d)
        found = linear_functions(at, distances)
        add(
            "task",
            design.tasks.names,
            ["m"] * count,
            np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1),
            found.shared,
        )
        drawn.append(found.shared if found.drawn is None else found.drawn.shared)
    none = np.full(count, -1)
    return EstimatedFunctions(
        at,
        tuple(functions),
        np.concatenate(values),
        np.concatenate(rows),
        np.concatenate(drawn),
        np.append(ball, none),
        np.append(axis, none),
    )


def parameter_estimates(
    functions: EstimatedFunctions, sigma: float
) -> tuple[ParameterEstimate, ...]:
    """The estimates among functions, whose stated uncertainties `sigma` multiplies."""
    uncertainties = functions.uncertainties()
    values = np.where(np.isnan(uncertainties), np.nan, functions.values).tolist()
    told = zip(functions.functions, values, (sigma * uncertainties).tolist(), strict=True)
    return tuple(
        ParameterEstimate(one.name, value, uncertainty, one.unit, one.kind)
        for one, value, uncertainty in told
        if one.kind != "task"
    )


ESTIMATE_COLUMNS: dict[str, Any] = {
    "parameter": "name",
    "kind": "kind",
    "value": ("value", "standard_uncertainty"),
    "standard uncertainty": ("standard_uncertainty", 3),
    "unit": "unit",
}


@dataclass(frozen=True, eq=False, repr=False)
class CorrectedPoints:
    """Scale readings corrected for the estimated errors of the machine: `points` (n, d) in metres.

    `root` (n, d, r) is a square root of their joint covariance, in metres; NaN where a co-ordinate
    is undetermined. It is that of the correction: the noise of the reading that is corrected is not
    in it.
    """

    points: Array
    root: Array

    def __repr__(self) -> str:
        """One line: points and covariances are long."""
        count = len(self.points)
        return f"<{type(self).__name__} of {number_of(count, 'scale reading')}>"

    @property
    def standard_uncertainties(self) -> Array:
        """Of each co-ordinate (n, d), in metres."""
        return np.linalg.norm(self.root, axis=2)

    @property
    def covariance(self) -> Array:
        """Of all co-ordinates together (n d, n d), those of a point side by side, in square
        metres.
        """
        flat = self.root.reshape(-1, self.root.shape[2])
        return flat @ flat.T

    @property
    def blocks(self) -> Array:
        """Of each point by itself (n, d, d), in square metres: the diagonal blocks of
        `covariance`.
        """
        return self.root @ self.root.transpose(0, 2, 1)


@single_threaded
def correct(at: Linearisation, points: Array, probes: Integers, sigma: float) -> CorrectedPoints:
    """Corrected points for scale readings `points` (n, d) in metres with probes of indices (n,)."""
    rows = correction_rows(at.design, at.layout, at.state, points, probes)
    drawn = (
        rows
        if at.drawn is None
        else correction_rows(at.design, at.layout, at.drawn.state, points, probes)
    )
    flat = rows.reshape(-1, len(at.layout))
    is_open = np.isnan(at.of_shared(flat, drawn.reshape(flat.shape))).reshape(points.shape)
    root = np.where(is_open[:, :, None], np.nan, sigma * (rows @ at.shared))
    return CorrectedPoints(corrected_points(at.design, at.state, points, probes), root)
