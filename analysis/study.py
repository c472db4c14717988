"""What the commands do, without a terminal: check a design, plan with it, fit readings to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.simulator.design import Design, probe_offsets, unknown_lengths
from ballplate.simulator.estimation.gauss_newton import Solution, estimate, linearised_fit
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.estimation.observations import length_deviations, reading_blocks, reading_weights
from ballplate.simulator.estimation.parameters import pose_parameter_names
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.geometry.motions import vector_from_rotation
from ballplate.simulator.layout import lay_out
from ballplate.simulator.machines.protocol import Array, Unit
from ballplate.simulator.machines.spatial_metric import SpatialMetricModel
from ballplate.simulator.observation_arrays import Readings
from ballplate.simulator.readings import ObservedReadings
from ballplate.simulator.rounding import comparable
from ballplate.simulator.threads import single_threaded

from .adjustments import Adjustment, adjustments
from .gross_errors.search import diagnosis
from .plates import plate_coordinates
from .rank import verdict
from .results.fit import Fit, ParameterEstimate, ParameterKind, Residual
from .results.prediction import Prediction
from .scale import scale_of
from .tasks import TaskUncertainty, task_uncertainties
from .uncertainty import Quantity, uncertainties

# Residuals that a fit names.
LARGEST = 10


@dataclass(frozen=True)
class Worth:
    """Uncertainties alone, for searches that judge many designs: rank deficiency, U1 to U6 and tasks as in a plan."""

    deficiency: int
    quantities: dict[str, Quantity]
    tasks: tuple[TaskUncertainty, ...]


def check(experiment: Experiment, design: Design | None = None, with_scale: bool = False) -> Prediction:
    """Judge the rank of an experiment's design, or of what came of it, at zero machine error."""
    return _predict(experiment, design or lay_out(experiment), False, with_scale)


def predict(experiment: Experiment, with_scale: bool = False) -> Prediction:
    """Rank verdict and U1 to U6 of an experiment's design at zero machine error."""
    return _predict(experiment, lay_out(experiment), True, with_scale)


@single_threaded
def worth(experiment: Experiment) -> Worth:
    """What `plan` finds, less the explanation of the rank, which takes most of its time."""
    at = linearise(lay_out(experiment))
    return Worth(at.deficiency, uncertainties(at, target=experiment.target_accuracy), task_uncertainties(at))


@single_threaded
def _predict(experiment: Experiment, design: Design, with_quantities: bool, with_scale: bool) -> Prediction:
    at, target = linearise(design), experiment.target_accuracy
    judged = verdict(at, experiment.expected_rank_deficiency, target)
    quantities: dict[str, Quantity] = {}
    tasks: tuple[TaskUncertainty, ...] = ()
    if with_quantities:
        quantities = uncertainties(at, target=target)
        tasks = task_uncertainties(at)
        lengths = quantities.get("U6")
    else:
        lengths = uncertainties(at, target=target, symbols=("U6",)).get("U6")
    scale = scale_of(experiment, at) if with_scale else None
    return Prediction(experiment.label, experiment.title, design, judged, quantities, tasks, lengths, scale)


@single_threaded
def fit(
    experiment: Experiment,
    observed: ObservedReadings,
    sigma: Literal["estimated", "given"] | None = None,
    monomials: bool = False,
) -> Fit:
    """Estimate machine errors, balls and poses from readings.

    `sigma` overrides what the file says; with `monomials` the machine's parameters are reported as the
    coefficients of t, t^2, ... on [0, 1] instead of in the stable basis.
    """
    design = observed.design
    solution = estimate(design, observed.x)
    if solution.status != "converged":
        judged = check(experiment, design).verdict
        return Fit(experiment.label, experiment.title, design, solution, judged, 1.0, False, 0, {}, (), ())
    at = linearised_fit(design, solution)
    judged = verdict(at, experiment.expected_rank_deficiency, experiment.target_accuracy)
    freedom = design.observations - design.parameter_count + judged.deficiency
    estimated = (sigma or experiment.sigma) == "estimated" and freedom > 0
    scale = float(np.sqrt(solution.factor.sum_of_squares / freedom)) if estimated else 1.0
    return Fit(
        experiment.label,
        experiment.title,
        design,
        solution,
        judged,
        scale,
        estimated,
        freedom,
        uncertainties(at, scale, experiment.target_accuracy),
        _estimates(at, scale, monomials),
        _largest(design, solution, observed.x),
        plate_coordinates(experiment, at, scale),
        _adjustments(at, scale, freedom if estimated else np.inf),
        task_uncertainties(at, scale),
        diagnosis(at, observed.x, freedom, estimated),
        observed.marks,
    )


