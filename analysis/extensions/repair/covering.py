"""Sets of additions that together determine every null direction."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from ballplate.simulator.machines import Array

from .changes import Change
from .screening import SEEN, rank_of

# Candidates of which every two are compared.
MOST_PAIRED = 60


def different(additions: Sequence[Change], seen: Mapping[Change, Array]) -> list[Change]:
    """The first of additions, less those that cost the same and say the same as one before."""
    found: dict[tuple[int, float, bytes], Change] = {}
    for one in additions:
        said = seen[one].T @ seen[one]
        digits = np.round(said / max(float(np.abs(said).max()), SEEN), 6) + 0.0
        found.setdefault((one.kind, one.cost, digits.tobytes()), one)
    return list(found.values())[:MOST_PAIRED]


def covering_pairs(triangles: Sequence[Array]) -> list[tuple[int, int]]:
    """Every two of the triangles (k, k) that have rank k together and not one by one.

    >>> x, y = np.diag([1.0, 0.0]), np.diag([0.0, 1.0])
    >>> covering_pairs([x, y, x, x + y])
    [(0, 1), (1, 2)]
    """
    found = []
    rest = [open_of(one) for one in triangles]
    stack = np.array(triangles)
    for i, left in enumerate(rest):
        if not left.shape[1]:
            continue
        others = [
            k for k in range(i + 1, len(rest)) if rest[k].shape[1] and _may_cover(rest[k], left)
        ]
        found += [
            (i, k)
            for k, rank in zip(others, _ranks(stack[others] @ left), strict=True)
            if rank == left.shape[1]
        ]
    return found


def covering_set(
    additions: Sequence[Change],
    seen: Mapping[Change, Array],
    effort: Callable[[Change], float],
    may_be: Callable[[Sequence[Change]], bool],
) -> tuple[Change, ...]:
    """A set built up of what removes most null directions for its effort each time; empty if some
    stay.

    What the others make superfluous is left out again, the most expensive first.
    """
    if not additions:
        return ()
    stack = np.array([seen[one] for one in additions])
    k = stack.shape[2]
    left, built = np.eye(k), list[Change]()
    while left.shape[1]:
        gains = _ranks(stack @ left)
        possible = [i for i, one in enumerate(additions) if gains[i] and may_be((*built, one))]
        if not possible:
            return ()
        best = max(possible, key=lambda i, of=gains: (of[i] / effort(additions[i]), of[i]))  # type: ignore[misc]
        built.append(additions[best])
        left = left @ open_of(stack[best] @ left)
    for one in sorted(built, key=effort, reverse=True):
        without = [other for other in built if other is not one]
        if rank_of([seen[other] for other in without]) == k:
            built = without
    return tuple(built)


def open_of(rows: Array) -> Array:
    """Orthonormal columns (k, open) that rows (m, k) say nothing of."""
    _, values, directions = np.linalg.svd(rows)
    return directions[int((values > SEEN).sum()) :].T


def _may_cover(one: Array, other: Array) -> bool:
    """Whether what two leave open each is not too much for them to leave nothing together."""
    return one.shape[1] + other.shape[1] <= len(one)


def _ranks(stack: Array) -> list[int]:
    """Ranks of matrices (n, m, k)."""
    if not stack.size:
        return [0] * len(stack)
    return [int(rank) for rank in (np.linalg.svd(stack, compute_uv=False) > SEEN).sum(axis=1)]
