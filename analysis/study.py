"""What the commands do, without a terminal: check a design, plan with it, fit readings to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from ballplate.simulator.design import Design, Readings, nominal_state, probe_offsets, unknown_lengths
from ballplate.simulator.estimation.covariance import Covariance, covariance, shared_covariance, spectrum
from ballplate.simulator.estimation.elimination import eliminate
from ballplate.simulator.estimation.gauss_newton import Solution, estimate, fitted_covariance
from ballplate.simulator.estimation.observations import length_deviations, reading_blocks, reading_weights
from ballplate.simulator.estimation.parameters import SharedLayout, pose_parameter_names, shared_layout
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.experiment.yamltree import Mark
from ballplate.simulator.geometry.motions import vector_from_rotation
from ballplate.simulator.layout import lay_out
from ballplate.simulator.machines.protocol import Array, Unit
from ballplate.simulator.machines.spatial_metric import SpatialMetricModel
from ballplate.simulator.readings import ObservedReadings
from ballplate.simulator.rounding import comparable
from ballplate.simulator.threads import single_threaded

from .adjustments import Adjustment, adjustments, few_degrees_of_freedom
from .gross_errors.search import diagnosis
from .gross_errors.suspects import Diagnosis
from .plates import PlateCoordinates, plate_coordinates
from .rank import Verdict, verdict
from .result import Result
from .scale import Scale, scale_of
from .tasks import TaskUncertainty, task_uncertainties
from .uncertainty import Quantity, length_uncertainties, uncertainties

if TYPE_CHECKING:
    from .montecarlo.study import Trials

# Residuals that a fit names.
LARGEST = 10


@dataclass(frozen=True, repr=False)
class Plan(Result):
    """Predicted uncertainties of a design: the verdict on its rank, and U1 to U6 and tasks if they were asked for.

    `lengths` is U6 in any case, None without evaluation points, and `scale` what carries scale, if that was asked for
    and is determined. `monte_carlo` has replicates, if they were asked for.
    """

    label: str
    title: str
    design: Design
    verdict: Verdict
    quantities: dict[str, Quantity]
    tasks: tuple[TaskUncertainty, ...] = ()
    lengths: Quantity | None = None
    scale: Scale | None = None
    monte_carlo: Trials | None = None

    def headline(self) -> str:
        return ", ".join([rank_words(self.verdict), *_uncertainty_words(self.quantities)])

    def lines(self) -> list[str]:
        from .montecarlo.tables import trials_lines
        from .tables import plan_lines

        return plan_lines(self) + ([] if self.monte_carlo is None else ["", *trials_lines(self.monte_carlo)])

    def to_dict(self) -> dict[str, Any]:
        from .montecarlo.tables import trials_data
        from .tables import plan_data

        replicates = {} if self.monte_carlo is None else {"monte_carlo": trials_data(self.monte_carlo)}
        return plan_data(self) | replicates

    def rows(self) -> list[dict[str, Any]]:
        """One row for each of U1 to U6."""
        return [{"symbol": symbol, **quantity_row(quantity)} for symbol, quantity in self.quantities.items()]


def rank_words(judged: Verdict) -> str:
    """The rank in two words."""
    return f"rank deficiency {judged.deficiency}" if judged.deficiency else "full rank"


def quantity_row(quantity: Quantity) -> dict[str, Any]:
    """A quantity as the row of a table, in its own unit."""
    return {
        "standard uncertainty of": quantity.description,
        "maximum": quantity.maximum,
        "average": quantity.average,
        "unit": quantity.unit,
        "count": quantity.count,
        "undetermined": quantity.undetermined,
        "largest at": quantity.largest,
    }


def _uncertainty_words(quantities: dict[str, Quantity]) -> list[str]:
    lengths = quantities.get("U6")
    if lengths is None or np.isnan(lengths.average):
        return []
    return [f"U6 {1e6 * lengths.average:.3g} um on average, {1e6 * lengths.maximum:.3g} um at most"]


@dataclass(frozen=True)
class Worth:
    """Uncertainties alone, for searches that judge many designs: rank deficiency, U1 to U6 and tasks as in a plan."""

    deficiency: int
    quantities: dict[str, Quantity]
    tasks: tuple[TaskUncertainty, ...]


ParameterKind = Literal["machine", "origin", "rotation", "offset", "length", "ball"]


@dataclass(frozen=True)
class ParameterEstimate:
    """One estimated parameter; the standard uncertainty is NaN, and so the value, where it is undetermined.

    `kind` says what it is of: the machine, origin or rotation of a pose, a probe's offset, a standard's length, a ball.
    """

    name: str
    value: float
    standard_uncertainty: float
    unit: Unit
    kind: ParameterKind = "machine"


@dataclass(frozen=True)
class Residual:
    """What a reading of a plate differs by from the estimate along one axis, in metres and in its uncertainties.

    Of a length standard the length, as `axis`, is too long by so much; its uncertainty includes the certificate's.
    """

    position: str
    ball: str
    probe: str
    axis: str
    value: float
    standardised: float


@dataclass(frozen=True, repr=False)
class Fit(Result):
    """An estimate from readings; without quantities and estimates, and the design judged as drawn, if it has failed.

    `sigma` multiplies all stated uncertainties: estimated from the residuals as the root of S^2 over the degrees of
    freedom, or 1 where the file says that they are given. `adjustments` are those of a three-dimensional metric.
    `diagnosis` is what the residuals make suspect, which nothing else here heeds; `marks` tell where readings stand.
    """

    label: str
    title: str
    design: Design
    solution: Solution
    verdict: Verdict
    sigma: float
    sigma_is_estimated: bool
    degrees_of_freedom: int
    quantities: dict[str, Quantity]
    estimates: tuple[ParameterEstimate, ...]
    largest: tuple[Residual, ...]
    plates: tuple[PlateCoordinates, ...] = ()
    adjustments: tuple[Adjustment, ...] = ()
    tasks: tuple[TaskUncertainty, ...] = ()
    diagnosis: Diagnosis = Diagnosis()
    marks: tuple[Mark, ...] = ()

    def headline(self) -> str:
        if not self.converged:
            return f"the estimate has {self.solution.status}"
        return ", ".join([rank_words(self.verdict), f"sigma {self.sigma:.3g}", *_uncertainty_words(self.quantities)])

    def lines(self) -> list[str]:
        from .tables import fit_lines

        return fit_lines(self)

    def to_dict(self) -> dict[str, Any]:
        from .tables import fit_data

        return fit_data(self)

    def rows(self) -> list[dict[str, Any]]:
        """One row for each parameter."""
        return [
            {
                "parameter": one.name,
                "kind": one.kind,
                "value": one.value,
                "standard uncertainty": one.standard_uncertainty,
                "unit": one.unit,
            }
            for one in self.estimates
        ]

    @property
    def converged(self) -> bool:
        return self.solution.status == "converged"

    @property
    def doubt(self) -> str:
        """What is to be said of sigma where it comes from few degrees of freedom; otherwise empty."""
        if not self.sigma_is_estimated:
            return ""
        return few_degrees_of_freedom(
            self.degrees_of_freedom, "sigma", "--sigma given takes the uncertainties as stated"
        )

    @property
    def too_large(self) -> bool:
        """Whether S^2 is larger than the stated uncertainties explain, by a test that errs once in a thousand."""
        from scipy.special import chdtri

        if not self.converged or self.degrees_of_freedom <= 0:
            return False
        return self.solution.factor.sum_of_squares > float(chdtri(self.degrees_of_freedom, 1e-3))


def check(experiment: Experiment, design: Design | None = None, with_scale: bool = False) -> Plan:
    """Judge the rank of an experiment's design, or of what came of it, at zero machine error."""
    return _plan(experiment, design or lay_out(experiment), False, with_scale)


