"""Fit of a design to readings."""

from __future__ import annotations

from typing import Literal

import numpy as np
from ballplate.rank.verdicts import verdict
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.extensions import service
from ballplate.simulator.machines.arrangement import SquarenessError
from ballplate.simulator.machines.kinematic import KinematicModel, PlaneModel
from ballplate.simulator.machines.metric import SpatialMetricModel
from ballplate.simulator.readings.observed_readings import ObservedReadings
from ballplate.uncertainty.summaries import uncertainties

from .adjustments import Adjustment, adjusted
from .estimates import estimated_functions, parameter_estimates
from .extension_results import SeparateSigmas, diagnosed
from .fits import Fit
from .plates import plate_coordinates
from .prediction import check
from .residuals import largest_residuals


# In one piece: each step of judging an estimate needs those before.
@single_threaded
def fit(
    experiment: Experiment,
    observed: ObservedReadings,
    sigma: Literal["estimated", "given"] | None = None,
    monomials: bool = False,
) -> Fit:
    """Estimate machine errors, balls and poses from readings.

    `sigma` overrides the file's; with `monomials` the machine's parameters are the coefficients of
    t, t^2, ... on [0, 1] instead of those of the stable basis.
    """
    is_estimated = (sigma or experiment.sigma) == "estimated"
    campaigns: SeparateSigmas | None = None
    if is_estimated and experiment.earlier_campaigns:
        campaigns = service("campaign_sigmas")(experiment, observed)
    observed = observed if campaigns is None else campaigns.observed
    design = observed.design
    solution = estimate(design, observed.x) if campaigns is None else campaigns.solution
    if solution.status != "converged":
        # Without an estimate there is no linearisation of the fit: the result has sigma as stated
        # and empty tables. The rank is that of the nominal design with the readings that were made.
        judged = check(experiment, design).verdict
        names = experiment.label, experiment.title
        return Fit(
            *names, observed, solution, judged, 1.0, False, 0, {}, (), (), experiment=experiment
        )
    at = linearised_fit(design, solution)
    sigma_used, estimated, freedom = _sigma(at, campaigns, is_estimated)
    diagnosis, untested = diagnosed(at, observed.x, estimated, observed.marks)
    judged = verdict(at, experiment.expected_rank_deficiency, experiment.target_uncertainty)
    functions = estimated_functions(at, monomials)
    return Fit(
        experiment.label,
        experiment.title,
        observed,
        solution,
        judged,
        sigma_used,
        estimated,
        freedom,
        uncertainties(at, sigma_used, experiment.target_uncertainty),
        parameter_estimates(functions, sigma_used),
        largest_residuals(design, solution, observed.x),
        plate_coordinates(experiment, at, sigma_used),
        _adjustments(at, sigma_used, freedom if estimated else np.inf),
        diagnosis,
        untested,
        functions,
        experiment=experiment,
        campaigns=campaigns,
    )


def _sigma(
    at: Linearisation, campaigns: SeparateSigmas | None, is_estimated: bool
) -> tuple[float, bool, int]:
    """Return sigma, whether it is estimated, and the degrees of freedom of uncertainties."""
    squares, freedom = at.factor.sum_of_squares, at.degrees_of_freedom
    if campaigns is not None:
        squares, freedom = campaigns.sum_of_squares, campaigns.freedom
    # Without degrees of freedom there are no residuals to estimate sigma from, and uncertainties
    # are taken as stated.
    estimated = is_estimated and freedom > 0
    sigma = float(np.sqrt(squares / freedom)) if estimated else 1.0
    return sigma, estimated, freedom if campaigns is None else campaigns.degrees_of_freedom


def _adjustments(at: Linearisation, sigma: float, freedom: float) -> tuple[Adjustment, ...]:
    model, of_model = at.design.model, at.layout.model
    spread, null = sigma * at.shared[of_model], at.shared_null[of_model]
    if isinstance(model, SpatialMetricModel):
        return adjusted(at.state.a, spread, null, freedom)
    chain = model.spatial if isinstance(model, PlaneModel) else model
    if not isinstance(chain, KinematicModel) or chain.arrangement.workpiece_side:
        # On the workpiece's side an axis's rotations turn its own line as well.
        return ()
    square = [f.error for f in chain.functions if isinstance(f.error, SquarenessError)]
    if not square:
        return ()
    columns = [chain.slices[error.name].start for error in square]
    return adjusted(at.state.a[columns], spread[columns], null[columns], freedom, square)
