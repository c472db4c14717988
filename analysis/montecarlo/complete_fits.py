"""Complete estimate of a single replicate, for those that the shared factor cannot refine."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.estimation.gauss_newton import Solution, gauss_newton
from ballplate.simulator.estimation.initial import initial_state
from ballplate.simulator.machines.protocol import Array

from .reference import Reference


def complete_fit(
    shared: Reference, moved: Array, errors: tuple[Array, ...], ends: tuple[Array, Array]
) -> Solution:
    """Estimate one replicate as `fit` does, with a factor of its own in each iteration.

    `moved` (d, m) is the noise of the plates' readings, `errors` (m,) those of the values of each
    kind of observations, `ends` (d, m) the noise of the readings of the lengths' two ends.
    `GaussNewtonSettings` limits the iterations. Directions that the design as drawn leaves open
    stay held, as in all replicates.
    """
    design, x = replicate_data(shared, moved, errors, ends)
    held = None if shared.drawn is None else shared.drawn.spectrum
    return gauss_newton(design, x, initial_state(design, x), held=held)


def replicate_data(
    shared: Reference, moved: Array, errors: tuple[Array, ...], ends: tuple[Array, Array]
) -> tuple[Design, Array]:
    """Return the design with the values of one replicate, and its scale readings (m, d)."""
    design, x = shared.design, shared.exact.copy()
    x[shared.order] += moved.T
    given = design.of(Lengths)
    x[given.first] = shared.exact[given.first] + ends[0].T
    read = given.second[~given.to_pivot]
    x[read] = shared.exact[read] + ends[1].T
    values = (
        one.given(value=one.value + np.asarray(error))
        for one, error in zip(design.observations, errors, strict=True)
    )
    return design.observed(*values), x
