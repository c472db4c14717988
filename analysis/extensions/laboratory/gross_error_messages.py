"""Messages about the lines of a file of readings that cannot be right, and their probable cause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from ballplate.simulator.design import SLIGHTLY, Design, Lengths, Readings
from ballplate.simulator.inputs import ExperimentError, Mark, Message, format_length
from ballplate.simulator.machines import Array

from .gross_errors import WrongPosition, WrongReading, find_gross_errors
from .length_ratios import LengthRatio, doubtful_lengths
from .plate_sizes import words_of_size

# Unexplained readings beyond this share have a cause in common.
FEW = 0.2


def refuse_gross_errors(design: Design, x: Array, marks: Sequence[Mark]) -> None:
    """Refuse scale readings x (readings, d) that cannot be of the stated ball, probe or length.

    `marks` are the locations of the design's readings. The rules are those of `gross_errors` and
    `length_ratios`.

    :raises ExperimentError: gross errors; names all of them.
    """
    positions, readings = find_gross_errors(design, x)
    if (positions or readings) and (size := words_of_size(design, x)):
        raise marks[0].refused(size)
    unexplained = [wrong.reading for wrong in readings if wrong.is_unexplained]
    if len(unexplained) > FEW * len(design.readings):
        text = (
            f"{len(unexplained)} of {len(design.readings)} readings do not fit the others: correct"
            " the offsets of probes, the names of balls and probes, or readings: {coordinates: …}"
        )
        raise marks[unexplained[0]].refused(text)
    messages = [_of_position(design, wrong, marks) for wrong in positions]
    handled = set()
    for wrong in readings:
        if wrong.reading not in handled:
            messages.append(_of_reading(design, wrong, marks))
            handled |= {wrong.reading, wrong.partner}
    if not messages:
        messages = [
            marks[mistake.reading].message("", _of_length(design, mistake))
            for mistake in doubtful_lengths(design, x)
            if mistake.is_impossible
        ]
    if messages:
        raise ExperimentError(sorted(messages, key=lambda message: (message.line, message.text)))


def with_names_swapped(
    design: Design, readings: Readings, x: Array, marks: Sequence[Mark]
) -> tuple[Readings, tuple[str, ...]]:
    """Return readings of plates with the names of two balls exchanged if scale readings x (m, d)
    show that they are, with a note; others are unchanged.
    """
    plate = np.flatnonzero(design.artefacts.is_plate[design.balls.artefact[readings.ball]])
    of_plates = replace(design, readings=readings.select(plate)).observed(
        design.of(Lengths).select(np.zeros(0, np.int64))
    )
    ball, notes = readings.ball.copy(), []
    for wrong in find_gross_errors(of_plates, x[plate])[1]:
        i, j = int(plate[wrong.reading]), int(plate[wrong.partner])
        if wrong.other_ball < 0 or wrong.partner < wrong.reading:
            continue
        ball[i], ball[j] = readings.ball[j], readings.ball[i]
        names = " and ".join(design.ball_label(int(readings.ball[k])) for k in (i, j))
        notes.append(
            f"the names of balls {names} in position {design.positions.names[readings.position[i]]}"
            f" were swapped (lines {marks[i].line} and {marks[j].line})"
        )
    return replace(readings, ball=ball), tuple(notes)


def doubts_about_lengths(design: Design, x: Array) -> tuple[str, ...]:
    """Return sentences about standards whose lengths all differ by an improbable factor."""
    return tuple(_of_length(design, length) for length in doubtful_lengths(design, x))


def doubts_about_volume(design: Design, x: Array, marks: Sequence[Mark]) -> tuple[str, ...]:
    """Return a sentence about readings outside the volume, where error models are extrapolated;
    possibly empty.

    Excess below a thousandth of the volume is normal for an artefact set up by hand.
    """
    volume = design.machine.volume
    beyond = np.maximum(volume.lower - x, x - volume.upper)
    far = np.flatnonzero((beyond > SLIGHTLY * volume.size).any(axis=1))
    if not len(far):
        return ()
    i = int(far[beyond[far].max(axis=1).argmax()])
    axis = int(beyond[i].argmax())
    how = "below" if x[i, axis] < volume.lower[axis] else "above"
    readings = design.readings
    where = f" (line {marks[i].line})" if marks else ""
    count = "1 reading is" if len(far) == 1 else f"{len(far)} readings are"
    return (
        (
            f"{count} outside the measuring volume, and the error model is extrapolated there;"
            f" furthest is ball {design.ball_label(int(readings.ball[i]))} in position"
            f" {design.positions.names[readings.position[i]]} with probe"
            f" {design.probes.names[readings.probe[i]]}, at {'xyz'[axis]} ="
            f" {_shown(float(x[i, axis]))}, {_shown(float(beyond[i, axis]))} {how} it{where};"
            " correct machine.volume, or the readings"
        ),
    )


def _of_length(design: Design, length_error: LengthRatio) -> str:
    name = design.artefacts.names[length_error.artefact]
    subject, verb = ("radius", "is") if length_error.is_radius else ("lengths", "are")
    word = "stated" if length_error.is_known else "drawn"
    stated_text = (
        f"the {word} {format_length(length_error.stated)}"
        if length_error.is_radius
        else f"the {word} ones"
    )
    why = (
        "no machine has such a scale error"
        if length_error.is_impossible
        else "it passes for a scale error"
    )
    ratio = (
        f"{length_error.ratio:.3g}" if length_error.is_impossible else f"{length_error.ratio:.4f}"
    )
    return (
        f"{name}: the read {subject} {verb} {ratio} of"
        f" {stated_text}{f'; {why}' if length_error.is_known else ''}:"
        f" correct the {'radius' if length_error.is_radius else 'length'} in the experiment file,"
        " or the"
        " unit of the readings"
    )


def _of_position(design: Design, wrong: WrongPosition, marks: Sequence[Mark]) -> Message:
    first = marks[int(np.flatnonzero(design.readings.position == wrong.position)[0])]
    name = design.positions.names[wrong.position]
    artefact = design.artefacts.names[design.positions.artefact[wrong.position]]
    if wrong.turned:
        text = (
            f"position {name}: the readings fit the {artefact} turned {wrong.turned}; correct the"
            " names of the balls that are read there, the columns of the axes, or the turn that the"
            " experiment file states for the position"
        )
    else:
        probes = design.readings.probe[design.readings.position == wrong.position]
        of_probes = "the offsets of probes, readings: {coordinates: …}, "
        text = (
            f"position {name}: only {wrong.agreeing} of {wrong.count} readings fit the {artefact}"
            " in any one pose; correct the names of the balls that are read there,"
            f" {of_probes if len(np.unique(probes)) > 1 else ''}or the artefact"
        )
    return first.message("", text)


def _of_reading(design: Design, wrong: WrongReading, marks: Sequence[Mark]) -> Message:
    readings, i = design.readings, wrong.reading
    ball = design.ball_label(int(readings.ball[i]))
    position = design.positions.names[readings.position[i]]
    far = _shown(float(np.sqrt(wrong.misfit @ wrong.misfit)))
    if wrong.undecided:
        elsewhere = design.positions.names[readings.position[wrong.partner]]
        text = (
            f"ball {ball} in position {position} is {far} from its location in position"
            f" {elsewhere}, line {marks[wrong.partner].line}; correct or remove one of the two"
            " lines"
        )
    elif wrong.other_ball >= 0:
        alternative = design.ball_label(wrong.other_ball)
        text = f"ball {ball} in position {position} is where ball {alternative} should be; "
        if wrong.partner >= 0:
            text += (
                f"swap the names of the balls in lines {marks[i].line} and"
                f" {marks[wrong.partner].line}"
            )
        else:
            text += "correct its name, or remove the line"
    elif wrong.other_probe >= 0:
        probe, alternative = (
            design.probes.names[readings.probe[i]],
            design.probes.names[wrong.other_probe],
        )
        text = (
            f"ball {ball} in position {position} fits the probe {alternative}, not {probe};"
            " correct the"
            " name of the probe"
        )
    else:
        along = ", ".join(
            f"{axis} {'+' if part > 0 else ''}{_shown(float(part))}"
            for axis, part in zip("xyz", wrong.misfit, strict=False)
            if abs(part) > 0.01 * np.abs(wrong.misfit).max()
        )
        text = (
            f"ball {ball} in position {position} is {far} from its expected location ({along});"
            " correct or remove it"
        )
    return marks[i].message("", text)


def _shown(length: float) -> str:
    """A length to three digits.

    >>> _shown(0.0123456)
    '12.3 mm'
    """
    return format_length(float(f"{length:.3g}"))
