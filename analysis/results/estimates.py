"""Estimates of a fit as functions of its parameters, with uncertainties and covariances."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.design.objects import Volume
from ballplate.simulator.estimation.functions import (
    corrected_points,
    correction_rows,
    linear_functions,
)
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.geometry.motions import (
    AXIS_NAMES,
    pose_parameter_names,
    vector_from_rotation,
)
from ballplate.simulator.inputs.arguments import ensure_type
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.inputs.settings import hint, number_of, shorten
from ballplate.simulator.machines.protocol import Unit
from ballplate.uncertainty.quantities import task_distances

ParameterKind = Literal["machine", "origin", "rotation", "offset", "length", "influence", "ball"]
FunctionKind = Literal[ParameterKind, "task"]

# Names that `choose` accepts for kinds.
KINDS: dict[str, tuple[FunctionKind, ...]] = {
    "pose": ("origin", "rotation"),
    **{kind: (kind,) for kind in (*get_args(ParameterKind), "task")},
}


@dataclass(frozen=True)
class ParameterEstimate:
    """An estimated parameter; value and standard uncertainty are NaN if it is undetermined.

    `kind` is its object: the machine, origin or rotation of a pose, a probe's offset, a standard's
    length, an influence quantity, a ball.
    """

    name: str
    value: float
    standard_uncertainty: float
    unit: Unit
    kind: ParameterKind = "machine"


@dataclass(frozen=True)
class Function:
    """One row of `EstimatedFunctions`: name, kind and unit."""

    name: str
    kind: FunctionKind
    unit: Unit


@dataclass(frozen=True, eq=False)
class EstimatedFunctions:
    """Functions (m,) of the parameters at a fit, with their `values` (m,).

    `rows` (m, s) are derivatives by the shared parameters, `drawn` (m, s) the same at the nominal
    design; rows of balls' co-ordinates are zero, and `ball` and `axis` (m,) their indices, -1 for
    all other functions.
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
        """Names, preceded by the kind if a model or a file uses a name twice."""
        return labels(self.functions)

    def uncertainties(self) -> Array:
        """Return standard deviations (m,) in units of that of a unit-weight observation; NaN if
        undetermined.
        """
        result = self.at.of_shared(self.rows, self.drawn)
        of_balls = self.ball >= 0
        if of_balls.any():
            result[of_balls] = self.at.of_balls()[self.ball[of_balls], self.axis[of_balls]]
        return result

    def choose(self, wanted: Sequence[str]) -> EstimatedFunctions:
        """Return the functions of kinds or names, in this order; all if `wanted` is empty.

        :raises ValueError: an unknown kind or name.
        """
        if not wanted:
            return self
        chosen: dict[int, None] = {}
        names = self.labels
        for k, name in enumerate(wanted):
            ensure_type(str, "the name or the kind of an estimate", **{f"chosen[{k}]": name})
            kinds = KINDS.get(name)
            matches = [
                i
                for i, function in enumerate(self.functions)
                if (
                    name in (function.name, f"{function.kind}: {function.name}")
                    if kinds is None
                    else function.kind in kinds
                )
            ]
            if not matches and kinds is None:
                raise ValueError(f'no estimate "{name}"; {hint(name, [*KINDS, *names])}')
            chosen |= dict.fromkeys(matches)
        rows = np.array(list(chosen), np.int64)
        return EstimatedFunctions(
            self.at,
            tuple(self.functions[i] for i in chosen),
            self.values[rows],
            self.rows[rows],
            self.drawn[rows],
            self.ball[rows],
            self.axis[rows],
        )

    @single_threaded
    def covariance(self) -> Array:
        """Return the covariance (m, m) in units of the variance of a unit-weight observation.

        Rows and columns of undetermined functions are NaN.
        """
        at, common = self.at, self.rows @ self.at.shared
        of_balls = np.flatnonzero(self.ball >= 0)
        if len(of_balls):
            ball, axis = self.ball[of_balls], self.axis[of_balls]
            ball_columns = at.balls.common.shape[2] - common.shape[1]
            # Shared parameters do not depend on the variables of the kept balls, which follow
            # theirs.
            common = np.concatenate([common, np.zeros((len(common), ball_columns))], axis=1)
            common[of_balls] = at.balls.common[ball, axis]
        result = common @ common.T
        if len(of_balls):
            # Two co-ordinates of one ball share the part of its own rows; those of different balls
            # do not.
            ball_root = at.balls.own[ball, axis]
            result[np.ix_(of_balls, of_balls)] += np.where(
                ball[:, None] == ball, ball_root @ ball_root.T, 0.0
            )
        is_open = np.isnan(self.uncertainties())
        result[is_open] = np.nan
        result[:, is_open] = np.nan
        return result


