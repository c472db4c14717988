"""Lengths of length standards as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.inputs.number_arrays import Flags
from ballplate.simulator.machines.protocol import Array, Integers


@dataclass(frozen=True)
class LengthArrays:
    """Lengths of length standards read in the volume; arrays (m,), metres.

    `first` and `second` index the readings that a length takes part in; `second` is -1 if the
    other end is the pivot of a Bryan gauge, which is not read: the origin of the first reading's
    position. `projected` is true if the difference of the corrected points is projected on the
    standard's nominal direction (m, d) instead of its norm being taken; `with_repeatability` if
    the readings' own noise along that direction adds to `uncertainty`. Lengths of the same
    `certificate`, counted from 0, share that error in all positions. `free` is the number of the
    design's unknown length, -1 if its `value` is known.
    """

    first: Integers
    second: Integers
    value: Array
    uncertainty: Array
    projected: Flags
    direction: Array
    with_repeatability: Flags
    certificate: Integers
    free: Integers | None = None

    @property
    def to_pivot(self) -> Flags:
        """Mask (m,) of lengths from a reading to a pivot."""
        return self.second < 0

    @property
    def is_known(self) -> Flags:
        """Mask (m,) of lengths with a certificate."""
        return np.full(len(self.value), True) if self.free is None else self.free < 0
