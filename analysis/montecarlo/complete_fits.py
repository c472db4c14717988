"""Complete estimates of single replicates that the shared factor cannot refine."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.estimation.gauss_newton import Solution, iterate
from ballplate.simulator.estimation.initial import initial_state
from ballplate.simulator.machines.protocol import Array

from .reference import Reference


def complete_fit(
    shared: Reference, moved: Array, errors: tuple[Array, ...], ends: tuple[Array, Array]
) -> Solution:
    """Estimate one replicate as `fit` does, with a separate factor in each iteration.

    `moved` (d, m) is the noise of the plates' readings, `errors` (m,) those of the values of each
    type of observation, `ends` (d, m) the noise of the readings of the lengths' two ends.
    `GaussNewtonSettings` limits the iterations. Directions that the nominal design leaves
    undetermined are held, as in all replicates, and no others.
    """
    design, x = replicate_data(shared, moved, errors, ends)
    held_spectrum = shared.spectrum if shared.drawn is None else shared.drawn.spectrum
    return iterate(design, x, initial_state(design, x), held_spectrum=held_spectrum)


def replicate_data(
    shared: Reference, moved: Array, errors: tuple[Array, ...], ends: tuple[Array, Array]
) -> tuple[Design, Array]:
    """Return the design with the values of one replicate, and its scale readings (m, d)."""
    design, x = shared.design, shared.exact.copy()
    x[shared.order] += moved.T
    lengths = design.of(Lengths)
    x[lengths.first] = shared.exact[lengths.first] + ends[0].T
    second = lengths.second[~lengths.to_pivot]
    x[second] = shared.exact[second] + ends[1].T
    values = (
        kind.given(value=kind.value + np.asarray(error))
        for kind, error in zip(design.observations, errors, strict=True)
    )
    return design.observed(*values), x
