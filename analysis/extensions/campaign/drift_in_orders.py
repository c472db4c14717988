"""Effects of drift on a campaign by reading order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from ballplate.planning import OrderName, RunSheet, in_time, without_drift
from ballplate.simulator.computing import evenly_spread, lstsq, single_threaded
from ballplate.simulator.design import (
    Design,
    DriftSettings,
    PointDriftSettings,
    ScaleDriftSettings,
)
from ballplate.simulator.estimation import Distances, LinearFunctions, linear_functions, linearise
from ballplate.simulator.experiment import Candidate, ChangeTimes, Experiment, lay_out
from ballplate.simulator.inputs import (
    QuantityError,
    parse_length_drift,
    parse_ratio_drift,
)
from ballplate.simulator.machines import Array
from ballplate.uncertainty import evaluation_points

# Evaluation points between which distances are looked at, at the most.
MOST_POINTS = 100


@dataclass(frozen=True)
class DriftSize:
    """Sizes of a drift: of the reference point, in metres per hour, and of the scales, per hour."""

    point: float = 1e-6
    scale: float = 1e-6


@dataclass(frozen=True)
class DriftEffect:
    """Effects of drift in a reading order that takes `seconds`, of which `change_seconds` are
    change-over.

    `of_point` and `of_scale` are the largest changes of a distance between corrected points, in
    metres, by unmodelled drifts of the stated size, along the worst axis for a point; NaN if a
    length standard is read, whose drift is not modelled. `without` is the mean uncertainty of the
    distances without drift, `estimated` that with drifts as free parameters, NaN if undetermined.
    """

    order: OrderName
    seconds: float
    change_seconds: float
    of_point: float
    of_scale: float
    without: float
    estimated: float


def parse_drift_size(texts: Sequence[str], experiment: Experiment) -> DriftSize:
    """Sizes of drifts as texts with units; without any those that the experiment states as standard
    uncertainties, else 1 um/h and 1 ppm/h.

    :raises QuantityError: a text is neither a length nor a ratio per time above zero.
    """
    size = DriftSize()
    for influence in experiment.influences:
        if isinstance(influence, DriftSettings):
            for name, drifting in (("point", influence.axes), ("scale", influence.scale)):
                every = drifting if isinstance(drifting, tuple) else (drifting,)
                stated_sizes = [
                    getattr(parameter, "standard_uncertainty", None) or 0.0 for parameter in every
                ]
                size = (
                    replace(size, **{name: max(stated_sizes)}) if max(stated_sizes) > 0.0 else size
                )
    for text in texts:
        size = replace(size, **drift_size(text))
    return size


def drift_size(text: str) -> dict[str, float]:
    """Size of a drift, of the point or of the scale.

    :raises QuantityError: it is neither a length nor a ratio per time above zero.

    >>> drift_size("0.5 um/h"), drift_size("0.2 ppm/h")
    ({'point': 5e-07}, {'scale': 2e-07})
    """
    try:
        sizes = {"scale": parse_ratio_drift(text)}
    except QuantityError:
        sizes = {"point": parse_length_drift(text)}
    if min(sizes.values()) <= 0.0:
        raise QuantityError(f'"{text}" must be above zero; write for example "0.5 um/h"')
    return sizes


def is_of_plates(experiment: Experiment, positions: Iterable[Candidate]) -> bool:
    return all(
        experiment.artefacts[position.item.artefact].role == "plate" for position in positions
    )


@single_threaded
def drift_effect(
    experiment: Experiment, name: OrderName, sheet: RunSheet, changes: ChangeTimes, size: DriftSize
) -> DriftEffect:
    """Return the effects of drifts of a size on an experiment in the order of a run sheet."""
    change = sum(step.change_seconds for step in sheet.steps)
    plain = without_drift(experiment)
    if (
        not is_of_plates(experiment, (step.candidate for step in sheet.steps))
        or len(experiment.evaluation.points) == 1
    ):
        return DriftEffect(name, sheet.seconds, change, *[float("nan")] * 4)
    effects = {
        is_drifting: effects_on_distances(
            lay_out(
                in_time(
                    replace(
                        plain, influences=(*plain.influences, _drift(size if is_drifting else None))
                    ),
                    sheet,
                    changes,
                )
            ),
            experiment.dimension + 1,
        )
        for is_drifting in (True, False)
    }
    uncertainty, bias, posterior = effects[True]
    spread = np.sqrt(uncertainty**2 - np.einsum("mi,ij,mj->m", bias, posterior, bias))
    scaled = np.abs(bias[np.isfinite(uncertainty)]) * np.array(
        [size.point] * (bias.shape[1] - 1) + [size.scale]
    )
    return DriftEffect(
        name,
        sheet.seconds,
        change,
        float(scaled[:, :-1].max(initial=0.0)),
        float(scaled[:, -1].max(initial=0.0)),
        float(spread.mean()),
        float(effects[False][0].mean()),
    )


def _drift(size: DriftSize | None) -> DriftSettings:
    """Drift of the point along each axis and of all scales, of unknown size or with these as prior
    uncertainties.
    """
    point, scale = (None, None) if size is None else (size.point, size.scale)
    return DriftSettings.model_construct(
        kind="drift",
        axes=PointDriftSettings.model_construct(standard_uncertainty=point),
        scale=ScaleDriftSettings.model_construct(standard_uncertainty=scale),
    )


def effects_on_distances(design: Design, p: int) -> tuple[Array, Array, Array]:
    """Return uncertainties (m,) of distances between evaluation points, their changes per unit of
    each of the last p influence parameters (m, p), and the covariance (p, p) of these parameters.
    """
    linearisation, every = linearise(design), evaluation_points(design)
    chosen = evenly_spread(len(every.points), MOST_POINTS)
    places = replace(every, points=every.points[chosen], probes=every.probes[chosen])
    functions = linear_functions(linearisation, Distances(places))
    drifts = LinearFunctions(
        np.eye(len(linearisation.layout))[linearisation.layout.influences][-p:]
    )
    covariance = linearisation.covariance(drifts, drifts)
    # With drifts e as parameters of any prior, cov(f, e) cov(e, e)^-1 is the change of functions
    # f per unit of drift that is fixed at a wrong value.
    bias = lstsq(covariance, linearisation.covariance(drifts, functions), rcond=1e-12)[0].T
    return linearisation.uncertainty(functions), np.asarray(bias, float), covariance
