"""A calibrated distance for a design whose scale rests on probe offsets that are held exact."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from ballplate.simulator.computing import single_threaded
from ballplate.simulator.experiment import Experiment, placed_only
from ballplate.uncertainty import OFFSET_TRIAL, Scale, lengths_with_offsets

from .certificates import certificates
from .changes import Change
from .written import Edit, edits

# Distances that are tried, of most artefacts more than the sides and diagonals.
MOST_TRIED = 12
# A certificate helps where average U6 is smaller with it by this factor.
HELPS = 2.0


@dataclass(frozen=True)
class ScaleCertificate:
    """The calibrated distance with the smallest U6 if offsets have `offset_uncertainty`, in
    metres.

    `average` is that U6, and `edits` the changes of the file; without a `change`, no candidate
    halves U6.
    """

    change: Change | None
    offset_uncertainty: float
    average: float
    edits: tuple[Edit, ...] = ()


@single_threaded
def scale_certificate(experiment: Experiment, scale: Scale | None) -> ScaleCertificate | None:
    """Return the best single certificate, if scale rests on offsets that are held exact."""
    if scale is None or not scale.rests_on_offsets or scale.loosened is None:
        return None
    singles = [change for change in certificates(experiment) if change.cost == 1.0][:MOST_TRIED]
    best, least = None, scale.loosened.average / HELPS
    for change in singles:
        lengths = lengths_with_offsets(placed_only(change.apply(experiment)), OFFSET_TRIAL)
        average = inf if lengths is None else lengths.total / lengths.count
        # Equal but for rounding: the first of them.
        if average < least * (1.0 - 1e-6):
            best, least = change, average
    if best is None:
        return ScaleCertificate(None, OFFSET_TRIAL, scale.loosened.average)
    return ScaleCertificate(best, OFFSET_TRIAL, least, edits(experiment, best.apply(experiment)))