def plan(experiment: Experiment, with_scale: bool = False) -> Plan:
    """Rank verdict and U1 to U6 of an experiment's design at zero machine error."""
    return _plan(experiment, lay_out(experiment), True, with_scale)


@single_threaded
def worth(experiment: Experiment) -> Worth:
    """What `plan` finds, less the explanation of the rank, which takes most of its time."""
    design = lay_out(experiment)
    layout, state = shared_layout(design), nominal_state(design)
    factor = eliminate(design, layout, state)
    found = spectrum(factor)
    spread = covariance(design, factor, found)
    quantities = uncertainties(design, layout, state, spread, target=experiment.target_accuracy)
    return Worth(found.deficiency, quantities, task_uncertainties(design, layout, state, spread))


@single_threaded
def _plan(experiment: Experiment, design: Design, with_quantities: bool, with_scale: bool) -> Plan:
    layout, state = shared_layout(design), nominal_state(design)
    factor = eliminate(design, layout, state)
    found = spectrum(factor)
    spread = (
        covariance(design, factor, found) if with_quantities or found.deficiency else shared_covariance(design, found)
    )
    judged = verdict(design, layout, found, spread, experiment.expected_rank_deficiency, experiment.target_accuracy)
    quantities: dict[str, Quantity] = {}
    tasks: tuple[TaskUncertainty, ...] = ()
    if with_quantities:
        quantities = uncertainties(design, layout, state, spread, target=experiment.target_accuracy)
        tasks = task_uncertainties(design, layout, state, spread)
        lengths = quantities.get("U6")
    else:
        lengths = length_uncertainties(design, layout, state, spread, experiment.target_accuracy)
    scale = scale_of(experiment, design, layout, state, spread) if with_scale else None
    return Plan(experiment.label, experiment.title, design, judged, quantities, tasks, lengths, scale)


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
    layout = shared_layout(design)
    solution = estimate(design, observed.x)
    if solution.status != "converged":
        judged = check(experiment, design).verdict
        return Fit(experiment.label, experiment.title, design, solution, judged, 1.0, False, 0, {}, (), ())
    spread = fitted_covariance(design, solution)
    judged = verdict(
        design, layout, solution.spectrum, spread, experiment.expected_rank_deficiency, experiment.target_accuracy
    )
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
        uncertainties(design, layout, solution.state, spread, scale, experiment.target_accuracy),
        _estimates(design, layout, solution, spread, scale, monomials),
        _largest(design, solution, observed.x),
        plate_coordinates(experiment, design, solution.state, spread, scale),
        _adjustments(design, layout, solution, spread, scale, freedom if estimated else np.inf),
        task_uncertainties(design, layout, solution.state, spread, scale),
        diagnosis(design, solution, observed.x, freedom, estimated),
        observed.marks,
    )


