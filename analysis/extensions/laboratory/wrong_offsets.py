"""Probe offsets that are stated wrongly: a sign, two probes exchanged, or one that is off.

Readings of one position with two probes determine the difference of their offsets, however the
artefact is placed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, combinations

import numpy as np
from ballplate.simulator.design import Design, Priors
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Array


@dataclass(frozen=True)
class WrongOffsets:
    """A mistake in the offsets of `probes`: `change` (l, d) is the true offsets less those stated.

    With two probes they are exchanged; of one the `axes` have the wrong sign, or without any it is
    off.
    """

    probes: tuple[int, ...]
    change: Array
    axes: tuple[int, ...] = ()

    def words(self, design: Design) -> str:
        """What is wrong, of a sign or an exchange."""
        names = [design.probes.names[k] for k in self.probes]
        if len(names) > 1:
            return f"the offsets of probes {' and '.join(names)} are exchanged"
        letters = listing(AXIS_NAMES[k] for k in self.axes)
        return f"offset {letters} of probe {names[0]} has the wrong sign"


def stated_offsets(design: Design) -> Array:
    """Offsets (l, d) of probes as they are stated, of uncertain ones too."""
    offsets, priors = design.probes.offsets.copy(), design.of(Priors)
    known_priors = np.flatnonzero(priors.probe >= 0)
    offsets[priors.probe[known_priors], priors.component[known_priors]] = priors.value[known_priors]
    return offsets


def with_offsets(design: Design, change: Array) -> Design:
    """The design with other offsets by a change (l, d), as certain as they were."""
    priors = design.of(Priors)
    value, indices = priors.value.copy(), np.flatnonzero(priors.probe >= 0)
    value[indices] += change[priors.probe[indices], priors.component[indices]]
    probes = replace(design.probes, offsets=design.probes.offsets + change)
    return replace(design, probes=probes).observed(priors.given(value=value))


def discrete_mistakes(design: Design) -> Iterator[WrongOffsets]:
    """Every sign, or several of one probe, that may be wrong, and every exchange of two probes."""
    offsets_stated = stated_offsets(design)
    probes_read = np.unique(design.readings.probe[design.plate_readings]).tolist()
    for probe in probes_read:
        axes = np.flatnonzero(offsets_stated[probe]).tolist()
        for some in chain.from_iterable(combinations(axes, n + 1) for n in range(len(axes))):
            change = np.zeros_like(offsets_stated)
            change[probe, list(some)] = -2.0 * offsets_stated[probe, list(some)]
            yield WrongOffsets((probe,), change, some)
    for first, second in combinations(range(len(offsets_stated)), 2):
        change = np.zeros_like(offsets_stated)
        change[first], change[second] = (
            offsets_stated[second] - offsets_stated[first],
            offsets_stated[first] - offsets_stated[second],
        )
        if change.any() and {first, second} & set(probes_read):
            yield WrongOffsets((first, second), change)
