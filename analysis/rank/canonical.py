"""One description of a space of directions, whatever basis of it a decomposition gave.

Any mixture of the directions that observations leave open is open as well, and a decomposition
returns one basis or another as rounding falls. Told are elementary directions: each has a parameter
of its own that the others do not touch, so that none involves all that another does. Which
parameters these are follows from the space alone, those first that have most freedom in it, and of
equal ones the first by the order of names.
"""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing.rounding import comparable
from ballplate.simulator.machines.protocol import Array, Integers


def elementary_mixture(directions: Array) -> Array:
    """Mixtures (k, k) that make elementary directions of linearly independent ones (s, k), in
    comparable units.

    >>> mixed = np.array([[1.0, 1.0], [1.0, -1.0], [0.5, 0.5]])
    >>> (mixed @ elementary_mixture(mixed)).tolist()
    [[0.0, 1.0], [1.0, 0.0], [0.0, 0.5]]
    """
    left = np.linalg.qr(directions)[0]
    own = []
    for _ in range(directions.shape[1]):
        # What is left of a parameter's row is how far the space can change it without those chosen
        # before.
        row = int(comparable((left**2).sum(axis=1)).argmax())
        unit = left[row] / np.linalg.norm(left[row])
        left = left - np.outer(left @ unit, unit)
        own.append(row)
    return np.asarray(np.linalg.inv(directions[own]))


def principal_directions(
    values: Array, root: Array, effect: Array, scale: Array
) -> tuple[Array, Array]:
    """Directions (s, r) and the lengths (r,) of their effects, in one basis also where singular
    values are equal.

    `root` (s, r) holds right singular vectors over their `values` (r,), largest first, and `effect`
    (m, r) what each does. Those of equal values are turned until their effects are orthogonal, the
    largest last; of those whose effects are equal, too, the elementary ones are taken, in units of
    `scale` (s,).
    """
    root, size = root.copy(), np.sqrt((effect**2).sum(axis=0))
    for group in _equal(values):
        if len(group) > 1:
            _, own, turned = np.linalg.svd(np.linalg.qr(effect[:, group], mode="r"))
            size[group] = np.concatenate([own, np.zeros(len(group) - len(own))])[::-1]
            root[:, group] = root[:, group] @ turned[::-1].T
            for alike in _equal(size[group]):
                if len(alike) > 1:
                    some = group[alike]
                    told = root[:, some] / scale[:, None]
                    length = np.sqrt((told**2).sum(axis=0)).mean()
                    told = told @ elementary_mixture(told)
                    # The first stands last, as the weakest does.
                    told = (told * length / np.sqrt((told**2).sum(axis=0)))[:, ::-1]
                    root[:, some] = told * scale[:, None]
    return root, size


def _equal(values: Array) -> list[Integers]:
    """Indices of sorted values (r,) in groups of those that are equal but for rounding."""
    return np.split(np.arange(len(values)), np.flatnonzero(np.diff(comparable(values))) + 1)
