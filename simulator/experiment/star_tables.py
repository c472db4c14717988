"""Tables of stars compared with the stated offsets of their probes: exchanged tips, and displaced
tips.

A table has its own axes; it is turned, and shifted if the star's location is unknown, to the
nearest fit of its tips to the offsets. A mirror image is not a turn, and two exchanged tips of a
symmetric star form one: distances would not show it.
"""

from __future__ import annotations

import numpy as np

from ..design.observations.star import Star
from ..inputs.settings import listing
from ..machines.protocol import Array

# Stated offsets are nominal, and wrong by this much in metres before anybody need be told; of an
# exchange, which leaves far less when it is undone, less is enough.
NOMINAL, EXCHANGED = 3e-3, 1e-3
# By which factor the misfit is smaller without an exchange.
CLEARLY = 4.0
# So many standard uncertainties of a tip are possible.
POSSIBLE = 5.0
# Exchanges are looked for among so many tips at most; there are as many as pairs.
MOST_TIPS = 100


def doubt_of_table(star: Star, offsets: Array) -> str:
    """Return an improbable feature of a star's table compared with the stated offsets (l, d) of
    its probes, in metres; possibly empty.
    """
    misfit = _misfit(star, offsets)
    worst, possible = float(misfit.max()), POSSIBLE * star.standard_uncertainty
    if worst <= max(EXCHANGED, possible):
        return ""
    exchanged = _exchange(star, offsets) if len(offsets) <= MOST_TIPS else None
    if exchanged is not None:
        (i, j), remaining = exchanged
        if remaining * CLEARLY < worst:
            return (
                f"its tips are up to {_length(worst)} from the stated offsets, however it is"
                f' turned, and within {_length(remaining)} if "{star.probes[i]}" and'
                f' "{star.probes[j]}" are exchanged; check which is which, in the table and among'
                " the probes"
            )
    if worst <= max(NOMINAL, possible):
        return ""
    far = [
        f'"{name}"'
        for name, misfit_of_probe in zip(star.probes, misfit, strict=True)
        if misfit_of_probe > 0.5 * worst
    ]
    return (
        f"its tips are up to {_length(worst)} from the stated offsets, however it is turned, most"
        f" of all {listing(far)}; correct the table or the offsets"
    )


def _misfit(star: Star, offsets: Array) -> Array:
    """Distances (..., l) between offsets (..., l, d) and the table, turned to be nearest."""
    placed = star.coordinates @ star.rotation(offsets).swapaxes(-1, -2)
    difference = offsets - placed
    if not star.has_place:
        difference = difference - difference.mean(axis=-2, keepdims=True)
    return np.asarray(np.linalg.norm(difference, axis=-1))


def _exchange(star: Star, offsets: Array) -> tuple[tuple[int, int], float]:
    """Return the two tips whose exchange brings the table nearest to offsets, and the remaining
    misfit.

    Exchanges in a symmetric star differ by a turn: among those that leave as little, the one with
    the least turn is likeliest, since most tables use axes like the machine's.
    """
    exchanges = []
    for i in range(len(offsets) - 1):
        later = np.arange(i + 1, len(offsets))
        tried = np.repeat(offsets[None], len(later), axis=0)
        tried[:, i] = offsets[later]
        tried[np.arange(len(later)), later] = offsets[i]
        misfits = _misfit(star, tried).max(axis=-1)
        turns = np.trace(star.rotation(tried), axis1=-2, axis2=-1)
        for j, misfit, turn in zip(later.tolist(), misfits.tolist(), turns.tolist(), strict=True):
            exchanges.append((misfit, -round(turn, 3), (i, j)))
    least = min(misfit for misfit, _, _ in exchanges)
    alike = [exchange for exchange in exchanges if exchange[0] <= least + EXCHANGED]
    left_over, _, pair = min(alike, key=lambda exchange: (exchange[1], exchange[2]))
    return pair, left_over


def _length(value: float) -> str:
    return f"{1e3 * value:.1f} mm"
