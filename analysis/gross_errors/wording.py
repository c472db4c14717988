"""Suspects of a fit in words, with the lines of the readings' file, and as plain data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.settings import listing
from ballplate.simulator.inputs.yamltree import Mark
from ballplate.simulator.machines.protocol import Integers

from ..presentation.formatting import SHOWN, number, picked
from ..rank.proposed_bars import listed
from .bias_patterns import Patterns, position_order
from .cause_search import FAMILY, MOST
from .names import common_ball, length_name, name, reading_name
from .suspects import Diagnosis, MoreScatter, Refit, Suspect, Unexplained

# A direction of a cause is told from so many standard uncertainties on.
CLEAR = 3.0


def diagnosis_lines(diagnosis: Diagnosis, marks: Sequence[Mark] = ()) -> list[str]:
    """A line for each thing suspected, mistakes first; `marks` tell where the readings stand."""
    lines = [f"suspected: {words}" for words in diagnosis_words(diagnosis, marks)]
    if len(diagnosis.suspects) == MOST:
        what = (
            "look for what these have in common, or state larger uncertainties, or a richer error"
            " model"
        )
        lines.append(f"suspected: there may be more than these {MOST}; {what}")
    return lines


def diagnosis_words(diagnosis: Diagnosis, marks: Sequence[Mark] = ()) -> list[str]:
    """What is suspected, mistakes first."""
    words = [refit_words(diagnosis.refit)] if diagnosis.refit else []
    words += [suspect_words(one, marks) for one in diagnosis.suspects]
    words += [scatter_words(diagnosis.scatter)] if diagnosis.scatter else []
    return words + ([unexplained_words(diagnosis.unexplained)] if diagnosis.unexplained else [])


def suspect_words(suspect: Suspect, marks: Sequence[Mark] = ()) -> str:
    """What is suspected, how significant it is, and what to do."""
    what, cure = _what(suspect, marks)
    others = [
        *(_cause_name(suspect.patterns, columns) for columns in suspect.alternatives),
        *suspect.of_model,
    ]
    told = f"; it cannot be distinguished from {listing(others)}" if others else ""
    return f"{what} {_significance(suspect)}{told}; {cure}"


def refit_words(refit: Refit) -> str:
    """Which mistakes in the file explain the residuals, and what to do."""
    told = "; the readings do not distinguish these" if len(refit.causes) > 1 else ""
    return (
        f"{', or '.join(refit.causes)}: then the residuals are {number(refit.times, 3)} times as"
        f" large as stated, not {number(refit.before, 3)} {_significance(refit)}{told};"
        f" {refit.cure}"
    )


def scatter_words(scatter: MoreScatter) -> str:
    """Which readings scatter more than the others."""
    return (
        f"readings {_scatter_place(scatter)} scatter {number(scatter.times, 2)} times as much as"
        " stated for the others"
        f" {_significance(scatter)}; look for what was different there, or state their"
        " uncertainty in a column u"
    )


def unexplained_words(unexplained: Unexplained) -> str:
    """That no single gross error explains the residuals, and what may."""
    best = (
        f"the best explanation is {unexplained.words} {_significance(unexplained)}"
        if unexplained.words
        else f"{_significance(unexplained)[1:-1]}"
    )
    told = (
        "the error model, a drift or the noise: no single gross error explains the residuals,"
        f" which are {number(unexplained.times, 3)} times as large as stated"
    )
    if unexplained.too_large:
        return f"{told}; {best}; try a richer error model, or larger uncertainties"
    return (
        f"{told}, and so not too large; {best}; where nothing is wrong, at most {100 * FAMILY:g} %"
        " of fits suspect anything: look at the pattern before the error model is changed"
    )


def _scatter_place(scatter: MoreScatter) -> str:
    if scatter.of.position >= 0:
        return f"in position {scatter.design.positions.names[scatter.of.position]}"
    return f"with probe {scatter.design.probes.names[scatter.of.probe]}"


def _significance(cause: Suspect | MoreScatter | Unexplained | Refit) -> str:
    return f"(statistic {number(cause.statistic, 3)}, limit {number(cause.limit, 3)})"


def _cause_name(given: Patterns, columns: Sequence[int]) -> str:
    """A cause by name, without the axis if it is about several."""
    told = name(given, columns[0])
    if given.kind[columns[0]] == "distance" and len(columns) > 1:
        ball = common_ball(given.design, given.subject[list(columns)])
        return f"all certified distances of ball {given.design.ball_label(ball)}"
    if given.kind[columns[0]] == "probe" and len(columns) > 1:
        return f"offset of probe {given.design.probes.names[given.subject[columns[0]]]}"
    return told if len(columns) == 1 else told.rpartition(", ")[0]


def with_uncertainty(value: float, uncertainty: float) -> str:
    """A value with its standard uncertainty in brackets, to the latter's first digit, or second if
    it is 1 or 2.

    >>> with_uncertainty(4.128, 0.71), with_uncertainty(31.28, 17.3)
    ('4.1(0.7)', '31(17)')
    >>> with_uncertainty(0.1234, 0.0123)
    '0.123(0.012)'
    """
    exponent = math.floor(math.log10(uncertainty))
    decimals = max(-exponent + int(uncertainty / 10.0**exponent < 3.0), 0)
    return f"{value:.{decimals}f}({uncertainty:.{decimals}f})"


# In one piece: one sentence for each kind of cause, side by side.
def _what(suspect: Suspect, marks: Sequence[Mark]) -> tuple[str, str]:
    given, k = suspect.patterns, suspect.pattern
    design, kind, subject, axis = (
        given.design,
        given.kind[k],
        int(given.subject[k]),
        int(given.axis[k]),
    )
    size = (
        f"{with_uncertainty(1e6 * abs(suspect.value), 1e6 * suspect.standard_uncertainty)}"
        f" {SHOWN[suspect.unit]}"
    )
    letter = AXIS_NAMES[axis] if axis >= 0 else ""
    high = "high" if suspect.value > 0 else "low"
    long = "long" if suspect.value > 0 else "short"
    lines = _lines(_touched(suspect), marks)
    leave = f"check or leave out {lines}" if lines else "check or leave out the readings"
    if kind in ("reading", "end"):
        return f"{reading_name(design, subject)} read {_sizes(suspect, 'too high')}", leave
    if kind == "distance" and len(_significant(suspect)) > 1:
        common = common_ball(design, given.subject[suspect.columns])
        exact = ", stated as exact" if suspect.of_exact else ""
        told = f"certified distances of ball {design.ball_label(common)}{exact}:"
        return f"{told} {_from(common, suspect)}", "check the certificate"
    if kind == "length":
        return f"{name(given, k)} read {size} too {long}", leave
    if kind == "length value":
        told = f"{length_name(design, subject, False)} certified {size} too {long}"
        return told, "check the certificate"
    for other in design.observations:
        if other.word == kind:
            words = other.words
            too = words.more if suspect.value > 0 else words.less
            if suspect.of_exact:
                told = f"is stated as exact and would have to be {size} too {too}"
                return f"{name(given, k)} {told}", words.cure
            return f"{name(given, k)} {words.verb} {size} too {too}", words.cure
    if kind == "scale":
        artefact = design.artefacts.names[subject]
        told = f"all that is certified of {artefact} is {size} too {long}"
        return told, "check the certificate, and the temperature of the artefact and of the scales"
    if kind == "probe":
        told = f"offset {letter} of probe {design.probes.names[subject]} stated {size} too {high}"
        if len(suspect.columns) > 1:
            sizes = _sizes(suspect, "too high")
            told = f"offset of probe {design.probes.names[subject]} stated {sizes}"
        return told, "qualify the probe again, or estimate its offset"
    place = design.positions.names[subject] if kind in ("shift", "turn", "expansion") else ""
    if kind in ("ball", "moved"):
        ball = design.ball_label(int(design.readings.ball[subject]))
        place = design.positions.names[design.readings.position[subject]]
        if kind == "ball":
            told = f"ball {ball} in position {place} read {_sizes(suspect, 'too high')} each time"
            return told, f"clean the ball, and {leave}"
        told = (
            f"ball {ball} displaced on its plate from position {place} on, by"
            f" {_sizes(suspect, 'along')}"
        )
        return (
            told,
            "check whether it is loose, dirty or replaced; it counts as another ball from there on",
        )
    artefact = design.artefacts.names[design.positions.artefact[subject]]
    if kind in ("shift", "turn"):
        return (
            (
                f"{artefact} slipped in position {place}, by {_sizes(suspect, 'along')},"
                f" {_moment(suspect, marks)}"
            ),
            "read the position again, or state two positions, one for each part",
        )
    parts = []
    for column, value, uncertainty in zip(
        suspect.columns, suspect.values, suspect.standard_uncertainties, strict=True
    ):
        larger = "larger" if value > 0 else "smaller"
        size = with_uncertainty(1e6 * abs(value), 1e6 * uncertainty)
        told = f"{size} {SHOWN[suspect.unit]} {larger}"
        parts.append(f"{told} in position {design.positions.names[given.subject[column]]}")
    return f"{artefact} {' and '.join(parts)}", "check the temperature there"


def _from(ball: int, suspect: Suspect) -> str:
    """Sizes by which the distances of a ball are wrong, those that are significant."""
    given, ends = (
        suspect.patterns.design.of(CalibratedDistances),
        suspect.patterns.design.balls.names,
    )
    parts = []
    for place in _significant(suspect):
        distance, value = (
            int(suspect.patterns.subject[suspect.columns[place]]),
            float(suspect.values[place]),
        )
        first, second = int(given.first[distance]), int(given.second[distance])
        size = with_uncertainty(
            1e6 * abs(value), 1e6 * float(suspect.standard_uncertainties[place])
        )
        other = ends[second if first == ball else first]
        parts.append(f"to {other} {size} µm too {'long' if value > 0 else 'short'}")
    return listed(parts)


def _significant(suspect: Suspect) -> Integers:
    """Places of the directions that are significant, at least of the most significant one."""
    ratio = np.abs(suspect.values) / suspect.standard_uncertainties
    return np.flatnonzero((ratio >= CLEAR) | (ratio == ratio.max()))


def _sizes(suspect: Suspect, how: str) -> str:
    """Sizes of a cause by direction, those that are significant: "1.2(0.2) µm too high in x" or "…
    along x".
    """
    given = suspect.patterns
    parts = []
    for place in _significant(suspect):
        column, value = suspect.columns[place], float(suspect.values[place])
        size = with_uncertainty(
            1e6 * abs(value), 1e6 * float(suspect.standard_uncertainties[place])
        )
        letter, unit = AXIS_NAMES[given.axis[column]], SHOWN[given.unit(int(column))]
        if how == "too high":
            parts.append(f"{size} {unit} too {'high' if value > 0 else 'low'} in {letter}")
        else:
            preposition = "about" if given.kind[column] == "turn" else "along"
            parts.append(f"{'' if value > 0 else '-'}{size} {unit} {preposition} {letter}")
    return listed(parts)


def _moment(suspect: Suspect, marks: Sequence[Mark]) -> str:
    """When a plate slipped, by the lines of the readings next to it."""
    design, start = suspect.patterns.design, int(suspect.patterns.start[suspect.pattern])
    rows = np.flatnonzero(
        design.readings.position == int(suspect.patterns.subject[suspect.pattern])
    )
    before = int(rows[np.searchsorted(rows, suspect.first) - 1])
    if marks:
        lines, file = (marks[before].line, marks[suspect.last].line), Path(marks[start].file).name
        probably = (
            f", probably before line {marks[start].line}" if suspect.last > suspect.first else ""
        )
        return f"between lines {lines[0]} and {lines[1]} of {file}{probably}"
    return f"between {reading_name(design, before)} and {reading_name(design, suspect.last)}"


def _touched(suspect: Suspect) -> list[int]:
    """Readings that a suspect is about."""
    given, k = suspect.patterns, suspect.pattern
    design, kind, subject = given.design, given.kind[k], int(given.subject[k])
    readings = design.readings
    if kind in ("reading", "end"):
        return [subject]
    if kind == "length":
        ends = (int(design.of(Lengths).first[subject]), int(design.of(Lengths).second[subject]))
        return [i for i in ends if i >= 0]
    if kind in ("ball", "moved"):
        order = position_order(design)[readings.position]
        here = order == order[subject] if kind == "ball" else order >= order[subject]
        return np.flatnonzero((readings.ball == readings.ball[subject]) & here).tolist()
    if kind in ("shift", "turn"):
        return [int(given.start[k])]
    return []


def _lines(readings: Sequence[int], marks: Sequence[Mark]) -> str:
    """Where readings stand, such as "lines 5 and 7 of readings.csv"; empty if they stand in no
    file.
    """
    if not marks or not readings:
        return ""
    numbers = [str(marks[i].line) for i in readings]
    file = Path(marks[readings[0]].file).name
    return f"line{'s' * (len(numbers) > 1)} {listed(numbers)} of {file}"


def diagnosis_data(diagnosis: Diagnosis, marks: Sequence[Mark] = ()) -> list[dict[str, Any]]:
    """What is suspected as plain data in metres, radians and ratios."""
    told = []
    if diagnosis.refit:
        refit = diagnosis.refit
        told.append(_other_data(refit.causes[0], refit.kind, refit, refit_words(refit)))
        told[0]["alternatives"] = list(refit.causes[1:])
    told += [_suspect_data(one, marks) for one in diagnosis.suspects]
    if diagnosis.scatter:
        what = f"scatter of the readings {_scatter_place(diagnosis.scatter)}"
        told.append(
            _other_data(what, "scatter", diagnosis.scatter, scatter_words(diagnosis.scatter))
        )
    if diagnosis.unexplained:
        what = diagnosis.unexplained.words or "error model, drift or noise"
        told.append(
            _other_data(
                what, "model", diagnosis.unexplained, unexplained_words(diagnosis.unexplained)
            )
        )
    return told


def _suspect_data(suspect: Suspect, marks: Sequence[Mark]) -> dict[str, Any]:
    given = suspect.patterns
    return {
        "name": name(given, suspect.pattern),
        "kind": str(given.kind[suspect.pattern]),
        **picked(suspect, "value", "standard_uncertainty", "unit", "statistic", "limit"),
        "lines": [marks[i].line for i in _touched(suspect)] if marks else [],
        "directions": [
            {
                "name": name(given, k),
                "value": value,
                "standard_uncertainty": u,
                "unit": given.unit(k),
            }
            for k, value, u in zip(
                suspect.columns.tolist(),
                suspect.values.tolist(),
                suspect.standard_uncertainties.tolist(),
                strict=True,
            )
        ],
        "alternatives": [
            *(_cause_name(given, columns) for columns in suspect.alternatives),
            *suspect.of_model,
        ],
        "words": suspect_words(suspect, marks),
    }


def _other_data(
    what: str, kind: str, cause: MoreScatter | Unexplained | Refit, words: str
) -> dict[str, Any]:
    return {
        "name": what,
        "kind": kind,
        "value": cause.times,
        "standard_uncertainty": None,
        "unit": "1",
        "statistic": cause.statistic,
        "limit": cause.limit,
        "lines": [],
        "directions": [],
        "alternatives": [],
        "words": words,
    }
