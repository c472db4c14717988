"""Scale readings from the output of measuring programs: centres of balls, in machine or part
co-ordinates, with or without the machine's own correction.
"""

from __future__ import annotations

import numpy as np
from ballplate.simulator.design import Design, Readings
from ballplate.simulator.experiment import CompensationSettings, ReadingsSettings
from ballplate.simulator.geometry import fixes_pose
from ballplate.simulator.inputs import listing, refused
from ballplate.simulator.machines import Array
from ballplate.simulator.readings import NoReadingError, scale_readings

from .consensus import consensus_motion
from .gross_errors import AGAINST_DRAWING, ball_pitches
from .plate_sizes import read_in_positions
from .probe_matching import nominal_places


def controller_offsets(design: Design, settings: ReadingsSettings) -> Array:
    """Offsets (l, d) that the measuring program has applied to ball centres."""
    offsets = design.probes.offsets.copy()
    for name, offset in (settings.offsets_in_controller or {}).items():
        offsets[design.probes.names.index(name)] = offset
    return offsets


def as_scale_readings(
    design: Design, readings: Readings, x: Array, settings: ReadingsSettings, file: object
) -> Array:
    """Return scale readings (m, d) of co-ordinates (m, d) of the stated type.

    The controller's offset is subtracted from ball centres. Part co-ordinates are first moved to
    the nominal pose of each position: the estimated pose absorbs the rest, and the machine's
    errors are evaluated as far off as the artefact was from its nominal pose. A stated correction
    of the machine is subtracted last.

    :raises ExperimentError: a position has too few balls to move its part co-ordinates, the
        correction is too large to subtract, or some co-ordinates were not read.
    """
    correction = settings.compensation
    is_taken_off = isinstance(correction, CompensationSettings)
    if design.positions.across is not None and (settings.coordinates == "part" or is_taken_off):
        text = "part co-ordinates and subtracting a correction need all co-ordinates of balls"
        raise refused(file, f"{text}; give scale readings")
    if settings.coordinates == "part":
        x = _in_machine(design, readings, x, file)
    offsets = controller_offsets(design, settings)[readings.probe]
    if settings.coordinates in ("ball centres", "part"):
        x = x - offsets
    if isinstance(correction, CompensationSettings):
        machine = correction.machine()
        try:
            x = scale_readings(machine.model, x + offsets, machine.a, offsets)
        except NoReadingError:
            text = f"the correction of {correction.file} is too large to be subtracted"
            raise refused(file, text) from None
    return x


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


def _in_machine(design: Design, readings: Readings, x: Array, file: object) -> Array:
    """Part co-ordinates moved to where the nominal poses have the balls."""
    pitch, placed = ball_pitches(design), np.empty_like(x)
    poor = []
    for k, rows, nominal in read_in_positions(design, readings):
        there = nominal_places(design, k, readings.ball[rows])
        if not fixes_pose(nominal):
            poor.append(design.positions.names[k])
            continue
        reach = AGAINST_DRAWING * pitch[readings.ball[rows]]
        rotation, origin, _ = consensus_motion(x[rows], there, reach)
        placed[rows] = x[rows] @ rotation.T + origin
    if poor:
        text = (
            f"too few balls were read in {listing(poor)} to locate part co-ordinates; give machine"
            " co-ordinates"
        )
        raise refused(file, text)
    return placed
