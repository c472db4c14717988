"""The work of the commands without a terminal: check, prediction and fit of a design."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.extensions import service
from ballplate.simulator.inputs.messages import refused
from ballplate.simulator.machines.error_names import SquarenessError
from ballplate.simulator.machines.kinematic import KinematicModel
from ballplate.simulator.machines.plane import PlaneModel
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.machines.spatial_metric import SpatialMetricModel

from ..rank.verdicts import verdict
from ..uncertainty.scale import scale_of
from ..uncertainty.summaries import Quantity, tasks_of, uncertainties
from ..uncertainty.tasks import TaskUncertainty
from .adjustments import Adjustment, adjustments
from .groupings import Grouping
from .influences import influence_uncertainties
from .prediction import Prediction

if TYPE_CHECKING:
    from ballplate.simulator.readings.observed_readings import ObservedReadings

    from .fits import Fit
    from .sigmas_by_campaign import CampaignSigmas


@dataclass(frozen=True)
class PlannedUncertainty:
    """Uncertainties alone, for searches that judge many designs: rank deficiency and quantities,
    the measuring tasks among them.
    """

    deficiency: int
    quantities: dict[str, Quantity]

    @property
    def tasks(self) -> tuple[TaskUncertainty, ...]:
        return tasks_of(self.quantities)


def check(
    experiment: Experiment, design: Design | None = None, with_scale: bool = False
) -> Prediction:
    """Judge the rank of an experiment's design, or of what came of it, at zero machine error."""
    return _predict(experiment, design or lay_out(experiment), False, with_scale)


def predict(experiment: Experiment, with_scale: bool = False) -> Prediction:
    """Rank verdict and U1 to U6 of an experiment's design at zero machine error."""
    return _predict(experiment, lay_out(experiment), True, with_scale)


@single_threaded
def planned_uncertainty(experiment: Experiment) -> PlannedUncertainty:
    """What `predict` finds, less the explanation of the rank, which takes most of its time."""
    at = linearise(lay_out(experiment))
    found = uncertainties(at, target=experiment.target_uncertainty)
    return PlannedUncertainty(at.deficiency, found)


@single_threaded
def _predict(
    experiment: Experiment, design: Design, with_quantities: bool, with_scale: bool
) -> Prediction:
    at, target = linearise(design), experiment.target_uncertainty
    judged = verdict(at, experiment.expected_rank_deficiency, target)
    quantities: dict[str, Quantity] = {}
    if with_quantities:
        quantities = uncertainties(at, target=target)
        lengths = quantities.get("U6")
    else:
        lengths = uncertainties(at, target=target, symbols=("U6",)).get("U6")
    scale = scale_of(experiment, at) if with_scale else None
    return Prediction(
        experiment.label,
        experiment.title,
        design,
        judged,
        quantities,
        lengths,
        scale,
        influences=influence_uncertainties(at) if with_quantities else (),
        experiment=experiment,
    )


