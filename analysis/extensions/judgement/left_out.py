"""Positions left out in turn, and predicted from the rest.

Readings left out have uncertainties a thousand times as large, so that they add no information on
the machine, while the pose of a position left out, and balls read only there, come from its own
readings: the prediction concerns the remaining combinations. S^2 falls by the sum of squares of
the prediction errors, weighted with their own covariance, the noise of the readings included
(Chow's test of predictions).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from ballplate.extensions.diagnosis.hat import hat_rows, row_count, row_places, whitened_residuals
from ballplate.simulator.computing import (
    ProgressStep,
    Report,
    first_largest,
    single_threaded,
    unreported,
)
from ballplate.simulator.design import Design, Flags, Lengths, measured, reading_uncertainties
from ballplate.simulator.estimation import (
    Distances,
    Linearisation,
    MeasuredPoints,
    estimate,
    linear_functions,
    linearised_fit,
)
from ballplate.simulator.experiment import LEAST_SIGMA, Experiment
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import refused
from ballplate.simulator.machines import Array, Integers
from ballplate.simulator.readings import ObservedReadings

from ..machine_files import campaign_sigmas
from .lack_of_fit import chance_of
from .left_out_result import LengthDifference, PredictedPosition, PredictedReading, Validation

# How many times as uncertain what is left out is; the square of this is what it tells at the most.
OUT = 1e3

# Share of the variance of a length from which on what is left out determines it.
FROM_LEFT_OUT = 1e-3

# Variance of a prediction error, in those of its reading, below which nothing is predicted.
NOT_PREDICTED = 1e-3

# Points between which lengths are compared, the first of the evaluation.
MOST_POINTS = 64


def without(design: Design, position: int) -> tuple[Design, Flags]:
    """Return the design with a position's readings left out, and a mask (rows,) of the rows with
    negligible weight.
    """
    readings, lengths = design.readings, design.of(Lengths)
    out = readings.position == position
    uncertainty = reading_uncertainties(design, readings) * np.where(out, OUT, 1.0)[:, None]
    design_left = replace(design, readings=replace(readings, uncertainty=uncertainty)).observed(
        lengths.select(~out[lengths.first])
    )
    rows = np.zeros(row_count(design_left), bool)
    rows[row_places(design_left)["reading"]] = np.repeat(
        out[design.plate_readings], design.dimension
    )
    return design_left, rows


@dataclass(frozen=True, eq=False)
class RestFit:
    """The estimate without a position: its linearisation, S^2 and degrees of freedom, and of the
    rows left out the prediction errors (m,), their variances (m,) in those of the readings, and how
    the root of the covariance depends on them, `common` (m, r).
    """

    at: Linearisation
    sum_of_squares: float
    degrees_of_freedom: int
    rows: Integers
    errors: Array
    variances: Array
    common: Array


@single_threaded
def rest_of(design: Design, x: Array, position: int) -> RestFit | None:
    """Return the estimate without a position, if it converges."""
    design_left, is_out = without(design, position)
    solution = estimate(design_left, x)
    if solution.status != "converged":
        return None
    linearisation = linearised_fit(design_left, solution)
    rows = np.flatnonzero(is_out)
    place = np.full(len(is_out), -1)
    place[rows] = np.arange(len(rows))
    d, balls = design_left.dimension, len(design_left.balls.names)
    common, own_rows = (
        np.zeros((len(rows), linearisation.balls.common.shape[2])),
        np.zeros((len(rows), balls * d)),
    )
    for some in hat_rows(linearisation, x):
        mine = np.flatnonzero(place[some.rows] >= 0)
        common[place[some.rows[mine]]] = some.common[mine]
        alone = mine[some.ball[mine] >= 0]
        columns = d * some.ball[alone][:, None] + np.arange(d)
        own_rows[place[some.rows[alone]][:, None], columns] = some.own[alone]
    root = np.concatenate([common, own_rows[:, own_rows.any(axis=0)]], axis=1)
    hat = root @ root.T
    residual_projector = np.eye(len(rows)) - hat
    variances = (residual_projector**2).sum(axis=1) + OUT**2 * np.einsum(
        "ij,ji->i", hat, residual_projector
    )
    errors = whitened_residuals(design_left, linearisation.state, x)[rows]
    is_read = np.ones(row_count(design_left), bool)
    is_read[row_places(design_left)["reading"]] = measured(
        design_left, design_left.readings.select(design_left.plate_readings)
    ).ravel()
    absorbed = int(round(float(np.trace(hat))))
    freedom = linearisation.degrees_of_freedom
    return RestFit(
        linearisation,
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
    """Predict each position that was read from all others.

    :raises ExperimentError: the estimate from all readings does not converge.
    """
    is_given = (sigma or experiment.sigma) == "given"
    campaigns = None if is_given else campaign_sigmas(experiment, observed)
    observed = observed if campaigns is None else campaigns.observed
    design = observed.design
    solution = estimate(design, observed.x)
    if solution.status != "converged":
        text = f"the estimate from all readings has {solution.status}; see ballplate fit"
        raise refused(experiment.source, text)
    linearisation = linearised_fit(design, solution)
    freedom = linearisation.degrees_of_freedom
    positions = np.unique(design.readings.position).tolist()
    left_out: list[PredictedPosition] = []
    for position in positions if len(positions) > 1 else ():
        left_out.append(_left_out(linearisation, freedom, observed, position, is_given))
        report(ProgressStep(f"left out of {experiment.label}", len(left_out), len(positions)))
    return Validation(
        experiment.label,
        experiment.title,
        observed,
        tuple(left_out),
        is_given,
        2.0 if experiment.coverage_factor == 1.0 else experiment.coverage_factor,
    )


def _left_out(
    full: Linearisation, freedom: int, observed: ObservedReadings, position: int, is_given: bool
) -> PredictedPosition:
    name = full.design.positions.names[position]
    fit_of_rest = rest_of(full.design, observed.x, position)
    if fit_of_rest is None:
        return PredictedPosition(name, 0, float("nan"), float("nan"), 1.0, False)
    predicted = freedom - fit_of_rest.degrees_of_freedom
    sum_left, freedom_left = fit_of_rest.sum_of_squares, fit_of_rest.degrees_of_freedom
    square = max(full.factor.sum_of_squares - sum_left, 0.0)
    scale = 1.0
    if not is_given:
        # Ratios of what is nothing but rounding would differ from one processor to another.
        square = square if square > LEAST_SIGMA**2 * predicted else 0.0
        sum_left = sum_left if sum_left > LEAST_SIGMA**2 * freedom_left else 0.0
        scale = float(np.sqrt(sum_left / freedom_left)) if freedom_left > 0 else float("nan")
    chance = chance_of(square, predicted, sum_left, freedom_left, is_given)
    return PredictedPosition(
        name,
        predicted,
        square / max(predicted, 1),
        scale,
        chance,
        True,
        _worst(fit_of_rest, observed, scale),
        _length_difference(full, fit_of_rest, scale),
    )


def _worst(
    fit_of_rest: RestFit, observed: ObservedReadings, scale: float
) -> PredictedReading | None:
    """Return the reading with the largest standardised prediction error, if any is predicted."""
    design = fit_of_rest.at.design
    readings = row_places(design)["reading"]
    can = (fit_of_rest.variances > NOT_PREDICTED) & (fit_of_rest.rows < readings.stop)
    if not can.any() or not scale > 0.0:
        return None
    deviations = np.sqrt(np.where(can, fit_of_rest.variances, 1.0))
    standardised = np.where(can, fit_of_rest.errors / deviations, 0.0) / scale
    worst = first_largest(np.abs(standardised))
    reading, axis = divmod(int(fit_of_rest.rows[worst]), design.dimension)
    k = int(design.plate_readings[reading])
    uncertainties = reading_uncertainties(observed.design, observed.design.readings)[k, axis]
    uncertainties /= float(np.sqrt(design.readings.repeats[k]))
    return PredictedReading(
        design.ball_label(int(design.readings.ball[k])),
        design.probes.names[design.readings.probe[k]],
        AXIS_NAMES[axis],
        float(fit_of_rest.errors[worst] * uncertainties),
        float(scale * deviations[worst] * uncertainties),
        float(standardised[worst]),
    )


def _length_difference(
    full: Linearisation, fit_of_rest: RestFit, scale: float
) -> LengthDifference | None:
    """Return the largest effect of a position on lengths between evaluation points, if the rest
    determines any length.

    As the estimate from all readings is the best, the variance of its difference from that of some
    is the difference of their variances.
    """
    design = full.design
    points = design.evaluation.points[:MOST_POINTS]
    places = MeasuredPoints(points, np.full(len(points), design.evaluation.probe))
    pairs = np.stack(np.triu_indices(len(points), 1), axis=1)
    names = ("",) * len(pairs)
    distances = Distances(places, pairs, names)

    def of(linearisation: Linearisation) -> tuple[Array, Array, Array]:
        where = places.at(design, linearisation.state)
        lengths = np.linalg.norm(where[pairs[:, 0]] - where[pairs[:, 1]], axis=1)
        functions = linear_functions(linearisation, distances)
        return (
            lengths,
            linearisation.uncertainty(functions),
            functions.shared @ linearisation.shared,
        )

    (length_of_full, u_full, _), (length_of_rest, u_rest, root) = of(full), of(fit_of_rest.at)
    from_left = ((root @ fit_of_rest.common[:, : root.shape[1]].T) ** 2).sum(axis=1)
    is_known = np.isfinite(u_full) & np.isfinite(u_rest) & (from_left < FROM_LEFT_OUT * u_rest**2)
    if not is_known.any():
        return None
    change = np.where(is_known, length_of_rest - length_of_full, 0.0)
    k = first_largest(np.abs(change))
    variance = max(float(u_rest[k] ** 2 - u_full[k] ** 2), 0.0)
    return LengthDifference(
        float(change[k]),
        scale * float(np.sqrt(variance)),
        int((~is_known).sum()),
        (f"point {pairs[k, 0] + 1}", f"point {pairs[k, 1] + 1}"),
    )
