"""Canonical basis of a space of directions, independent of the decomposition.

Mixtures of undetermined directions are undetermined, too, and rounding selects the basis that a
decomposition returns. Elementary directions are reported instead: each changes one parameter that
the others do not, so that none involves all parameters of another. The space alone determines these
parameters: those with most freedom first, equal ones in the order of names.
"""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing.numerics import comparable, svd
from ballplate.simulator.machines.protocol import Array, Integers


def elementary_mixture(directions: Array) -> Array:
    """Return mixtures (k, k) that make elementary directions of linearly independent ones (s, k),
    in comparable units.

    >>> mixed = np.array([[1.0, 1.0], [1.0, -1.0], [0.5, 0.5]])
    >>> (mixed @ elementary_mixture(mixed)).tolist()
    [[0.0, 1.0], [1.0, 0.0], [0.0, 0.5]]
    """
    remainder = np.linalg.qr(directions)[0]
    chosen = []
    for _ in range(directions.shape[1]):
        # The remainder of a parameter's row is its freedom when those chosen before are fixed.
        row = int(comparable((remainder**2).sum(axis=1)).argmax())
        unit = remainder[row] / np.linalg.norm(remainder[row])
        remainder = remainder - np.outer(remainder @ unit, unit)
        chosen.append(row)
    return np.asarray(np.linalg.inv(directions[chosen]))


def principal_directions(
    values: Array, root: Array, effect: Array, scale: Array
) -> tuple[Array, Array]:
    """Return directions (s, r) and the lengths (r,) of their effects, in one basis even if singular
    values are equal.

    `root` (s, r) holds right singular vectors over their `values` (r,), largest first, and `effect`
    (m, r) their effects. Directions of equal values are rotated until their effects are orthogonal,
    the largest last; those of equal effects are made elementary, in units of `scale` (s,).
    """
    root, size = root.copy(), np.sqrt((effect**2).sum(axis=0))
    for group in _equal(values):
        if len(group) > 1:
            _, lengths, turned = svd(np.linalg.qr(effect[:, group], mode="r"))
            size[group] = np.concatenate([lengths, np.zeros(len(group) - len(lengths))])[::-1]
            root[:, group] = root[:, group] @ turned[::-1].T
            for equal in _equal(size[group]):
                if len(equal) > 1:
                    columns = group[equal]
                    directions = root[:, columns] / scale[:, None]
                    length = np.sqrt((directions**2).sum(axis=0)).mean()
                    directions = directions @ elementary_mixture(directions)
                    # Reversed, since the weakest direction is last.
                    directions = (directions * length / np.sqrt((directions**2).sum(axis=0)))[
                        :, ::-1
                    ]
                    root[:, columns] = directions * scale[:, None]
    return root, size


def _equal(values: Array) -> list[Integers]:
    """Return indices of sorted values (r,) in groups of equal ones, within rounding."""
    return np.split(np.arange(len(values)), np.flatnonzero(np.diff(comparable(values))) + 1)
