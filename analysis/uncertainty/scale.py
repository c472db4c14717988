"""Origin of a design's scale: certificates, priors, probe offsets, or an error model that cannot
stretch.

Readings alone never determine it. Machine, plates, poses and offsets that are all larger by the
same ratio give the same readings, so that some knowledge of a length must say how large they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from ballplate.simulator.design.arrays import Design, State
from ballplate.simulator.design.objects import Volume
from ballplate.simulator.estimation.corrections import correction_rows
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.settings import listing
from ballplate.simulator.machines.protocol import Array, ErrorModel

from .pairs import PairSummary
from .summaries import point_pairs

# The standard uncertainty of offsets for which a design that rests on them is told what becomes of
# it.
OFFSET_TRIAL = 1e-6
# What is left out carries scale where the scale is less certain without it by this factor.
CARRIES = 1.05
# A design rests on offsets held exact where its scale is less certain without them by this factor.
RESTS = 3.0
# The part of a stretched volume that an error model must follow to have a common scale.
FOLLOWED = 1e-6
# Artefacts whose certificates are told apart.
MOST_ARTEFACTS = 3


@dataclass(frozen=True)
class Carrier:
    """What carries scale, in words; `without` is the relative standard uncertainty of scale if it
    were not known.

    Infinite where the scale would then be undetermined; None of the machine's own scales, which are
    what they are.
    """

    words: str
    without: float | None


@dataclass(frozen=True)
class Loosened:
    """U6 of a design whose exact probe offsets, but for one, have a standard uncertainty: average
    and maximum, metres.

    `before` is the average with exact offsets.
    """

    offset_uncertainty: float
    average: float
    maximum: float
    before: float


@dataclass(frozen=True)
class Scale:
    """The relative standard uncertainty of scale, and what carries it, the most important first.

    Scale is the mean relative change of the distances between corrected points, weighted by their
    squares. `rests_on_offsets`: whether, but for probe offsets that are held exact, it would be
    undetermined or at least three times as uncertain; `loosened` then tells what becomes of U6.
    Where the error model cannot stretch the volume by the same ratio in all directions, the
    machine's own scales carry as well.
    """

    uncertainty: float
    carriers: tuple[Carrier, ...]
    rests_on_offsets: bool = False
    loosened: Loosened | None = None


def scale_of(experiment: Experiment, at: Linearisation) -> Scale | None:
    """What carries the scale of a design; None where it is undetermined or the design is evaluated
    nowhere.
    """
    uncertainty = float(at.of_shared(scale_row(at)[None])[0])
    if np.isnan(uncertainty):
        return None
    stretches = can_stretch(at.design, at.state)
    groups = list(_groups(experiment))
    if len(groups) == 1 and stretches:
        # Nothing else can: readings alone do not tell the scale.
        carriers = [Carrier(groups[0][0], np.inf)]
    else:
        found = sorted(((scale_uncertainty(rest), words) for words, rest in groups), reverse=True)
        some = [one for one in found if one[0] > CARRIES * uncertainty] or (
            found if stretches else []
        )
        carriers = [Carrier(words, without) for without, words in some]
    rests = any(
        one.words == EXACT_OFFSETS and (one.without or 0.0) > RESTS * uncertainty
        for one in carriers
    )
    loosened = _loosened(experiment, at) if rests else None
    if not stretches:
        carriers.append(Carrier(OWN_SCALES, None))
    return Scale(uncertainty, tuple(carriers), rests, loosened)


OWN_SCALES = "the machine's own scales, which the error model cannot change all alike"
EXACT_OFFSETS = "exact probe offsets"


def _groups(experiment: Experiment) -> Iterator[tuple[str, Experiment]]:
    """What may carry scale, in words, with the experiment in which it is not known."""
    names = list(dict.fromkeys(item.artefact for item in experiment.calibration))
    sets = [[name] for name in names] if len(names) <= MOST_ARTEFACTS else [names]
    for some in sets:
        rest = tuple(item for item in experiment.calibration if item.artefact not in some)
        words = listing((name or "the machine" for name in some), 3)
        yield f"certificates of {words}", replace(experiment, calibration=rest)
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
    """Probes whose offsets are held exact, but for one: what the others are relative to."""
    return tuple(name for name, one in experiment.probes.items() if not one.is_estimated)[1:]


def with_offsets(experiment: Experiment, uncertainty: float) -> Experiment:
    """The experiment with a standard uncertainty, in metres, of the offsets that are held exact,
    but for one.
    """
    return _with_offsets(experiment, exact_offsets(experiment), uncertainty)


def _with_offsets(experiment: Experiment, names: Iterable[str], uncertainty: float) -> Experiment:
    own, probes = np.full(experiment.dimension, uncertainty), dict(experiment.probes)
    for name in names:
        probes[name] = replace(probes[name], standard_uncertainty=own)
    return replace(experiment, probes=probes)


def _without_stars(experiment: Experiment) -> Experiment:
    """The experiment with unknown offsets in place of stars, but for one that is the reference."""
    probes = dict(experiment.probes)
    if all(probe.is_estimated for probe in probes.values()):
        first = next(iter(probes.values()))
        probes[first.name] = replace(first, standard_uncertainty=None)
    return replace(experiment, probes=probes, stars=())


def scale_uncertainty(experiment: Experiment) -> float:
    """Relative standard uncertainty of an experiment's scale; infinite where it is undetermined."""
    at = _linearised(experiment)
    if at is None:
        return float("inf")
    value = float(at.of_shared(scale_row(at)[None])[0])
    return float("inf") if np.isnan(value) else value