def reading_residuals(design: Design, solution: Solution, x: Array) -> tuple[Readings, Array, Array]:
    """Readings of plates, with what each differs by from the estimate, (m, d) metres and in standard uncertainties."""
    chosen = design.plate_readings
    readings = design.readings.select(chosen)
    standardised = reading_blocks(design, solution.state, readings, x[chosen]).residual
    return readings, standardised / reading_weights(design, readings), standardised


def _adjustments(at: Linearisation, sigma: float, freedom: float) -> tuple[Adjustment, ...]:
    if not isinstance(at.design.model, SpatialMetricModel):
        return ()
    of_model = at.layout.model
    return adjustments(at.state.a, sigma * at.shared[of_model], at.shared_null[of_model], freedom)


def _largest(design: Design, solution: Solution, x: Array) -> tuple[Residual, ...]:
    """The largest residuals of readings and of lengths, largest first."""
    chosen = design.plate_readings
    _, apart, residual = reading_residuals(design, solution, x)
    off, uncertainty = length_deviations(design, solution.state, x)
    standardised = np.concatenate([residual.ravel(), off / uncertainty])
    value = np.concatenate([apart.ravel(), off])
    found = []
    for place in np.argsort(-comparable(np.abs(standardised)), kind="stable")[:LARGEST].tolist():
        i, axis = divmod(place, design.dimension)
        k = place - residual.size
        reading = int(chosen[i] if k < 0 else design.lengths.first[k])
        ball, words = design.ball_label(design.readings.ball[reading]), "xyz"[axis]
        if k >= 0:
            second = design.lengths.second[k]
            ball, words = (ball, "radius") if second < 0 else (f"{ball}-{_ball(design, second)}", "length")
        found.append(
            Residual(
                design.position_names[design.readings.position[reading]],
                ball,
                design.probe_names[design.readings.probe[reading]],
                words,
                float(value[place]),
                float(standardised[place]),
            )
        )
    return tuple(found)


def _ball(design: Design, reading: int) -> str:
    return design.ball_names[design.readings.ball[reading]]


def _estimates(at: Linearisation, sigma: float, monomials: bool) -> tuple[ParameterEstimate, ...]:
    design, layout, state = at.design, at.layout, at.state
    found: list[ParameterEstimate] = []

    def add(kind: ParameterKind, name: str, value: float, uncertainty: float, unit: Unit) -> None:
        known = not np.isnan(uncertainty)
        found.append(ParameterEstimate(name, float(value) if known else np.nan, float(sigma * uncertainty), unit, kind))

    own = np.eye(len(layout))
    matrix, names, units = own[layout.model], [p.name for p in design.model.parameters], None
    if monomials:
        reported = design.model.reported()
        matrix, names, units = reported.matrix @ matrix, list(reported.names), reported.units
    values = (reported.matrix if monomials else np.eye(len(state.a))) @ state.a
    for k, uncertainty in enumerate(at.of_shared(matrix)):
        add("machine", names[k], values[k], uncertainty, units[k] if units else design.model.parameters[k].unit)

    of_shared = at.of_shared(own)
    turned = vector_from_rotation(state.rotations @ design.rotations.transpose(0, 2, 1))
    poses = np.concatenate([state.origins, turned], axis=1)
    words = pose_parameter_names(design.dimension)
    for k in design.posed_positions:
        for j, column in enumerate(layout.pose_columns[k]):
            if column >= 0:
                kind: ParameterKind = "origin" if j < design.dimension else "rotation"
                unit: Unit = "m" if kind == "origin" else "rad"
                add(kind, f"{design.position_names[k]}: {words[j]}", poses[k, j], of_shared[column], unit)

    for probe, axis in np.argwhere(layout.offset_columns >= 0):
        column = layout.offset_columns[probe, axis]
        value = probe_offsets(design, state)[probe, axis]
        add("offset", layout.parameters[column].name, value, of_shared[column], "m")

    lengths = unknown_lengths(design, state), of_shared[layout.lengths]
    for name, value, uncertainty in zip(design.length_names, *lengths, strict=True):
        add("length", name, value, uncertainty, "m")

    of_balls = at.of_balls()
    for ball in design.plate_balls:
        for axis, letter in enumerate(("x", "y", "z")[: design.dimension]):
            name = f"{design.ball_label(ball)}: {letter}"
            add("ball", name, state.balls[ball, axis], of_balls[ball, axis], "m")
    return tuple(found)
