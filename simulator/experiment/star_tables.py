"""Tables of stars compared with the stated offsets of their probes.

A table has its own axes; it is turned, and shifted if the star's location is unknown, to the
nearest fit of its tips to the offsets. A mirror image is not a turn, and two exchanged tips of a
symmetric star form one: distances would not show it.
"""

from __future__ import annotations

import numpy as np
from ballplate.simulator.design.observations.star import Star
from ballplate.simulator.inputs.settings import listing
from ballplate.simulator.machines.protocol import Array

# Stated offsets are nominal, and wrong by this much in metres before anybody need be told.
NOMINAL = 3e-3
# So many standard uncertainties of a tip are possible.
POSSIBLE = 5.0


def doubt_of_table(star: Star, offsets: Array) -> str:
    """Return an improbable feature of a star's table compared with the stated offsets (l, d) of
    its probes, in metres; possibly empty.
    """
    misfit = _misfit(star, offsets)
    worst, possible = float(misfit.max()), POSSIBLE * star.standard_uncertainty
    if worst <= max(NOMINAL, possible):
        return ""
    far = [
        f'"{name}"'
        for name, misfit_of_probe in zip(star.probes, misfit, strict=True)
        if misfit_of_probe > 0.5 * worst
    ]
    return (
        f"its tips are up to {_length(worst)} from the stated offsets, however it is turned, most"
        f" of all {listing(far)}; check which tip is which, in the table and among the probes"
    )


def _misfit(star: Star, offsets: Array) -> Array:
    """Distances (..., l) between offsets (..., l, d) and the table, turned to be nearest."""
    placed = star.coordinates @ star.rotation(offsets).swapaxes(-1, -2)
    difference = offsets - placed
    if not star.has_place:
        difference = difference - difference.mean(axis=-2, keepdims=True)
    return np.asarray(np.linalg.norm(difference, axis=-1))


def _length(value: float) -> str:
    return f"{1e3 * value:.1f} mm"
