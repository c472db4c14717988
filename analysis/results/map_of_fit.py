"""The map that a fit leaves behind."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.influences.temperature import (
    ARTEFACT_COLUMN,
    AXIS_COLUMNS,
    SCALES_COLUMN,
    TemperaturesSettings,
)
from ballplate.simulator.design.objects import Probes
from ballplate.simulator.experiment.model_files import absolute
from ballplate.simulator.inputs.days import parse_day
from ballplate.simulator.inputs.settings import listing, number_of
from ballplate.simulator.inputs.yamltree import to_python, written
from ballplate.simulator.maps.fit_verdict import LackOfFit
from ballplate.simulator.maps.fitted_map import (
    CONVERSION,
    FittedMap,
    LeftOut,
    MapData,
    determined_only,
)
from ballplate.simulator.readings.observed_readings import ObservedReadings
from ballplate.simulator.readings.readings_in_common import (
    fingerprint,
    position_fingerprints,
)

from ..presentation.formatting import number
from .estimates import ParameterEstimate

if TYPE_CHECKING:
    from ballplate.simulator.experiment.model import Experiment

    from .estimates import EstimatedFunctions

# What expanded uncertainties have where the experiment does not say.
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


class MappedFit(Protocol):
    """What a map is made of: a fit of an experiment, see `Fit`."""

    @property
    def label(self) -> str: ...
    @property
    def experiment(self) -> Experiment | None: ...
    @property
    def observed(self) -> ObservedReadings: ...
    @property
    def sigma(self) -> float: ...
    @property
    def sigma_is_estimated(self) -> bool: ...
    @property
    def degrees_of_freedom(self) -> int: ...
    @property
    def sum_of_squares(self) -> float: ...
    @property
    def lack_of_fit(self) -> LackOfFit: ...
    @property
    def estimates(self) -> tuple[ParameterEstimate, ...]: ...
    @property
    def functions(self) -> EstimatedFunctions: ...


@single_threaded
def map_of(fit: MappedFit, date: str | None = None) -> FittedMap:
    """The machine's errors, the estimated offsets of probes and their joint covariance, of a fit
    that has converged.

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
    stated = written(experiment.tree, "error_model")
    settings = {} if stated is None else to_python(stated)
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
        frame=FRAMES[experiment.error_model.kind],
        temperatures=_temperatures(fit.observed, experiment),
        left_out=tuple(_left_out(one) for one in fit.estimates if one.kind == "influence"),
        data=data_of(fit.observed, experiment),
        lack_of_fit=fit.lack_of_fit,
        experiment=fit.label,
        program=f"ballplate {version('ballplate')}",
        date=date,
        # Of separate sigmas that of these readings, with the fewest degrees of freedom of all.
        sum_of_squares=(
            fit.sigma**2 * fit.degrees_of_freedom if fit.sigma_is_estimated else fit.sum_of_squares
        ),
    )


def _left_out(one: ParameterEstimate) -> LeftOut:
    is_known = bool(np.isfinite(one.standard_uncertainty))
    value, uncertainty = (one.value, one.standard_uncertainty) if is_known else (None, None)
    return LeftOut(one.name, one.kind, one.unit, value, uncertainty)


def data_of(observed: ObservedReadings, experiment: Experiment | None = None) -> MapData:
    """What the readings say, however they were written, with those of maps that the experiment has
    as prior knowledge.
    """
    own = position_fingerprints(observed).values()
    earlier = (one for known in maps_known(experiment) for one in known.positions)
    positions = tuple(sorted({*own, *earlier}))
    return MapData(len(observed.design.readings), fingerprint(observed), positions)


def maps_known(experiment: Experiment | None) -> set[MapData]:
    """The readings of maps that are prior knowledge in an experiment."""
    priors = () if experiment is None else experiment.priors
    return {one.data for one in priors if one.data is not None}


def counted_twice(experiment: Experiment | None, observed: ObservedReadings) -> tuple[str, ...]:
    """Positions whose readings are fitted, and known by a map that is prior knowledge as well."""
    known = maps_known(experiment)
    if not known:
        return ()
    prints = position_fingerprints(observed)
    if any(one.sha256 == fingerprint(observed) for one in known):
        return tuple(prints)
    every = {digest for one in known for digest in one.positions}
    return tuple(name for name, digest in prints.items() if digest in every)


def _temperatures(observed: ObservedReadings, experiment: Experiment) -> dict[str, float] | None:
    """The reference temperature, and the mean ones of scales and artefacts over readings that have
    them, or else over positions, where they are stated.
    """
    stated = [one for one in experiment.influences if isinstance(one, TemperaturesSettings)]
    if not stated:
        return None
    found = {"reference": stated[0].reference}
    beside = observed.design.readings.beside or {}
    for word, columns in (
        ("scales", (*AXIS_COLUMNS, SCALES_COLUMN)),
        ("artefact", (ARTEFACT_COLUMN,)),
    ):
        values = [one[np.isfinite(one)] for name, one in beside.items() if name in columns]
        if not sum(map(len, values)):
            values = [
                np.atleast_1d(value)
                for one in stated
                for value in _by_position(one, word, observed.design.positions.names)
            ]
        if values:
            found[word] = float(np.concatenate(values).mean())
    return found


def _by_position(stated: TemperaturesSettings, word: str, positions: Sequence[str]) -> list[Any]:
    """Temperatures of scales or artefacts in each position, none where none are stated."""
    measured = stated.scale_temperature if word == "scales" else stated.artefact_temperature
    if measured is None:
        return []
    own = stated.positions or {}
    of_positions = [getattr(own.get(name), word, None) for name in positions]
    return [measured.value if one is None else one for one in of_positions]


def left_out_words(fitted: FittedMap) -> str:
    """Which estimates of the fit a map does not apply, and what its conversion has changed."""
    residual = fitted.conversion_residual
    words = []
    if residual is not None:
        told = (
            f"corrected points differ by up to {number(1e6 * residual, 3)} µm from those of the map"
            " before, which U does not contain"
            if residual
            else "coefficients that the model before did not have are as it implies, and were not"
            " estimated from readings"
        )
        words.append(f"the map was converted from another error model: {told}")
    campaign = [one.name for one in fitted.left_out if one.kind != CONVERSION]
    if campaign:
        words.append(_of_campaign(campaign))
    return "; ".join(words)


def _of_campaign(estimated: Sequence[str]) -> str:
    names, count = listing(estimated, 4), len(estimated)
    return (
        f"{number_of(count, 'parameter')} of influence quantities that the fit estimated"
        f" {'are' if count > 1 else 'is'} not applied, as they belong to the campaign: {names};"
        " correct for these beforehand where they matter"
    )
