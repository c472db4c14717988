"""Positions whose readings are at the planned location of another one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from ballplate.simulator.design import Design
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Array

from .gross_errors import AGAINST_DRAWING, ball_pitches
from .probe_matching import nominal_places


def mistaken_positions(design: Design, x: Array) -> dict[int, int]:
    """Return positions of plates most of whose scale readings x (readings, d) are in the planned
    pose of another one and not in their own, each with that other one.
    """
    readings, artefacts = design.readings, design.positions.artefact
    seen_places = x + design.probes.offsets[readings.probe]
    reach, mistaken = AGAINST_DRAWING * ball_pitches(design), {}
    for k in np.unique(readings.position).tolist():
        rows = np.flatnonzero(readings.position == k)
        ball = readings.ball[rows]
        is_same = design.artefacts.is_plate[artefacts] & (artefacts == artefacts[k])
        apart = {}
        for j in np.flatnonzero(is_same).tolist():
            there = nominal_places(design, j, ball)
            off = np.sqrt(((seen_places[rows] - there) ** 2).sum(axis=1))
            apart[j] = float(np.median(off / reach[ball]))
        nearest = min(apart, key=lambda j: apart[j], default=k)
        if apart.get(k, 0.0) > 1.0 and apart[nearest] <= 1.0:
            mistaken[k] = nearest
    return mistaken


def words_of_mistaken(design: Design, mistaken: Mapping[int, int]) -> str:
    """That positions are where others were planned, and what to do; empty without any."""
    if not mistaken:
        return ""
    names = design.positions.names
    pairs = listing(f"{names[k]} at that of {names[j]}" for k, j in mistaken.items())
    is_exchange = set(mistaken) == set(mistaken.values())
    advice = "exchange the names of positions" if is_exchange else "correct the names of positions"
    return (
        f"readings are at the planned location of another position, {pairs}: {advice}, or the"
        " planned poses"
    )
