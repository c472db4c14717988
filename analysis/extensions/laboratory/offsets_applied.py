"""Distinction between scale readings and ball centres, if the readings allow it.

The offsets of two probes that read in one position differ; readings of both fit one artefact only
as the right type. A shift of all readings of a position is one of its pose: with one probe in each
position, the two are confounded.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.design import (
    Design,
    Flags,
    Readings,
    locations,
    measured,
    nominal_state,
    read_in_positions,
)
from ballplate.simulator.estimation import initial_state
from ballplate.simulator.experiment import CompensationSettings, ReadingsSettings
from ballplate.simulator.inputs import Mark, format_length
from ballplate.simulator.machines import Array

from .common_causes import TURNED, poses_found
from .consensus import consensus_motion
from .coordinate_kinds import controller_offsets
from .gross_errors import AGAINST_DRAWING, ball_pitches
from .wrong_offsets import wrong_offsets

# One hypothesis is right and another wrong if the readings scatter so many times more with the
# latter, and by so many repeatabilities.
CLEARLY = 5.0
REPEATABILITIES = 5.0


@dataclass(frozen=True)
class Hypothesis:
    """Possible type of co-ordinates: locations of balls after adding the offsets `times` times."""

    name: str
    times: float


HYPOTHESES = (
    Hypothesis("scale readings", 1.0),
    Hypothesis("ball centres", 0.0),
    Hypothesis("scale readings with offsets of the other sign", -1.0),
)

REMEDIES = {
    "ball centres": (
        "if the measuring program has applied the offsets of probes, write readings: {coordinates:"
        ' ball centres} in the experiment file, or give --coordinates "ball centres"; otherwise'
        " correct the offsets under probes"
    ),
    "scale readings": "write coordinates: scale readings, or correct offsets_in_controller",
    "scale readings with offsets of the other sign": (
        "correct the signs of the offsets under probes, or the names of probes that are exchanged"
    ),
}
UNTOLD = (
    "these readings do not tell whether the offsets of probes have been applied to them, since they"
    " would agree either way; they are taken for scale readings: write readings: {coordinates:"
    " scale readings} in the experiment file, or ball centres"
)


@dataclass(frozen=True)
class OffsetVerdict:
    """Distances of decisive readings from their balls (metres, the median), by hypothesis, and the
    hypothesis that is clearly right, if one is.
    """

    scatter: dict[str, float]
    right: str | None


def judge_offsets(
    design: Design, readings: Readings, x: Array, applied: Array | None = None
) -> OffsetVerdict:
    """Return the type of co-ordinates (m, d) of readings of plates, if a position was read with
    different offsets.

    `applied` (l, d) are the offsets in ball centres, if they differ from the design's.
    """
    plate = np.flatnonzero(design.artefacts.is_plate[design.balls.artefact[readings.ball]])
    plate_readings = readings.select(plate)
    # What is not read across a plate is where it was drawn, whatever the offset.
    is_read = measured(design, plate_readings)
    offsets = np.where(is_read, design.probes.offsets[plate_readings.probe], 0.0)
    x = np.where(is_read, x[plate], locations(design, nominal_state(design), plate_readings))
    telling = _of_several_offsets(plate_readings, offsets)
    if not telling.any():
        return OffsetVerdict({}, None)
    pitch = ball_pitches(design)[plate_readings.ball]
    offsets_left = (
        offsets if applied is None else np.where(is_read, applied[plate_readings.probe], 0.0)
    )
    places_by_hypothesis = {
        hypothesis.name: x
        + (hypothesis.times * offsets if hypothesis.times else offsets - offsets_left)
        for hypothesis in HYPOTHESES
    }
    scatter = {
        name: float(np.median(_apart(design, plate_readings, places)[telling]))
        for name, places in places_by_hypothesis.items()
    }
    first, second = sorted(scatter.values())[:2]
    noise = float(np.max(design.machine.repeatability))
    if second < max(CLEARLY * first, REPEATABILITIES * noise):
        return OffsetVerdict(scatter, None)
    right = min(scatter, key=lambda name: scatter[name])
    return OffsetVerdict(
        scatter,
        right
        if _is_of_drawing(design, plate_readings, places_by_hypothesis[right], pitch)
        else None,
    )


def _of_several_offsets(readings: Readings, offsets: Array) -> Flags:
    """Return a mask of readings in positions that were read with different offsets."""
    telling = np.zeros(len(readings), bool)
    for k in np.unique(readings.position):
        is_of_position = readings.position == k
        telling[is_of_position] = (offsets[is_of_position] != offsets[is_of_position][0]).any()
    return telling


def _is_of_drawing(design: Design, readings: Readings, places: Array, pitch: Array) -> bool:
    """True if most points at (m, d) are those of the nominal artefact, position by position."""
    for _, rows, nominal in read_in_positions(design, readings):
        if len(np.unique(readings.ball[rows])) < 2:
            continue
        _, _, agreeing = consensus_motion(nominal, places[rows], AGAINST_DRAWING * pitch[rows])
        if 2 * agreeing.sum() <= len(rows):
            return False
    return True


def _apart(design: Design, readings: Readings, seen_places: Array) -> Array:
    """Return distances (m,) of points at (m, d) from their balls in the assembled plates."""
    # Places seen are readings of a probe without an offset.
    probes = replace(design.probes, offsets=np.zeros_like(design.probes.offsets))
    state = initial_state(replace(design, readings=readings, probes=probes), seen_places)
    places = np.einsum("mij,mj->mi", state.rotations[readings.position], state.balls[readings.ball])
    apart = seen_places - places - state.origins[readings.position]
    return np.sqrt((apart**2).sum(axis=1))


def doubt_about_offsets(
    design: Design, readings: Readings, x: Array, settings: ReadingsSettings, mark: Mark
) -> tuple[str, ...]:
    """Return a doubt about co-ordinates x (m, d) in the table: scale readings are assumed, and the
    readings do not decide.

    :raises ExperimentError: they clearly differ from the stated or assumed type.
    """
    coordinates_stated = settings.coordinates
    is_read = measured(design, readings)
    if not (is_read & (design.probes.offsets[readings.probe] != 0.0)).any():
        return ()
    verdict = judge_offsets(design, readings, x, controller_offsets(design, settings))
    coordinates_taken = (
        "ball centres" if coordinates_stated == "part" else coordinates_stated or HYPOTHESES[0].name
    )
    if verdict.right is None:
        return () if coordinates_stated else (UNTOLD,)
    if verdict.right == coordinates_taken:
        return ()
    shown = {
        name: format_length(float(f"{scatter:.2g}")) for name, scatter in verdict.scatter.items()
    }
    why = "which is stated" if coordinates_stated else "the default"
    if coordinates_stated == "part":
        why = "which part co-ordinates are, and part is stated"
    text = (
        f"readings with different probes agree to {shown[verdict.right]} (the median) as"
        f" {verdict.right}, but only to {shown[coordinates_taken]} as {coordinates_taken}, {why};"
        f" {REMEDIES[verdict.right]}"
    )
    if verdict.right == "ball centres" and is_read.all():
        poses = poses_found(design, readings, x) or {}
        if any(angle > TURNED for angle, _ in poses.values()):
            text += "; or write part instead, since the artefact is turned against the plan in them"
    if coordinates_taken == HYPOTHESES[0].name and is_read.all():
        mistakes = wrong_offsets(design, readings, x)
        text += "".join(f"; or {mistake.words(design)}" for mistake in mistakes)
    raise mark.refused(text)


def said_of(settings: ReadingsSettings) -> tuple[str, ...]:
    """Return notes on estimates from co-ordinates other than scale readings of an uncorrected
    machine.
    """
    sentences = []
    if settings.coordinates == "part":
        sentences.append(
            "part co-ordinates were placed by the nominal poses: errors are estimated at the"
            " artefact's planned locations"
        )
    if settings.compensation == "on":
        sentences.append(
            "the machine's own correction was on: the estimates are the errors that it leaves"
        )
    if isinstance(settings.compensation, CompensationSettings):
        sentences.append(
            f"the correction of {settings.compensation.file} was subtracted: the estimates are all"
            " errors of the machine"
        )
    return tuple(sentences)
