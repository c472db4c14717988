"""Suspects of a fit in words, with the lines of the readings' file, and as plain data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from simulator.design import Integers
from simulator.estimation.parameters import AXIS_NAMES
from simulator.experiment.yamltree import Mark
from simulator.settings import listing

from ..tables import SHOWN, number
from .names import length_name, name, reading_name
from .suspects import MOST, Suspect


def suspect_lines(found: Sequence[Suspect], marks: Sequence[Mark] = ()) -> list[str]:
    """A line for each suspect, the most significant first; `marks` tell where the readings stand."""
    lines = [f"suspected: {suspect_words(one, marks)}" for one in found]
    if len(found) == MOST:
        what = "look for what these have in common, or state larger uncertainties, or a richer error model"
        lines.append(f"suspected: there may be more than these {MOST}; {what}")
    return lines


def suspect_words(one: Suspect, marks: Sequence[Mark] = ()) -> str:
    """What is suspected, how significant it is, and what to do."""
    what, cure = _what(one, marks)
    others = f"; it cannot be told from {listing(list(one.alternatives))}" if one.alternatives else ""
    return f"{what} (statistic {number(one.statistic, 3)}, limit {number(one.limit, 3)}){others}; {cure}"


def with_uncertainty(value: float, uncertainty: float) -> str:
    """A value with its standard uncertainty in brackets, to the latter's first digit, or second if it is 1 or 2.

    >>> with_uncertainty(4.128, 0.71), with_uncertainty(31.28, 17.3), with_uncertainty(0.1234, 0.0123)
    ('4.1(0.7)', '31(17)', '0.123(0.012)')
    """
    exponent = math.floor(math.log10(uncertainty))
    decimals = max(-exponent + int(uncertainty / 10.0**exponent < 3.0), 0)
    return f"{value:.{decimals}f}({uncertainty:.{decimals}f})"


def _what(one: Suspect, marks: Sequence[Mark]) -> tuple[str, str]:
    given, k = one.patterns, one.pattern
    design, kind, subject, axis = given.design, given.kind[k], int(given.subject[k]), int(given.axis[k])
    size = f"{with_uncertainty(1e6 * abs(one.value), 1e6 * one.standard_uncertainty)} {SHOWN[one.unit]}"
    letter = AXIS_NAMES[axis] if axis >= 0 else ""
    high = "high" if one.value > 0 else "low"
    long = "long" if one.value > 0 else "short"
    touched = _touched(one)
    lines = _lines(touched, marks)
    leave = f"check or leave out {lines}" if lines else "check or leave out the readings"
    if kind in ("reading", "end"):
        return f"{reading_name(design, subject)} read {size} too {high} in {letter}", leave
    if kind == "length":
        return f"{name(given, k)} read {size} too {long}", leave
    if kind == "prior":
        return f"{name(given, k)} stated {size} too {high}", "check it in the experiment file"
    if kind == "coordinate":
        return f"{name(given, k)} certified {size} too {high}", "check the certificate"
    if kind in ("distance", "length value"):
        what = length_name(design, subject, False) if kind == "length value" else name(given, k)
        return f"{what} certified {size} too {long}", "check the certificate"
    if kind == "scale":
        artefact = design.artefact_names[subject]
        told = f"all that is certified of {artefact} is {size} too {long}"
        return told, "check the certificate, and the temperature of the artefact and of the scales"
    if kind == "probe":
        told = f"offset {letter} of probe {design.probe_names[subject]} stated {size} too {high}"
        return told, "qualify the probe again, or let its offset be estimated"
    if kind == "ball":
        ball = design.ball_label(int(design.readings.ball[subject]))
        place = design.position_names[design.readings.position[subject]]
        told = f"ball {ball} in position {place} read {size} too {high} in {letter} each time"
        return told, f"clean the ball, and {leave}"
    place = design.position_names[subject]
    artefact = design.artefact_names[design.position_artefact[subject]]
    if kind in ("shift", "turn"):
        how = f"by {'' if one.value > 0 else '-'}{size} {'along' if kind == 'shift' else 'about'} {letter}"
        start = [i for i in touched if i == int(given.start[k])]
        before = _lines(start, marks) or reading_name(design, int(given.start[k]))
        return (
            f"{artefact} slipped in position {place}, {how}, about before {before}",
            "read the position again, or state two positions, one for each part",
        )
    larger = "larger" if one.value > 0 else "smaller"
    return f"{artefact} {size} {larger} in position {place}", "check the temperature there"


def _touched(one: Suspect) -> list[int]:
    """Readings that a suspect is about."""
    given, k = one.patterns, one.pattern
    design, kind, subject = given.design, given.kind[k], int(given.subject[k])
    readings = design.readings
    if kind in ("reading", "end"):
        return [subject]
    if kind == "length":
        ends = (int(design.lengths.first[subject]), int(design.lengths.second[subject]))
        return [i for i in ends if i >= 0]
    if kind == "ball":
        same = (readings.ball == readings.ball[subject]) & (readings.position == readings.position[subject])
        return _indices(np.flatnonzero(same))
    if kind in ("shift", "turn"):
        return [int(given.start[k])]
    return []


def _indices(found: Integers) -> list[int]:
    return [int(i) for i in found]


def _lines(readings: Sequence[int], marks: Sequence[Mark]) -> str:
    """Where readings stand, such as "lines 5 and 7 of readings.csv"; empty if they stand in no file."""
    if not marks or not readings:
        return ""
    numbers = [str(marks[i].line) for i in readings]
    file = Path(marks[readings[0]].file).name
    if len(numbers) == 1:
        return f"line {numbers[0]} of {file}"
    return f"lines {', '.join(numbers[:-1])} and {numbers[-1]} of {file}"


def suspect_data(found: Sequence[Suspect], marks: Sequence[Mark] = ()) -> list[dict[str, Any]]:
    """Suspects as plain data in metres, radians and ratios."""
    return [
        {
            "name": name(one.patterns, one.pattern),
            "kind": str(one.patterns.kind[one.pattern]),
            "value": one.value,
            "standard_uncertainty": one.standard_uncertainty,
            "unit": one.unit,
            "statistic": one.statistic,
            "limit": one.limit,
            "lines": [marks[i].line for i in _touched(one)] if marks else [],
            "alternatives": list(one.alternatives),
            "words": suspect_words(one, marks),
        }
        for one in found
    ]
