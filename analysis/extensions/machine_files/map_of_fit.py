"""Error map of a fit."""

from __future__ import annotations

from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np
from ballplate.results import Fit, ParameterEstimate
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Probes
from ballplate.simulator.experiment import MapData
from ballplate.simulator.inputs import listing, number_of, parse_day, service, to_python, written
from ballplate.simulator.readings import ObservedReadings, fingerprint, position_fingerprints

from .fitted_map import FittedMap, LeftOut, determined_only
from .model_files import absolute

if TYPE_CHECKING:
    from ballplate.simulator.experiment import Experiment

# Coverage factor of experiments that state none.
COVERAGE_FACTOR = 2.0

_AXES_FIXED = (
    "errors are zero at the lower corner of the volume, and straightnesses EYX, EZX and EZY at the"
    " other end of their axis too"
)
FRAMES = {
    "kinematic": _AXES_FIXED,
    "machine": _AXES_FIXED,
    "empirical": (
        "six displacements and three rotations of the probe are zero at corners of the volume"
    ),
    "metric": "the x axis is that of the machine, and the y axis lies in its plane of x and y",
    "python": "that of the model itself",
}


@single_threaded
def map_of(fit: Fit, date: str | None = None) -> FittedMap:
    """Return the machine's errors and estimated probe offsets with their joint covariance.

    :raises ValueError: the estimate has not converged, or the `date` names no day.
    """
    if date is not None:
        parse_day(date)
    at, experiment = fit.functions.at, fit.experiment
    assert experiment is not None
    design, layout, state = at.design, at.layout, at.state
    offsets = layout.offset_columns[design.probes.free]
    columns = np.concatenate([np.arange(len(layout))[layout.model], offsets])
    root = fit.sigma * at.shared[columns]
    scale = layout.scale[columns]
    model_node = written(experiment.tree, "error_model")
    settings = {} if model_node is None else to_python(model_node)
    factor = written(experiment.tree, "coverage_factor")
    return FittedMap(
        title=experiment.title,
        model=design.model,
        settings=absolute(settings, experiment.source.parent),
        volume=design.machine.volume,
        values=state.a,
        probes=Probes(design.probes.names, state.probes, design.probes.free),
        drawn_offsets=design.probes.offsets,
        probe=design.probes.names[design.evaluation.probe],
        covariance=0.5 * (root @ root.T + (root @ root.T).T),
        undetermined=determined_only(at.shared_null[columns], scale),
        sigma=fit.sigma,
        sigma_is_estimated=fit.sigma_is_estimated,
        degrees_of_freedom=fit.degrees_of_freedom,
        repeatability=design.machine.repeatability,
        coverage_factor=COVERAGE_FACTOR if factor is None else experiment.coverage_factor,
        frame=FRAMES.get(experiment.error_model.kind, ""),
        temperatures=(
            service("campaign_temperatures")(experiment.influences, design)
            if experiment.influences
            else None
        ),
        left_out=tuple(
            _left_out(estimate) for estimate in fit.estimates if estimate.kind == "influence"
        ),
        data=data_of(fit.observed, experiment),
        lack_of_fit=fit.lack_of_fit,
        experiment=fit.label,
        program=f"ballplate {version('ballplate')}",
        date=date,
        # From separate sigmas, that of these readings with the fewest degrees of freedom.
        sum_of_squares=(
            fit.sigma**2 * fit.degrees_of_freedom if fit.sigma_is_estimated else fit.sum_of_squares
        ),
    )


def _left_out(estimate: ParameterEstimate) -> LeftOut:
    is_known = bool(np.isfinite(estimate.standard_uncertainty))
    value, uncertainty = (
        (estimate.value, estimate.standard_uncertainty) if is_known else (None, None)
    )
    return LeftOut(estimate.name, estimate.kind, estimate.unit, value, uncertainty)


def data_of(observed: ObservedReadings, experiment: Experiment | None = None) -> MapData:
    """Return fingerprints of the readings, and of those of the experiment's prior maps."""
    fingerprints = position_fingerprints(observed).values()
    earlier = (digest for data in maps_known(experiment) for digest in data.positions)
    positions = tuple(sorted({*fingerprints, *earlier}))
    return MapData(len(observed.design.readings), fingerprint(observed), positions)


def maps_known(experiment: Experiment | None) -> set[MapData]:
    """Return the readings' data of prior maps."""
    priors = () if experiment is None else experiment.priors
    return {prior.data for prior in priors if prior.data is not None}


def counted_twice(experiment: Experiment | None, observed: ObservedReadings) -> tuple[str, ...]:
    """Return positions whose readings are both fitted and in a prior map."""
    prior_data = maps_known(experiment)
    if not prior_data:
        return ()
    prints = position_fingerprints(observed)
    if any(data.sha256 == fingerprint(observed) for data in prior_data):
        return tuple(prints)
    prior_digests = {digest for data in prior_data for digest in data.positions}
    return tuple(name for name, digest in prints.items() if digest in prior_digests)


def left_out_words(fitted: FittedMap) -> str:
    """Return the estimates of the fit that a map does not apply."""
    estimated = [estimate.name for estimate in fitted.left_out]
    names, count = listing(estimated, 4), len(estimated)
    return (
        f"{number_of(count, 'parameter')} of influence quantities that the fit estimated"
        f" {'are' if count > 1 else 'is'} not applied, as they belong to the campaign: {names};"
        " correct for these beforehand if needed"
    )