def scale_row(at: Linearisation) -> Array:
    """Derivative (s,) of the scale by the shared parameters: of the mean relative change of
    distances.

    Distances between the evaluation points or, where there is but one or none, between the corners
    of the volume, are weighted by their squares; the sum over all pairs is one over all points,
    less their centroid.
    """
    points = _points(at.design)
    rows = correction_rows(
        at.design, at.layout, at.state, points, np.full(len(points), at.design.evaluation.probe)
    )
    centred = points - points.mean(axis=0)
    return np.einsum("nd,nds->s", centred, rows) / (centred**2).sum()


def can_stretch(design: Design, state: State) -> bool:
    """Whether the error model can stretch the volume by the same ratio along all axes."""
    offset = state.probes[design.evaluation.probe]
    return _stretches(design.model, _points(design), state.a, offset)


def stretches(model: ErrorModel, volume: Volume, a: Array) -> bool:
    """Whether an error model with parameters a (n,) can stretch its volume by the same ratio along
    all axes.
    """
    return _stretches(model, _corners(volume), a, np.zeros(len(volume.lower)))


def _stretches(model: ErrorModel, points: Array, a: Array, offset: Array) -> bool:
    offsets = np.broadcast_to(offset, points.shape)
    jacobian = model.jacobian(points, a, offsets)
    centred = points - points.mean(axis=0)
    columns = (jacobian - jacobian.mean(axis=0)).reshape(centred.size, -1)
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0] / size[size > 0]
    if not columns.shape[1]:
        return False
    left = centred.ravel() - columns @ np.linalg.lstsq(columns, centred.ravel(), rcond=1e-12)[0]
    return bool(np.abs(left).max() <= FOLLOWED * np.abs(centred).max())


def _points(design: Design) -> Array:
    points = design.evaluation.points
    if len(points) > 1 and np.ptp(points, axis=0).max() > 0:
        return points
    return _corners(design.machine.volume)


def _corners(volume: Volume) -> Array:
    return np.array(list(product(*zip(*volume.corners, strict=True))))


def _linearised(experiment: Experiment) -> Linearisation | None:
    """The linearised design; None where it cannot be laid out."""
    try:
        return linearise(lay_out(experiment))
    except ExperimentError:
        return None


def _loosened(experiment: Experiment, at: Linearisation) -> Loosened | None:
    """What becomes of U6 once the exact offsets have an uncertainty; None where something of it is
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
    """U6 where exact offsets, but for one, have an uncertainty in metres; None where something of
    it is open.
    """
    at = _linearised(with_offsets(experiment, uncertainty))
    if at is None:
        return None
    pairs = point_pairs(at)[1]
    return None if pairs.undetermined or not pairs.count else pairs
