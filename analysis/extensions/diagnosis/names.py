"""Names of observations and events in a metrologist's terms."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.design import CalibratedDistances, Design, length_name
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import Integers

from .bias_patterns import Patterns


def name(biases: Patterns, k: int, with_position: bool = True) -> str:
    """Return the name of a pattern's subject; a reading's may omit its position."""
    kind, subject = biases.kind[k], int(biases.subject[k])
    design, axis = biases.design, int(biases.axis[k])
    letter = AXIS_NAMES[axis] if axis >= 0 else ""
    if kind in ("reading", "end"):
        return f"{reading_name(design, subject, with_position)}, {letter}"
    for observation in design.observations:
        if observation.word == kind:
            return observation.name(design, subject)
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
        return f"position {design.positions.names[subject]} slipped {slip_place(biases, k)}, {how}"
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
    """Return the first ball that several distances have in common."""
    ends = design.of(CalibratedDistances).balls[distances]
    return next(int(ball) for ball in ends[0] if (ends == ball).any(axis=1).all())


def slip_place(biases: Patterns, k: int) -> str:
    """Return the moment in a position before which a slip is tested."""
    design, position, start = biases.design, int(biases.subject[k]), int(biases.start[k])
    rows = np.flatnonzero(design.readings.position == position)
    probe = design.readings.probe[rows]
    index = int(np.searchsorted(rows, start))
    if probe[index - 1] != probe[index] and probe[index - 1] not in probe[index:]:
        return f"before probe {design.probes.names[probe[index]]}"
    half = "half-way, " if index == len(rows) // 2 else ""
    return f"{half}before ball {design.ball_label(int(design.readings.ball[start]))}"


def reading_name(design: Design, reading: int, with_position: bool = True) -> str:
    """Return a reading's ball and position, with its probe if there are several."""
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
