"""Names of observations and events, as a metrologist would say them."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.lengths import length_name
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.machines.protocol import Integers

from .bias_patterns import Patterns


def name(given: Patterns, k: int, with_position: bool = True) -> str:
    """What a pattern is about; a reading's may be without its position."""
    kind, subject = given.kind[k], int(given.subject[k])
    design, axis = given.design, int(given.axis[k])
    letter = AXIS_NAMES[axis] if axis >= 0 else ""
    if kind in ("reading", "end"):
        return f"{reading_name(design, subject, with_position)}, {letter}"
    for one in design.observations:
        if one.word == kind:
            return one.name(design, subject)
    if kind == "ball":
        ball, position = design.readings.ball[subject], design.readings.position[subject]
        return (
            f"dirt on ball {design.ball_label(int(ball))} in position"
            f" {design.positions.names[position]}, {letter}"
        )
    if kind == "moved":
        ball, position = design.readings.ball[subject], design.readings.position[subject]
        where = f"from position {design.positions.names[position]} on"
        return f"ball {design.ball_label(int(ball))} displaced {where}, along {letter} of the plate"
    if kind in ("shift", "turn"):
        how = f"along {letter}" if kind == "shift" else f"turned about {letter}"
        return f"position {design.positions.names[subject]} slipped {slip_place(given, k)}, {how}"
    if kind == "probe":
        return f"offset {letter} of probe {design.probes.names[subject]}"
    if kind == "length value":
        return f"certified {length_name(design, subject, of_reading=False)}"
    if kind == "drift":
        return f"drift along {letter} over the campaign"
    if kind == "scale drift":
        return "drift of the scales over the campaign"
    if kind == "scale":
        return f"scale of the certificate of {design.artefacts.names[subject]}"
    return f"expansion in position {design.positions.names[subject]}"


def common_ball(design: Design, distances: Integers) -> int:
    """The ball that several distances have in common; of two between the same balls, the first."""
    ends = design.of(CalibratedDistances).balls[distances]
    return next(int(ball) for ball in ends[0] if (ends == ball).any(axis=1).all())


def slip_place(given: Patterns, k: int) -> str:
    """Where in a position a slip of the artefact is looked for."""
    design, position, start = given.design, int(given.subject[k]), int(given.start[k])
    rows = np.flatnonzero(design.readings.position == position)
    probe = design.readings.probe[rows]
    at = int(np.searchsorted(rows, start))
    if probe[at - 1] != probe[at] and probe[at - 1] not in probe[at:]:
        return f"before probe {design.probes.names[probe[at]]}"
    half = "half-way, " if at == len(rows) // 2 else ""
    return f"{half}before ball {design.ball_label(int(design.readings.ball[start]))}"


def reading_name(design: Design, reading: int, with_position: bool = True) -> str:
    """A reading by ball and position, and by its probe where there are several."""
    readings = design.readings
    position = (
        f" in position {design.positions.names[readings.position[reading]]}"
        if with_position
        else ""
    )
    probe = (
        f" with {design.probes.names[readings.probe[reading]]}"
        if len(design.probes.names) > 1
        else ""
    )
    return f"ball {design.ball_label(int(readings.ball[reading]))}{position}{probe}"
