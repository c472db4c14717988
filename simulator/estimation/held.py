"""Linearisations in which some of the shared parameters are exactly known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.machines.protocol import Integers

from .covariance import in_order, spectrum
from .elimination import Factor
from .linearisation import Linearisation


@single_threaded
def holding(at: Linearisation, held: Integers) -> Linearisation:
    """Return a linearised design with the shared parameters of columns `held` (m,) exactly known.

    No ball is eliminated again. The parameters keep their columns, without uncertainty; quantities
    are those of the design in which they are no parameters. Steps from the result are meaningless.
    """
    factor = _holding(at.factor, held)
    found = spectrum(factor)
    free = np.ones(len(at.layout))
    free[held] = 0.0
    known = None if found.known is None else free[:, None] * found.known
    return replace(
        at, factor=factor, spectrum=replace(found, scale=free * found.scale, known=known)
    )


def _holding(factor: Factor, held: Integers) -> Factor:
    scale, count = factor.layout.scale, len(held)
    rows = in_order(factor) * scale
    rows[:, held] = 0.0
    # As heavy as the heaviest row: neither undetermined nor the measure of what is.
    exact = np.zeros((count, len(scale)))
    exact[np.arange(count), held] = np.abs(rows).max(initial=0.0) or 1.0
    free = np.ones(len(scale))
    free[held] = 0.0
    changed = replace(
        factor, ball_shared=factor.ball_shared * free, kept_shared=factor.kept_shared * free
    )
    if factor.orders is None or factor.alike is None:
        # The triangle's columns before the first that is held stay as they are.
        start = int(held.min(initial=len(scale)))
        below = np.concatenate([rows, exact])[start:, start:]
        rows[start:, start:] = np.linalg.qr(below, mode="r")
        return replace(changed, root=rows / scale)
    from .graded import triangle

    found = triangle(np.concatenate([rows, exact]), np.zeros((len(rows) + count, 0)))
    return replace(
        changed,
        root=found.root / scale[found.order],
        orders=replace(factor.orders, shared=found.order),
        alike=_holding(factor.alike, held),
    )
