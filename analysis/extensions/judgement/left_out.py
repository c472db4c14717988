"""Positions, plates and directions left out in turn, and predicted from the rest.

What is left out has uncertainties a thousand times as large, so that it tells nothing of the
machine, but the pose of a position that is left out, and balls that are read nowhere else, are
taken from its own readings: what is predicted is what is free of these. S^2 falls by the sum of
squares of the prediction errors, weighted with their own covariance, the scatter of the readings
included (Chow's test of predictions).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from ballplate.extensions.reliability.hat import hat_rows, row_count, row_places, whitened_residuals
from ballplate.results import campaign_sigmas
from ballplate.simulator.computing import ProgressStep, Report, single_threaded, unreported
from ballplate.simulator.design import (
    Design,
    Flags,
    Lengths,
    Observations,
    measured,
    reading_uncertainties,
)
from ballplate.simulator.estimation import (
    Distances,
    Linearisation,
    MeasuredPoints,
    estimate,
    linear_functions,
    linearised_fit,
)
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import refused
from ballplate.simulator.machines import Array, Integers
from ballplate.simulator.readings import ObservedReadings

from .lack_of_fit import chance_of
from .left_out_result import LengthDifference, PredictedGroup, PredictedReading, Validation

# How many times as uncertain what is left out is; the square of this is what it tells at the most.
OUT = 1e3

# Share of the variance of a length from which on what is left out determines it.
FROM_LEFT_OUT = 1e-3

# Variance of a prediction error, in those of its reading, below which nothing is predicted.
NOT_PREDICTED = 1e-3

# Points between which lengths are compared, the first of the evaluation.
MOST_POINTS = 64

# Cosine from which on two positions have the same direction.
PARALLEL = 0.99


@dataclass(frozen=True)
class LeftGroup:
    """What is left out together: `positions` (k,), and the `artefact`'s certificates if it is not
    -1.
    """

    kind: Literal["position", "plate", "direction"]
    name: str
    positions: Integers
    artefact: int = -1


def groups_to_leave(design: Design) -> list[LeftGroup]:
    """All positions that were read, all plates and standards, and all directions of plates; none
    that is all there is.
    """
    read = np.unique(design.readings.position)
    found = [LeftGroup("position", design.positions.names[k], np.array([k])) for k in read.tolist()]
    artefact = design.positions.artefact[read]
    for k in np.unique(artefact).tolist():
        found.append(LeftGroup("plate", design.artefacts.names[k], read[artefact == k], k))
    plates = read[design.artefacts.is_plate[artefact]]
    found += [LeftGroup("direction", name, same) for name, same in _directions(design, plates)]
    return [one for one in found if len(one.positions) < len(read)]


def _directions(design: Design, positions: Integers) -> Iterator[tuple[str, Integers]]:
    """Positions whose normals are parallel, in the plane whose sides are."""
    d = design.dimension
    axes = design.positions.rotations[positions][:, :, -1 if d == 3 else 0]
    left = np.arange(len(positions))
    while len(left):
        axis = axes[left[0]]
        same = np.abs(axes[left] @ axis) > PARALLEL
        of_machine = np.abs(axis) > PARALLEL
        letter = AXIS_NAMES[int(of_machine.argmax())] if of_machine.any() else ""
        word = ("across" if d == 3 else "along") + f" {letter}"
        name = word if letter else f"as {design.positions.names[positions[left[0]]]}"
        yield name, positions[left[same]]
        left = left[~same]


def without(design: Design, group: LeftGroup) -> tuple[Design, Flags]:
    """The design with a group left out, and which rows (rows,) count as good as nothing."""
    readings, lengths = design.readings, design.of(Lengths)
    out = np.isin(readings.position, group.positions)
    uncertainty = reading_uncertainties(design, readings) * np.where(out, OUT, 1.0)[:, None]
    changed: list[Observations] = [lengths.select(~out[lengths.first])]
    is_out: dict[type[Observations], Flags] = {}
    for one in design.observations:
        if not isinstance(one, Lengths):
            mine = np.zeros(one.count(design), bool)
            if group.artefact >= 0 and one.balls.shape[1]:
                mine = design.balls.artefact[one.balls[:, 0]] == group.artefact
            is_out[type(one)] = mine
            changed.append(one.enlarged(np.where(mine, OUT, 1.0)) if mine.any() else one)
    rest = replace(design, readings=replace(readings, uncertainty=uncertainty)).observed(*changed)
    places, rows = row_places(rest), np.zeros(row_count(rest), bool)
    rows[places["reading"]] = np.repeat(out[design.plate_readings], design.dimension)
    for one in rest.observations:
        if not isinstance(one, Lengths):
            rows[places[one.word]] = is_out[type(one)]
    return rest, rows


@dataclass(frozen=True, eq=False)
class RestFit:
    """The estimate without a group: its linearisation, S^2 and degrees of freedom, and of the rows
    left out the prediction errors (m,), their variances (m,) in those of the readings, and how the
    root of the covariance depends on them, `common` (m, r).
    """

    at: Linearisation
    sum_of_squares: float
    degrees_of_freedom: int
    rows: Integers
    errors: Array
    variances: Array
    common: Array


@single_threaded
def rest_of(design: Design, x: Array, group: LeftGroup) -> RestFit | None:
    """The estimate without a group; None where it does not converge."""
    rest, is_out = without(design, group)
    solution = estimate(rest, x)
    if solution.status != "converged":
        return None
    at = linearised_fit(rest, solution)
    rows = np.flatnonzero(is_out)
    place = np.full(len(is_out), -1)
    place[rows] = np.arange(len(rows))
    d, balls = rest.dimension, len(rest.balls.names)
    common, own = np.zeros((len(rows), at.balls.common.shape[2])), np.zeros((len(rows), balls * d))
    for some in hat_rows(at, x):
        mine = np.flatnonzero(place[some.rows] >= 0)
        common[place[some.rows[mine]]] = some.common[mine]
        alone = mine[some.ball[mine] >= 0]
        columns = d * some.ball[alone][:, None] + np.arange(d)
        own[place[some.rows[alone]][:, None], columns] = some.own[alone]
    root = np.concatenate([common, own[:, own.any(axis=0)]], axis=1)
    hat = root @ root.T
    left = np.eye(len(rows)) - hat
    variances = (left**2).sum(axis=1) + OUT**2 * np.einsum("ij,ji->i", hat, left)
    errors = whitened_residuals(rest, at.state, x)[rows]
    is_read = np.ones(row_count(rest), bool)
    is_read[row_places(rest)["reading"]] = measured(
        rest, rest.readings.select(rest.plate_readings)
    ).ravel()
    absorbed = int(round(float(np.trace(hat))))
    freedom = at.degrees_of_freedom
    return RestFit(
        at,
        solution.factor.sum_of_squares - float(errors @ errors),
        freedom - (int(is_read[rows].sum()) - absorbed),
        rows,
        OUT * errors,
        np.where(is_read[rows], np.maximum(variances, 0.0), 0.0),
        common,
    )


@single_threaded
def validate(
    experiment: Experiment,
    observed: ObservedReadings,
    sigma: Literal["estimated", "given"] | None = None,
    report: Report = unreported,
) -> Validation:
    """Predict each position, plate and direction from all others.

    :raises ExperimentError: the estimate from all readings does not converge.
    """
    given = (sigma or experiment.sigma) == "given"
    campaigns = None if given else campaign_sigmas(experiment, observed)
    observed = observed if campaigns is None else campaigns.observed
    design = observed.design
    solution = estimate(design, observed.x)
    if solution.status != "converged":
        text = f"the estimate from all readings has {solution.status}; see ballplate fit"
        raise refused(experiment.source, text)
    at = linearised_fit(design, solution)
    freedom = at.degrees_of_freedom
    groups = groups_to_leave(design)
    found = []
    for group in groups:
        found.append(_left_out(at, freedom, observed, group, given))
        report(ProgressStep(f"left out of {experiment.label}", len(found), len(groups)))
    return Validation(
        experiment.label,
        experiment.title,
        observed,
        tuple(found),
        given,
        2.0 if experiment.coverage_factor == 1.0 else experiment.coverage_factor,
    )


def _left_out(
    full: Linearisation, freedom: int, observed: ObservedReadings, group: LeftGroup, given: bool
) -> PredictedGroup:
    rest = rest_of(full.design, observed.x, group)
    if rest is None:
        return PredictedGroup(group.kind, group.name, 0, float("nan"), float("nan"), 1.0, False)
    predicted = freedom - rest.degrees_of_freedom
    square = max(full.factor.sum_of_squares - rest.sum_of_squares, 0.0)
    scale = 1.0
    if not given:
        left = rest.sum_of_squares / max(rest.degrees_of_freedom, 1)
        scale = float(np.sqrt(left)) if rest.degrees_of_freedom > 0 else float("nan")
    chance = chance_of(square, predicted, rest.sum_of_squares, rest.degrees_of_freedom, given)
    return PredictedGroup(
        group.kind,
        group.name,
        predicted,
        square / max(predicted, 1),
        scale,
        chance,
        True,
        _worst(rest, observed, scale),
        _length_difference(full, rest, scale),
    )


def _worst(rest: RestFit, observed: ObservedReadings, scale: float) -> PredictedReading | None:
    """The reading that is predicted worst; None where none is predicted."""
    design = rest.at.design
    readings = row_places(design)["reading"]
    can = (rest.variances > NOT_PREDICTED) & (rest.rows < readings.stop)
    if not can.any() or not scale > 0.0:
        return None
    deviations = np.sqrt(np.where(can, rest.variances, 1.0))
    standardised = np.where(can, rest.errors / deviations, 0.0) / scale
    worst = int(np.abs(standardised).argmax())
    reading, axis = divmod(int(rest.rows[worst]), design.dimension)
    k = int(design.plate_readings[reading])
    stated = reading_uncertainties(observed.design, observed.design.readings)[k, axis]
    stated /= float(np.sqrt(design.readings.repeats[k]))
    return PredictedReading(
        design.positions.names[design.readings.position[k]],
        design.ball_label(int(design.readings.ball[k])),
        design.probes.names[design.readings.probe[k]],
        AXIS_NAMES[axis],
        float(rest.errors[worst] * stated),
        float(scale * deviations[worst] * stated),
        float(standardised[worst]),
    )


def _length_difference(full: Linearisation, rest: RestFit, scale: float) -> LengthDifference | None:
    """The largest difference that a group makes to lengths between evaluation points; None where
    the rest determines no length.

    As the estimate from all readings is the best, the variance of its difference from that of some
    is the difference of their variances.
    """
    design = full.design
    points = design.evaluation.points[:MOST_POINTS]
    places = MeasuredPoints(points, np.full(len(points), design.evaluation.probe))
    pairs = np.stack(np.triu_indices(len(points), 1), axis=1)
    names = ("",) * len(pairs)
    distances = Distances(places, pairs, names)

    def of(at: Linearisation) -> tuple[Array, Array, Array]:
        where = places.at(design, at.state)
        lengths = np.linalg.norm(where[pairs[:, 0]] - where[pairs[:, 1]], axis=1)
        functions = linear_functions(at, distances)
        return lengths, at.uncertainty(functions), functions.shared @ at.shared

    (one, u_full, _), (other, u_rest, root) = of(full), of(rest.at)
    from_left = ((root @ rest.common[:, : root.shape[1]].T) ** 2).sum(axis=1)
    known = np.isfinite(u_full) & np.isfinite(u_rest) & (from_left < FROM_LEFT_OUT * u_rest**2)
    if not known.any():
        return None
    change = np.where(known, other - one, 0.0)
    k = int(np.abs(change).argmax())
    variance = max(float(u_rest[k] ** 2 - u_full[k] ** 2), 0.0)
    return LengthDifference(
        float(change[k]),
        scale * float(np.sqrt(variance)),
        scale * float(u_full[k]),
        int((~known).sum()),
        (f"point {pairs[k, 0] + 1}", f"point {pairs[k, 1] + 1}"),
    )