# In one piece: an estimate is judged step by step, each from those before it.
@single_threaded
def fit(
    experiment: Experiment,
    observed: ObservedReadings,
    sigma: Literal["estimated", "given"] | None = None,
    monomials: bool = False,
    components: Grouping | None = None,
    reweight: bool = False,
) -> Fit:
    """Estimate machine errors, balls and poses from readings.

    `sigma` overrides what the file says; with `monomials` the machine's parameters are reported as
    the coefficients of t, t^2, ... on [0, 1] instead of in the stable basis. With `components` the
    variances of such groups of observations are estimated as well; with `reweight` they take the
    place of those stated, and sigma is 1.

    :raises ExperimentError: variance components take more memory than there is.
    """
    # Loaded only now, so that what plans and checks need not load answers sooner.
    from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit

    from ..gross_errors.refits import diagnosis_with_refits
    from ..gross_errors.remainders import too_many_entries
    from ..gross_errors.suspects import Diagnosis
    from .estimates import estimated_functions, parameter_estimates
    from .fits import Fit, lack_of_fit
    from .observation_groups import groups_of, reweighted
    from .plates import plate_coordinates
    from .residuals import largest_residuals
    from .sigmas_by_campaign import campaign_sigmas

    is_estimated = (sigma or experiment.sigma) == "estimated"
    campaigns = campaign_sigmas(experiment, observed) if is_estimated and not reweight else None
    observed = observed if campaigns is None else campaigns.observed
    design = observed.design
    solution = estimate(design, observed.x) if campaigns is None else campaigns.solution
    if solution.status != "converged":
        judged = check(experiment, design).verdict
        names = experiment.label, experiment.title
        return Fit(
            *names, observed, solution, judged, 1.0, False, 0, {}, (), (), experiment=experiment
        )
    at = linearised_fit(design, solution)
    own = at.degrees_of_freedom
    scale, estimated, freedom = _sigma(at, campaigns, is_estimated)
    untested, diagnosis = too_many_entries(design), Diagnosis()
    if not untested:
        diagnosis = diagnosis_with_refits(at, observed.x, own, estimated)
    found = None
    if components is not None:
        found = _variance_components(experiment, at, observed.x, components)
    if found is not None and reweight:
        groups = groups_of(design, components or "axis")
        observed = replace(observed, design=reweighted(design, groups, np.array(found.weighting)))
        anew = fit(experiment, observed, "given", monomials)
        squares = solution.factor.sum_of_squares
        return replace(
            anew,
            variance_components=found,
            is_reweighted=True,
            before_reweighting=lack_of_fit(squares, own, diagnosis, untested),
        )
    judged = verdict(at, experiment.expected_rank_deficiency, experiment.target_uncertainty)
    functions = estimated_functions(at, monomials)
    return Fit(
        experiment.label,
        experiment.title,
        observed,
        solution,
        judged,
        scale,
        estimated,
        freedom,
        uncertainties(at, scale, experiment.target_uncertainty),
        parameter_estimates(functions, scale),
        largest_residuals(design, solution, observed.x),
        plate_coordinates(experiment, at, scale),
        _adjustments(at, scale, freedom if estimated else np.inf),
        diagnosis,
        untested,
        functions,
        found,
        experiment=experiment,
        campaigns=campaigns,
    )


def _sigma(
    at: Linearisation, campaigns: CampaignSigmas | None, is_estimated: bool
) -> tuple[float, bool, int]:
    """Sigma, whether it is estimated, and the degrees of freedom of uncertainties."""
    squares, freedom = at.factor.sum_of_squares, at.degrees_of_freedom
    if campaigns is not None:
        squares, freedom = campaigns.sum_of_squares, campaigns.freedom
    estimated = is_estimated and freedom > 0
    sigma = float(np.sqrt(squares / freedom)) if estimated else 1.0
    return sigma, estimated, freedom if campaigns is None else campaigns.degrees_of_freedom


def _variance_components(experiment: Experiment, at: Linearisation, x: Array, by: Grouping) -> Any:
    try:
        return service("variance_components")(experiment.label, experiment.title, at, x, by)
    except ValueError as error:
        raise refused(experiment.source, str(error), "positions") from None


def _adjustments(at: Linearisation, sigma: float, freedom: float) -> tuple[Adjustment, ...]:
    model, of_model = at.design.model, at.layout.model
    spread, null = sigma * at.shared[of_model], at.shared_null[of_model]
    if isinstance(model, SpatialMetricModel):
        return adjustments(at.state.a, spread, null, freedom)
    chain = model.spatial if isinstance(model, PlaneModel) else model
    if not isinstance(chain, KinematicModel) or chain.arrangement.workpiece_side:
        # On the workpiece's side an axis's rotations turn its own line as well.
        return ()
    square = [f.error for f in chain.functions if isinstance(f.error, SquarenessError)]
    if not square:
        return ()
    own = [chain.slices[error.name].start for error in square]
    return adjustments(at.state.a[own], spread[own], null[own], freedom, square)
