"""Sets of additions that together determine every null direction."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from ballplate.simulator.machines import Array

from .changes import Change
from .screening import SEEN, rank_of

# Candidates of which every two are compared.
MOST_PAIRED = 60


def different(additions: Sequence[Change], effects: Mapping[Change, Array]) -> list[Change]:
    """The first of additions, less those that cost the same and say the same as one before."""
    distinct: dict[tuple[int, float, bytes], Change] = {}
    for addition in additions:
        gram = effects[addition].T @ effects[addition]
        digits = np.round(gram / max(float(np.abs(gram).max()), SEEN), 6) + 0.0
        distinct.setdefault((addition.kind, addition.cost, digits.tobytes()), addition)
    return list(distinct.values())[:MOST_PAIRED]


def covering_pairs(triangles: Sequence[Array]) -> list[tuple[int, int]]:
    """Every two of the triangles (k, k) that have rank k together and not one by one.

    >>> x, y = np.diag([1.0, 0.0]), np.diag([0.0, 1.0])
    >>> covering_pairs([x, y, x, x + y])
    [(0, 1), (1, 2)]
    """
    covering = []
    unseen_by = [open_of(addition) for addition in triangles]
    stack = np.array(triangles)
    for i, unseen in enumerate(unseen_by):
        if not unseen.shape[1]:
            continue
        candidates = [
            k
            for k in range(i + 1, len(unseen_by))
            if unseen_by[k].shape[1] and _may_cover(unseen_by[k], unseen)
        ]
        covering += [
            (i, k)
            for k, rank in zip(candidates, _ranks(stack[candidates] @ unseen), strict=True)
            if rank == unseen.shape[1]
        ]
    return covering


def covering_set(
    additions: Sequence[Change],
    effects: Mapping[Change, Array],
    effort: Callable[[Change], float],
    may_be: Callable[[Sequence[Change]], bool],
) -> tuple[Change, ...]:
    """Return a set in which each member removes most null directions for its effort; empty if some
    remain.

    Members made superfluous by later ones are removed, the most expensive first.
    """
    if not additions:
        return ()
    stack = np.array([effects[addition] for addition in additions])
    k = stack.shape[2]
    unseen, built = np.eye(k), list[Change]()
    while unseen.shape[1]:
        gains = _ranks(stack @ unseen)
        possible = [
            i for i, addition in enumerate(additions) if gains[i] and may_be((*built, addition))
        ]
        if not possible:
            return ()
        best = max(possible, key=lambda i, of=gains: (of[i] / effort(additions[i]), of[i]))  # type: ignore[misc]
        built.append(additions[best])
        unseen = unseen @ open_of(stack[best] @ unseen)
    for addition in sorted(built, key=effort, reverse=True):
        without = [rival for rival in built if rival is not addition]
        if rank_of([effects[rival] for rival in without]) == k:
            built = without
    return tuple(built)


def open_of(rows: Array) -> Array:
    """Return orthonormal columns (k, open) of the null space of rows (m, k)."""
    _, values, directions = np.linalg.svd(rows)
    return directions[int((values > SEEN).sum()) :].T


def _may_cover(first: Array, second: Array) -> bool:
    """True if the dimensions allow two changes to leave no direction undetermined together."""
    return first.shape[1] + second.shape[1] <= len(first)


def _ranks(stack: Array) -> list[int]:
    """Ranks of matrices (n, m, k)."""
    if not stack.size:
        return [0] * len(stack)
    return [int(rank) for rank in (np.linalg.svd(stack, compute_uv=False) > SEEN).sum(axis=1)]
