"""Choices spread evenly over many."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def evenly_spread(count: int, most: int) -> NDArray[np.int64]:
    """Return indices of all of `count`, or of `most` spread evenly, both ends included.

    >>> evenly_spread(3, 200).tolist(), evenly_spread(9, 3).tolist()
    ([0, 1, 2], [0, 4, 8])
    """
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))
