"""Causes common to all readings: exchanged or reversed axes, another unit, part co-ordinates.

If the readings of most positions fit no artefact in its planned pose, one such cause is likelier
than many separate slips. A cause is reported only if all positions fit with it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import permutations, product

import numpy as np
from ballplate.simulator.design import (
    Design,
    Readings,
    nominal_places,
    read_in_positions,
)
from ballplate.simulator.experiment import ReadingsSettings
from ballplate.simulator.geometry import AXIS_NAMES, fixes_pose
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Array

from .consensus import consensus_motion
from .coordinate_kinds import controller_offsets
from .gross_errors import AGAINST_DRAWING, ball_pitches

# Units that are taken for one another, with their ratio.
RATIOS = {
    25.4: "inches that are read as millimetres",
    1 / 25.4: "millimetres that are read as inches",
    10.0: "centimetres that are read as millimetres",
    0.1: "millimetres that are read as centimetres",
    1000.0: "a unit a thousand times larger",
    0.001: "a unit a thousand times smaller",
}
# A plate turned by less than this (degrees) against its nominal pose, and shifted by less than this
# part of the volume, stands as planned.
TURNED = 20.0
SHIFTED = 0.25


def poses_found(
    design: Design, readings: Readings, seen_places: Array
) -> dict[int, tuple[float, float]] | None:
    """Return by position the angle (degrees) and the distance (m) between the artefact's pose from
    readings at (m, d) and the planned one, None if the readings do not fit the artefact.

    Only positions of plates count whose balls fix the pose.
    """
    pitch, poses = ball_pitches(design), {}
    for k, rows, nominal in read_in_positions(design, readings):
        is_plate = design.artefacts.is_plate[design.positions.artefact[k]]
        if not is_plate or not fixes_pose(nominal):
            continue
        reach = AGAINST_DRAWING * pitch[readings.ball[rows]]
        rotation, _, agreeing = consensus_motion(nominal, seen_places[rows], reach)
        if 4 * agreeing.sum() <= 3 * len(rows):
            return None
        planned = design.positions.rotations[k]
        there = nominal.mean(axis=0) @ planned.T + design.positions.origins[k]
        shift = seen_places[rows].mean(axis=0) - there
        turn = planned.T @ rotation
        cosine = turn[0, 0] if design.dimension == 2 else (np.trace(turn) - 1.0) / 2.0
        angle = float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
        poses[int(k)] = angle, float(np.sqrt(shift @ shift))
    return poses


def _as_planned(design: Design, readings: Readings, seen_places: Array) -> bool:
    poses = poses_found(design, readings, seen_places)
    return bool(poses) and all(angle < TURNED for angle, _ in (poses or {}).values())


def common_cause(design: Design, x: Array, settings: ReadingsSettings) -> str:
    """Return the change with which all readings fit; possibly empty.

    x (readings, d) are scale readings, computed from the table by the stated settings.
    """
    readings = design.readings
    offsets = design.probes.offsets[readings.probe]
    if settings.coordinates in ("ball centres", "part"):
        # What is wrong with centres is wrong before the controller's offsets are taken off.
        applied = controller_offsets(design, settings)[readings.probe]
        places_given, offsets = x + applied, offsets - applied
    else:
        places_given = x
    if settings.coordinates == "part":
        # Of these only the unit tells: they may be turned in any way.
        changes = ((text, ratio * places_given) for text, ratio in _units())
        fitting = [text for text, changed in changes if poses_found(design, readings, changed)]
        return ", or ".join(fitting)
    causes = [
        text
        for text, changed in _changed(places_given)
        if _as_planned(design, readings, changed + offsets)
    ]
    if not causes:
        poses = poses_found(design, readings, places_given)
        if poses and any(angle > TURNED for angle, _ in poses.values()):
            causes.append(
                "if they are centres in co-ordinates of a part, another in each position; then"
                " write readings: {coordinates: part}"
            )
    return ", or ".join(causes)


def _changed(x: Array) -> Iterator[tuple[str, Array]]:
    """Readings with their axes exchanged, or in other units, and as text how."""
    d = x.shape[1]
    for order in permutations(range(d)):
        for signs in product((1, -1), repeat=d):
            if order == tuple(range(d)) and min(signs) > 0:
                continue
            names = " and ".join(
                f"the table's {AXIS_NAMES[k]} is {'-' * (sign < 0)}{AXIS_NAMES[i]}"
                for i, (k, sign) in enumerate(zip(order, signs, strict=True))
                if (i, 1) != (k, sign)
            )
            yield f"if {names}", x[:, order] * np.array(signs)
    for text, ratio in _units():
        yield text, x * ratio


def _units() -> Iterator[tuple[str, float]]:
    for ratio, unit_name in RATIOS.items():
        yield f"if lengths are in {unit_name}", ratio


def mistaken_positions(design: Design, readings: Readings, seen_places: Array) -> dict[int, int]:
    """Return positions of plates most of whose readings at (m, d) are in the planned pose of
    another one and not in their own, each with that other one.
    """
    reach, mistaken = AGAINST_DRAWING * ball_pitches(design), {}
    artefacts = design.positions.artefact
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
    """That positions are where others were planned, and what to do."""
    names = design.positions.names
    pairs = listing(f"{names[k]} at that of {names[j]}" for k, j in mistaken.items())
    is_exchange = set(mistaken) == set(mistaken.values())
    advice = "exchange the names of positions" if is_exchange else "correct the names of positions"
    return (
        f"readings are at the planned location of another position, {pairs}: {advice}, or the"
        " planned poses"
    )


def doubts_about_poses(design: Design, x: Array) -> tuple[str, ...]:
    """Return a sentence about plates far from their planned pose, which machines rarely cause;
    possibly empty.
    """
    readings = design.readings
    places = x + design.probes.offsets[readings.probe]
    poses = poses_found(design, readings, places) or {}
    size = float(design.machine.volume.size.max())
    far = {k: pose for k, pose in poses.items() if pose[0] > TURNED or pose[1] > SHIFTED * size}
    mistaken = mistaken_positions(design, readings, places)
    if mistaken:
        return (words_of_mistaken(design, mistaken),)
    if not far:
        return ()
    k = max(far, key=lambda k: far[k])
    angle, shift = far[k]
    names = listing(design.positions.names[i] for i in far)
    return (
        f"the readings of {names} are of an artefact that stood elsewhere than planned"
        f" ({design.positions.names[k]}: turned by {angle:.0f} degrees, its middle"
        f" {1e3 * shift:.0f} mm away): if they are co-ordinates of a part, write readings:"
        " {coordinates: part}; otherwise correct the positions",
    )