def reading_residuals(design: Design, solution: Solution, x: Array) -> tuple[Readings, Array, Array]:
    """Readings of plates, with what each differs by from the estimate, (m, d) metres and in standard uncertainties."""
    chosen = design.plate_readings
    readings = design.readings.select(chosen)
    standardised = reading_blocks(design, solution.state, readings, x[chosen]).residual
    return readings, standardised / reading_weights(design, readings), standardised


def _adjustments(
    design: Design, layout: SharedLayout, solution: Solution, spread: Covariance, sigma: float, freedom: float
) -> tuple[Adjustment, ...]:
    if not isinstance(design.model, SpatialMetricModel):
        return ()
    of_model = layout.model
    return adjustments(solution.state.a, sigma * spread.shared[of_model], spread.shared_null[of_model], freedom)


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


def _estimates(
    design: Design, layout: SharedLayout, solution: Solution, spread: Covariance, sigma: float, monomials: bool
) -> tuple[ParameterEstimate, ...]:
    found: list[ParameterEstimate] = []

    def add(kind: ParameterKind, name: str, value: float, uncertainty: float, unit: Unit) -> None:
        known = not np.isnan(uncertainty)
        found.append(ParameterEstimate(name, float(value) if known else np.nan, float(sigma * uncertainty), unit, kind))

    state = solution.state
    own = np.eye(len(layout))
    matrix, names, units = own[layout.model], [p.name for p in design.model.parameters], None
    if monomials:
        reported = design.model.reported()
        matrix, names, units = reported.matrix @ matrix, list(reported.names), reported.units
    values = (reported.matrix if monomials else np.eye(len(state.a))) @ state.a
    for k, uncertainty in enumerate(spread.of_shared(matrix)):
        add("machine", names[k], values[k], uncertainty, units[k] if units else design.model.parameters[k].unit)

    of_poses = spread.of_shared(own[layout.poses])
    turned = vector_from_rotation(state.rotations @ design.rotations.transpose(0, 2, 1))
    poses = np.concatenate([state.origins, turned], axis=1)
    words = pose_parameter_names(design.dimension)
    for k in design.posed_positions:
        for j, column in enumerate(layout.pose_columns[k]):
            if column >= 0:
                kind: ParameterKind = "origin" if j < design.dimension else "rotation"
                unit: Unit = "m" if kind == "origin" else "rad"
                add(kind, f"{design.position_names[k]}: {words[j]}", poses[k, j], of_poses[column], unit)

    of_offsets = spread.of_shared(own[layout.offsets])
    for probe, axis in np.argwhere(layout.offset_columns >= 0):
        column = layout.offset_columns[probe, axis]
        value = probe_offsets(design, state)[probe, axis]
        add("offset", layout.parameters[column].name, value, of_offsets[column - layout.model.stop], "m")

    of_lengths = spread.of_shared(own[layout.lengths])
    for name, value, uncertainty in zip(design.length_names, unknown_lengths(design, state), of_lengths, strict=True):
        add("length", name, value, uncertainty, "m")

    of_balls = spread.of_balls()
    for ball in design.plate_balls:
        for axis, letter in enumerate(("x", "y", "z")[: design.dimension]):
            name = f"{design.ball_label(ball)}: {letter}"
            add("ball", name, state.balls[ball, axis], of_balls[ball, axis], "m")
    return tuple(found)
