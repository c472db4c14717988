"""Maps of other campaigns as prior knowledge of the machine."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date

import numpy as np
from ballplate.simulator.design import Machine, Volume
from ballplate.simulator.experiment import MapPriorSettings, MapShare, Prior, Probe, References
from ballplate.simulator.geometry import even_grid
from ballplate.simulator.inputs import (
    ExperimentError,
    Steps,
    format_path,
    listing,
    mark_of,
    parse_day,
)
from ballplate.simulator.machines import Array, ErrorModel

from .fitted_map import FittedMap
from .map_combinations import campaign_of, determined_combinations, marginal_of
from .map_files import read_map
from .volume_ends import check_within

YEAR = 365.25
# The same corrections, in metres, and in parts of them.
SAME, SAME_PART = 1e-12, 1e-9


def resolve_map_prior(
    settings: MapPriorSettings,
    steps: Steps,
    model: ErrorModel,
    machine: Machine,
    references: References,
    probes: Mapping[str, Probe],
) -> list[Prior]:
    """Return the information of another campaign's map as independent priors; faults go to the
    problems.

    These are the combinations of parameters in which the map's covariance is diagonal, each
    parameter scaled by its effect: as many as the map determines.
    """
    problems, of_file = references.problems, (*steps, "file")
    fitted = read_named(settings.file, of_file, references)
    years = None if fitted is None else _years(settings, fitted, steps, references)
    if fitted is None or years is None or not _is_same(fitted, model, machine, of_file, references):
        return []
    kept_indices = np.arange(len(fitted.values))
    free = [
        (name, axis)
        for k, name in enumerate(fitted.probes.names)
        for axis in range(fitted.dimension)
        if fitted.probes.free[k, axis]
    ]
    shared = [
        j
        for j, (name, axis) in enumerate(free)
        if settings.offsets and name in probes and probes[name].is_estimated
    ]
    kept_indices = np.concatenate([kept_indices, len(fitted.values) + np.array(shared, np.int64)])
    drift = (settings.drift_per_year or 0.0) * years
    combinations = determined_combinations(marginal_of(fitted, kept_indices))
    if fitted.without_scatter or not fitted.sigma > 0.0 or not (combinations[2] > 0.0).all():
        text = (
            "states no uncertainty, like a map of readings without noise; use the map of real"
            " readings"
        )
        problems.add(of_file, text)
        return []
    mark, campaign = mark_of(problems.root, of_file), campaign_of(fitted, settings.file)
    priors = []
    for k, (row, value, uncertainty) in enumerate(zip(*combinations, strict=True)):
        by_offset: dict[str, np.ndarray] = {}
        for coefficient, j in zip(row[len(fitted.values) :].tolist(), shared, strict=True):
            name, axis = free[j]
            by_offset.setdefault(name, np.zeros(fitted.dimension))[axis] = coefficient
        share = MapShare(campaign, settings.inflation * float(uncertainty) / fitted.sigma, drift)
        largest = int(np.abs(row * fitted.scale[kept_indices]).argmax())
        label = f"{settings.file}, combination {k + 1}, mostly"
        priors.append(
            Prior(
                f"{label} {fitted.parameters[int(kept_indices[largest])].name}",
                None,
                None,
                -1,
                row[: len(fitted.values)],
                float(value),
                share.uncertainty(fitted.sigma),
                mark,
                format_path(of_file),
                "m",
                by_offset or None,
                fitted.data,
                share,
            )
        )
    return priors


def read_named(file: str, steps: Steps, references: References) -> FittedMap | None:
    try:
        fitted = read_map(references.file(file), references.trust)
    except ExperimentError as error:
        references.problems.take(error, steps)
        return None
    if caution := fitted.lack_of_fit.caution:
        references.problems.doubt(steps, caution)
    return fitted


def _years(
    settings: MapPriorSettings, fitted: FittedMap, steps: Steps, references: References
) -> float | None:
    """Years between both campaigns, None after reporting faults."""
    if settings.drift_per_year is None:
        return 0.0
    if settings.years is not None:
        return settings.years
    problems = references.problems
    if settings.date is None:
        text = "needs the time between both campaigns; add date: 2027-05-22 or years: 0.5"
        problems.add((*steps, "drift_per_year"), text)
        return None
    if fitted.date is None:
        text = "the map states no date; give years: 0.5 instead of the date of this campaign"
        problems.add((*steps, "date"), text)
        return None
    start, end = parse_day(fitted.date), parse_day(settings.date)
    if end < start:
        problems.add((*steps, "date"), f"is before that of the map, {fitted.date}; correct it")
        return None
    return _between(start, end)


def _between(start: date, end: date) -> float:
    return (end - start).days / YEAR


def _is_same(
    fitted: FittedMap, model: ErrorModel, machine: Machine, steps: Steps, references: References
) -> bool:
    """True if a map is of the error model that is fitted here; others are reported."""
    add = references.problems.add
    if machine.dimension != fitted.dimension:
        add(steps, f"is of {fitted.dimension} axes, but machine.volume of {machine.dimension}")
        return False
    remedy = "make them the same"
    if not check_within(*fitted.volume.corners, machine, steps, references, remedy, is_same=True):
        return False
    model_parameters = [(parameter.name, parameter.unit) for parameter in model.parameters]
    map_parameters = [(parameter.name, parameter.unit) for parameter in fitted.model.parameters]
    if model_parameters != map_parameters:
        differ = [name for name, _ in set(model_parameters) ^ set(map_parameters)]
        text = (
            f"is of another error model (parameters differ: {listing(sorted(differ), 4)}); fit with"
            " the same model"
        )
        add(steps, text)
        return False
    there = _corner_corrections(fitted.model, fitted.values, fitted.volume)
    here = _corner_corrections(model, fitted.values, fitted.volume)
    if (np.abs(there - here) > SAME + SAME_PART * np.abs(there)).any():
        text = (
            "is of another error model, which has the same parameters and corrects otherwise; fit"
            " with the same model"
        )
        add(steps, text)
        return False
    return True


def _corner_corrections(model: ErrorModel, values: Array, volume: Volume) -> Array:
    """Corrections (2^d + 1, d) at the corners and the centre, with a probe of a tenth of the
    volume.
    """
    d = len(volume.lower)
    corners = even_grid(np.zeros(d), np.ones(d), [2] * d)
    points = volume.lower + volume.size * np.concatenate([corners, np.full((1, d), 0.5)])
    offsets = np.broadcast_to(0.1 * volume.size, points.shape)
    return np.asarray(model.error(points, values, offsets))
