"""Sets of additions that together determine every null direction."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from ballplate.simulator.computing import comparable, svd
from ballplate.simulator.machines import Array

from .changes import Change
from .screening import SEEN, rank_of


def covering_set(
    additions: Sequence[Change],
    effects: Mapping[Change, Array],
    effort: Callable[[Change], float],
    may_be: Callable[[Sequence[Change]], bool],
) -> tuple[Change, ...]:
    """Return a set in which each member removes most null directions for its effort, of equal ones
    that which determines them best; empty if some remain.

    Members made superfluous by later ones are removed, the most expensive first.
    """
    if not additions:
        return ()
    stack = np.array([effects[addition] for addition in additions])
    k = stack.shape[2]
    unseen, built = np.eye(k), list[Change]()
    while unseen.shape[1]:
        values = svd(stack @ unseen, compute_uv=False)
        gains = (values > SEEN).sum(axis=1)
        weakest = comparable(np.where(values > SEEN, values, np.inf).min(axis=1))
        possible = [
            (gains[i] / effort(addition), gains[i], weakest[i], -i)
            for i, addition in enumerate(additions)
            if gains[i] and may_be((*built, addition))
        ]
        if not possible:
            return ()
        best = -max(possible)[-1]
        built.append(additions[best])
        unseen = unseen @ _null_space(stack[best] @ unseen)
    for addition in sorted(built, key=effort, reverse=True):
        without = [rival for rival in built if rival is not addition]
        if rank_of([effects[rival] for rival in without]) == k:
            built = without
    return tuple(built)


def _null_space(rows: Array) -> Array:
    """Return orthonormal columns (k, open) of the null space of rows (m, k)."""
    _, values, directions = svd(rows)
    return directions[int((values > SEEN).sum()) :].T