def labels(functions: Sequence[Function | ParameterEstimate]) -> list[str]:
    """Return names, preceded by the kind if a model or a file uses a name twice.

    >>> kinds = [("EXX", "machine"), ("a", "machine"), ("a", "task")]
    >>> labels([Function(name, kind, "m") for name, kind in kinds])
    ['EXX', 'machine: a', 'task: a']
    """
    times = Counter(function.name for function in functions)
    return [
        function.name if times[function.name] == 1 else f"{function.kind}: {function.name}"
        for function in functions
    ]


# In one piece: the order of additions is that of results.
@single_threaded
def estimated_functions(at: Linearisation, monomials: bool) -> EstimatedFunctions:
    """Return all estimates of a fit: the machine, poses, offsets, lengths of standards, influence
    quantities and balls; measuring tasks last.

    With `monomials` the machine's parameters are the coefficients of t, t^2, ... on [0, 1] instead
    of those of the stable basis.
    """
    design, layout, state = at.design, at.layout, at.state
    identity, size = np.eye(len(layout)), len(layout)
    functions: list[Function] = []
    values = []
    rows = []

    def add(
        kind: FunctionKind,
        names: Sequence[str],
        units: Sequence[Unit],
        value: Array,
        derivative: Array,
    ) -> None:
        functions.extend(
            Function(name, kind, unit) for name, unit in zip(names, units, strict=True)
        )
        values.append(np.atleast_1d(value))
        rows.append(derivative.reshape(len(names), size))

    parameters = layout.parameters
    if monomials:
        reported = design.model.reported()
        matrix = reported.matrix
        add(
            "machine",
            reported.names,
            reported.units,
            matrix @ state.a,
            matrix @ identity[layout.model],
        )
    else:
        machine = design.model.parameters
        add(
            "machine",
            [p.name for p in machine],
            [p.unit for p in machine],
            state.a,
            identity[layout.model],
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
            identity[layout.pose_columns[k, j]],
        )

    estimated = layout.offset_columns >= 0
    columns = layout.offset_columns[estimated]
    names = [parameters[column].name for column in columns]
    add("offset", names, ["m"] * len(names), state.probes[estimated], identity[columns])

    names = list(design.unknown_lengths.names)
    add("length", names, ["m"] * len(names), state.lengths, identity[layout.lengths])
    disturbing = design.influence_parameters
    names, units = (
        [parameter.name for parameter in disturbing],
        [parameter.unit for parameter in disturbing],
    )
    add("influence", names, units, state.influences, identity[layout.influences])

    d, balls = design.dimension, design.plate_balls
    names = [f"{design.ball_label(ball)}: {letter}" for ball in balls for letter in AXIS_NAMES[:d]]
    add("ball", names, ["m"] * len(names), state.balls[balls].ravel(), np.zeros((len(names), size)))
    ball = np.full(len(functions), -1)
    ball[len(functions) - len(names) :] = np.repeat(balls, d)
    axis = np.where(ball < 0, -1, (np.arange(len(ball)) - len(ball)) % d)

    # All functions so far are parameters, or linear in them, and have the same derivatives at the
    # nominal design. Tasks are distances, whose derivatives depend on the state.
    drawn, count = list(rows), len(design.tasks.names)
    if count:
        distances = task_distances(design)
        ends = distances.places.at(design, state).reshape(count, 2, d)
        derivatives = linear_functions(at, distances)
        add(
            "task",
            design.tasks.names,
            ["m"] * count,
            np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1),
            derivatives.shared,
        )
        drawn.append(derivatives.shared if derivatives.drawn is None else derivatives.drawn.shared)
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
    """Return the estimates among functions; `sigma` multiplies stated uncertainties."""
    uncertainties = functions.uncertainties()
    values = np.where(np.isnan(uncertainties), np.nan, functions.values).tolist()
    estimates = zip(functions.functions, values, (sigma * uncertainties).tolist(), strict=True)
    return tuple(
        ParameterEstimate(function.name, value, uncertainty, function.unit, function.kind)
        for function, value, uncertainty in estimates
        if function.kind != "task"
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
    """Scale readings corrected for the machine's estimated errors: `points` (n, d) in metres.

    `root` (n, d, r) is a square root of their joint covariance, in metres; NaN if undetermined. It
    is that of the correction, without the noise of the corrected reading.
    """

    points: Array
    root: Array

    def __repr__(self) -> str:
        count = len(self.points)
        return f"<{type(self).__name__} of {number_of(count, 'scale reading')}>"

    @property
    def standard_uncertainties(self) -> Array:
        """Standard uncertainties of co-ordinates (n, d), in metres."""
        return np.linalg.norm(self.root, axis=2)

    @property
    def covariance(self) -> Array:
        """Joint covariance of all co-ordinates (n d, n d), point by point, in square metres."""
        flat = self.root.reshape(-1, self.root.shape[2])
        return flat @ flat.T

    @property
    def blocks(self) -> Array:
        """Covariance of each point (n, d, d), in square metres: the diagonal blocks of
        `covariance`.
        """
        return self.root @ self.root.transpose(0, 2, 1)


@single_threaded
def correct(at: Linearisation, points: Array, probes: Integers, sigma: float) -> CorrectedPoints:
    """Return corrected points for scale readings `points` (n, d) in metres with probes of indices
    (n,).
    """
    rows = correction_rows(at.design, at.layout, at.state, points, probes)
    drawn = (
        rows
        if at.drawn is None
        else correction_rows(at.design, at.layout, at.drawn.state, points, probes)
    )
    flat = rows.reshape(-1, len(at.layout))
    # Whether a correction is determined is judged at the nominal design: at the estimate, noise
    # makes null directions appear to be determined.
    is_open = np.isnan(at.of_shared(flat, drawn.reshape(flat.shape))).reshape(points.shape)
    root = np.where(is_open[:, :, None], np.nan, sigma * (rows @ at.shared))
    return CorrectedPoints(corrected_points(at.design, at.state, points, probes), root)


def ensure_points(points: object, volume: Volume) -> Array:
    """Return a user's points as an array (n, d) in metres.

    :raises ValueError: another shape, or far outside the volume.

    >>> ensure_points([[1.0, 2.0, 3.0]], Volume(np.zeros(2), np.ones(2)))
    Traceback (most recent call last):
    ValueError: points of shape (1, 3); expected (n, 2)
    """
    d = len(volume.lower)
    try:
        array = np.asarray(points, float)
    except (TypeError, ValueError):
        expected = f"numbers in metres, {d} for each point"
        raise ValueError(f"points={shorten(repr(points))}; give {expected}") from None
    if array.ndim != 2 or array.shape[1] != d:
        raise ValueError(f"points of shape {array.shape}; expected (n, {d})")
    if not np.isfinite(array).all():
        raise ValueError("points have co-ordinates that are no finite numbers; leave these out")
    for i, axis in np.argwhere(volume.far_outside(array)).tolist():
        fact = (
            f"{AXIS_NAMES[axis]} = {array[i, axis]:.6g} m of points[{i}] is far outside the volume"
        )
        raise ValueError(f"{fact}; give points in metres")
    return array


def probe_places(probe: object, probes: tuple[str, ...], count: int) -> Integers:
    """Return the indices (count,) of probes from one name, or one for each point.

    :raises TypeError: no name, and no names.
    :raises ValueError: an unknown name, or another number of names.
    """
    ensure_type(Iterable, "the name of a probe, or one for each point", probe=probe)
    names = [probe] if isinstance(probe, str) else list(probe)  # type: ignore[call-overload]
    for name in names:
        if name not in probes:
            raise ValueError(f'no probe "{name}"; {hint(name, probes)}')
    if len(names) not in (1, count):
        raise ValueError(f"{len(names)} probes for {count} points")
    return np.broadcast_to(np.array([probes.index(name) for name in names], np.int64), count)
