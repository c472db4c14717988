"""Shares of the sources of uncertainty in what is estimated.

An estimate is linear in the errors of all observations, which are independent of one another once
they are whitened: a function f of the parameters has the error g Q' e with a root G of the
covariance, g = (df/dp) G, orthonormal columns Q = J G and errors e of unit variance. A source's
share of its variance is g S g' with the sum S of q' q over the source's rows q of Q. These sums add
to the identity, so that the contributions of all sources add in squares to the uncertainty,
exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.extensions.diagnosis.hat import hat_rows, row_count, row_places
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import (
    CalibratedCoordinates,
    Design,
    JointValues,
    Lengths,
    Observations,
    Priors,
    Stars,
    length_whitening,
)
from ballplate.simulator.estimation import Linearisation
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.machines import Array

from .observation_groups import Grouping, ObservationGroup, groups_of

# Lengths of standards are formed of readings and compared with certificates; each row mixes both.
READ_STANDARDS = "readings of length standards"


@dataclass(frozen=True, eq=False)
class SourceSums:
    """Sums (k, r, r) over the rows of the sources `names`, which add to the identity; r is the
    rank of the shared parameters.
    """

    names: tuple[str, ...]
    sums: Array

    def variances(self, roots: Array) -> Array:
        """Contributions (k, m) to the variances of functions with derivatives `roots` (m, r) by
        the standard normal variables of the shared parameters.
        """
        return np.stack([((roots @ source_sum) * roots).sum(axis=1) for source_sum in self.sums])

    def of_sum(self, squares: Array) -> Array:
        """Contributions (k,) to the sum of the variances of functions, whose roots g have the sum
        of g' g `squares` (r, r).
        """
        return (self.sums * squares).sum(axis=(1, 2))


@single_threaded
def source_sums(
    linearisation: Linearisation, x: Array | None, sources: Sequence[ObservationGroup]
) -> SourceSums:
    """The sums of all sources of a linearisation with scale readings `x` (readings, d), or
    error-free ones.

    Rows of length standards become the readings' noise and the certificates, whatever sources they
    are of.
    """
    rank, member = linearisation.rank, np.full(row_count(linearisation.design), -1)
    for k, source in enumerate(sources):
        member[source.rows] = k
    lengths = row_places(linearisation.design).get(Lengths.word, slice(0, 0))
    of_lengths = np.zeros((lengths.stop - lengths.start, rank))
    sums = np.zeros((len(sources), rank, rank))
    for some in hat_rows(linearisation, x):
        common, own_member = some.common[:, :rank], member[some.rows]
        for k in np.unique(own_member[own_member >= 0]):
            sums[k] += common[own_member == k].T @ common[own_member == k]
        is_length = (some.rows >= lengths.start) & (some.rows < lengths.stop)
        of_lengths[some.rows[is_length] - lengths.start] = common[is_length]
    names = [source.name for source in sources]
    if len(of_lengths):
        certified = _of_certificates(linearisation.design, of_lengths)
        k = int(member[lengths.start])
        names[k] = READ_STANDARDS
        sums[k] -= sum(certified.values())
        names += certified
        sums = np.concatenate([sums, *(source[None] for source in certified.values())])
    return SourceSums(tuple(names), sums)


def _of_certificates(design: Design, rows: Array) -> dict[str, Array]:
    """Sums (r, r) of the certificates of each length standard, from the rows (m, r) of lengths."""
    lengths = design.of(Lengths)
    pulled = lengths.uncertainty[:, None] * design.once(length_whitening).pulled(rows)
    standard = design.balls.artefact[design.readings.ball[lengths.first]]
    rows_by_certificate = {}
    for k in np.unique(standard[lengths.uncertainty > 0.0]):
        is_of_certificate = standard == k
        errors = np.zeros((int(lengths.certificate.max()) + 1, rows.shape[1]))
        np.add.at(errors, lengths.certificate[is_of_certificate], pulled[is_of_certificate])
        rows_by_certificate[f"certificate of {design.artefacts.names[k]}"] = errors.T @ errors
    return rows_by_certificate


def sources_of(
    design: Design, experiment: Experiment, by: Grouping = "calibration"
) -> tuple[ObservationGroup, ...]:
    """The sources of uncertainty of an experiment's design: the readings in
    groups, every item of calibration, stars, offsets of probes, priors by what they are about,
    and every influence quantity.
    """
    return groups_of(design, by, lambda design, source: _names(design, source, experiment))


def _names(design: Design, observations: Observations, experiment: Experiment) -> list[str]:
    """The source of each row of observations."""
    if isinstance(observations, Priors):
        return _of_priors(design, observations, experiment)
    if isinstance(observations, Stars):
        return [f"stars[{k}]" for k in observations.star.tolist()]
    names = []
    for k, item in enumerate(experiment.calibration):
        if not experiment.is_observed(item):
            continue
        observed = item.observed(0)
        if isinstance(observations, type(observed) if item.root is None else JointValues):
            names += [f"calibration[{k}]: {item.kind} of {item.subject}"] * len(observed)
    other_kinds = _kinds_of_rows(design, observations)[len(names) :]
    if isinstance(observations, CalibratedCoordinates):
        # What no item states is how flat artefacts that are read in their plane are taken to be.
        other_kinds = [
            f"flatness of {name.removeprefix('coordinates of ')}" for name in other_kinds
        ]
    return names + other_kinds


def _kinds_of_rows(design: Design, observations: Observations) -> list[str]:
    """Return the group of each row of observations, by class and artefact."""
    count = observations.count(design)
    if not observations.balls.shape[1]:
        return [f"{observations.word}s"] * count
    artefacts = design.balls.artefact[observations.balls[:, 0]].tolist()
    return [f"{observations.word}s of {design.artefacts.names[k]}" for k in artefacts]


def _of_priors(design: Design, priors: Priors, experiment: Experiment) -> list[str]:
    of_influences = [
        f"influences[{k}]: {vars(settings)['kind']}"
        for k, (settings, influence) in enumerate(
            zip(experiment.influences, design.influences, strict=True)
        )
        for parameter in influence.parameters
        if parameter.uncertainty
    ]
    names = []
    for influence, probe, position in zip(
        priors.of_influence.tolist(), priors.probe.tolist(), priors.position.tolist(), strict=True
    ):
        if influence >= 0:
            names.append(of_influences[influence])
        elif probe >= 0:
            names.append("offsets of probes")
        else:
            names.append("priors of poses" if position >= 0 else "priors of the error model")
    return names
