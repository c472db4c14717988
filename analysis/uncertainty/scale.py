"""Sources of a design's scale: certificates, priors, probe offsets, or an error model that cannot
stretch.

Readings alone never determine it: machine, plates, poses and offsets that are all larger by the
same ratio give the same readings.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from ballplate.simulator.computing.numerics import lstsq
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.objects import Volume
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.functions import correction_rows
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.settings import listing
from ballplate.simulator.machines.protocol import ErrorModel

from .pairs import PairSummary
from .summaries import point_pairs

# Trial standard uncertainty of offsets (m) for designs whose scale rests on exact ones.
OFFSET_TRIAL = 1e-6
# Without a source, the uncertainty of scale increases by at least this factor.
CARRIES = 1.05
# Without exact offsets, the scale that rests on them is less certain by this factor.
RESTS = 3.0
# Relative residual of a stretched volume that an error model with a common scale may leave.
FOLLOWED = 1e-6
# Artefacts whose certificates are separate sources.
MOST_ARTEFACTS = 3


@dataclass(frozen=True)
class Carrier:
    """A source of scale; `without` is the relative standard uncertainty of scale without it.

    Infinite if the scale is then undetermined; None of the machine's own scales.
    """

    words: str
    without: float | None


@dataclass(frozen=True)
class Loosened:
    """Average and maximum U6, in metres, if exact probe offsets, except one, have a standard
    uncertainty.

    `before` is the average with exact offsets.
    """

    offset_uncertainty: float
    average: float
    maximum: float
    before: float


@dataclass(frozen=True)
class Scale:
    """The relative standard uncertainty of scale, and its sources, the most important first.

    Scale is the mean relative change of the distances between corrected points, weighted by their
    squares. `rests_on_offsets`: without exact probe offsets, it would be undetermined or at least
    three times as uncertain; `loosened` is U6 without them. If the error model cannot stretch the
    volume equally in all directions, the machine's own scales are a source, too.
    """

    uncertainty: float
    carriers: tuple[Carrier, ...]
    rests_on_offsets: bool = False
    loosened: Loosened | None = None


@single_threaded
def scale_of(experiment: Experiment, at: Linearisation) -> Scale | None:
    """Return the sources of a design's scale; None if it is undetermined or without evaluation
    points.
    """
    uncertainty = float(at.of_shared(scale_row(at)[None])[0])
    if np.isnan(uncertainty):
        return None
    stretches = can_stretch(at.design, at.state)
    # A source is what the scale is less certain without: each is left out in turn, and the design
    # linearised again. Where several carry the scale, each alone may be dispensable, and then all
    # are named.
    groups = list(_groups(experiment))
    if len(groups) == 1 and stretches:
        # Readings alone do not determine scale, so that this is the only source.
        carriers = [Carrier(groups[0][0], np.inf)]
    else:
        uncertainties = ((scale_uncertainty(reduced), words) for words, reduced in groups)
        sources = sorted(uncertainties, reverse=True)
        significant = [source for source in sources if source[0] > CARRIES * uncertainty]
        chosen = significant or (sources if stretches else [])
        carriers = [Carrier(words, remaining) for remaining, words in chosen]
    rests = any(
        carrier.words == EXACT_OFFSETS and (carrier.without or 0.0) > RESTS * uncertainty
        for carrier in carriers
    )
    loosened = _loosened(experiment, at) if rests else None
    if not stretches:
        carriers.append(Carrier(OWN_SCALES, None))
    return Scale(uncertainty, tuple(carriers), rests, loosened)


OWN_SCALES = "the machine's own scales, which the error model cannot change all alike"
EXACT_OFFSETS = "exact probe offsets"


def _groups(experiment: Experiment) -> Iterator[tuple[str, Experiment]]:
    """Yield possible sources of scale, each with the experiment without it."""
    names = list(dict.fromkeys(item.artefact for item in experiment.calibration))
    sets = [[name] for name in names] if len(names) <= MOST_ARTEFACTS else [names]
    for artefacts in sets:
        remaining = tuple(item for item in experiment.calibration if item.artefact not in artefacts)
        words = listing((name or "the machine" for name in artefacts), 3)
        yield f"certificates of {words}", replace(experiment, calibration=remaining)
    if experiment.priors:
        yield "priors", replace(experiment, priors=())
    certified = [probe.name for probe, *_ in experiment.certified_offsets]
    if certified:
        yield (
            "probe offsets with a standard uncertainty",
            _with_offsets(experiment, certified, np.inf),
        )
    if experiment.stars:
        yield "tips of stars", _without_stars(experiment)
    if exact_offsets(experiment):
        yield EXACT_OFFSETS, with_offsets(experiment, np.inf)


def exact_offsets(experiment: Experiment) -> tuple[str, ...]:
    """Return probes whose offsets are exact, except the first, which the others are relative to."""
    return tuple(name for name, probe in experiment.probes.items() if not probe.is_estimated)[1:]


def with_offsets(experiment: Experiment, uncertainty: float) -> Experiment:
    """Return the experiment with a standard uncertainty, in metres, of all exact offsets except
    one.
    """
    return _with_offsets(experiment, exact_offsets(experiment), uncertainty)


def _with_offsets(experiment: Experiment, names: Iterable[str], uncertainty: float) -> Experiment:
    uncertainties, probes = np.full(experiment.dimension, uncertainty), dict(experiment.probes)
    for name in names:
        probes[name] = replace(probes[name], standard_uncertainty=uncertainties)
    return replace(experiment, probes=probes)


def _without_stars(experiment: Experiment) -> Experiment:
    """Return the experiment with unknown offsets instead of stars; one stays as the reference."""
    probes = dict(experiment.probes)
    if all(probe.is_estimated for probe in probes.values()):
        first = next(iter(probes.values()))
        probes[first.name] = replace(first, standard_uncertainty=None)
    return replace(experiment, probes=probes, stars=())


def scale_uncertainty(experiment: Experiment) -> float:
    """Return the relative standard uncertainty of an experiment's scale; infinite if
    undetermined.
    """
    at = _linearised(experiment)
    if at is None:
        return float("inf")
    value = float(at.of_shared(scale_row(at)[None])[0])
    return float("inf") if np.isnan(value) else value


def scale_row(at: Linearisation) -> Array:
    """Return the derivative (s,) of the scale, the mean relative change of distances, by the shared
    parameters.

    Distances between the evaluation points, or between the corners of the volume if there are fewer
    than two, are weighted by their squares; the sum over all pairs is one over all points, less
    their centroid.
    """
    points = _points(at.design)
    rows = correction_rows(
        at.design, at.layout, at.state, points, np.full(len(points), at.design.evaluation.probe)
    )
    centred = points - points.mean(axis=0)
    return np.einsum("nd,nds->s", centred, rows) / (centred**2).sum()


def can_stretch(design: Design, state: State) -> bool:
    """Return whether the error model can stretch the volume equally along all axes."""
    offset = state.probes[design.evaluation.probe]
    return _stretches(design.model, _points(design), state.a, offset)


def stretches(model: ErrorModel, volume: Volume, a: Array) -> bool:
    """Return whether an error model with parameters a (n,) can stretch its volume equally along all
    axes.
    """
    return _stretches(model, _corners(volume), a, np.zeros(len(volume.lower)))


def _stretches(model: ErrorModel, points: Array, a: Array, offset: Array) -> bool:
    offsets = np.broadcast_to(offset, points.shape)
    jacobian = model.jacobian(points, a, offsets)
    centred = points - points.mean(axis=0)
    # A stretch is a displacement in proportion to the distance from the centroid, up to a shift. It
    # belongs to the model if its columns, less their shifts, have it as a combination. Columns are
    # of unit length, since parameters have different units.
    columns = (jacobian - jacobian.mean(axis=0)).reshape(centred.size, -1)
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0] / size[size > 0]
    if not columns.shape[1]:
        return False
    residual = centred.ravel() - columns @ lstsq(columns, centred.ravel(), rcond=1e-12)[0]
    return bool(np.abs(residual).max() <= FOLLOWED * np.abs(centred).max())


def _points(design: Design) -> Array:
    points = design.evaluation.points
    if len(points) > 1 and np.ptp(points, axis=0).max() > 0:
        return points
    return _corners(design.machine.volume)


def _corners(volume: Volume) -> Array:
    return np.array(list(product(*zip(*volume.corners, strict=True))))


def _linearised(experiment: Experiment) -> Linearisation | None:
    """Return the linearised design; None if it cannot be laid out."""
    try:
        return linearise(lay_out(experiment))
    except ExperimentError:
        return None


def _loosened(experiment: Experiment, at: Linearisation) -> Loosened | None:
    """Return U6 with uncertain instead of exact offsets; None if any distance is then
    undetermined.
    """
    after = lengths_with_offsets(experiment, OFFSET_TRIAL)
    if after is None:
        return None
    before = point_pairs(at)[1]
    return Loosened(
        OFFSET_TRIAL, after.total / after.count, after.maximum, before.total / before.count
    )


def lengths_with_offsets(experiment: Experiment, uncertainty: float) -> PairSummary | None:
    """Return U6 if exact offsets, except one, have an uncertainty in metres; None if any distance
    is undetermined.
    """
    at = _linearised(with_offsets(experiment, uncertainty))
    if at is None:
        return None
    pairs = point_pairs(at)[1]
    return None if pairs.undetermined or not pairs.count else pairs
