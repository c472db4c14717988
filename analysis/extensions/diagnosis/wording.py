"""Suspects of a fit as sentences, with lines of the readings' file, and as plain data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from ballplate.presentation import SHOWN, Data, number, picked
from ballplate.simulator.design import CalibratedDistances, Lengths
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import Mark, listed, listing
from ballplate.simulator.machines import Integers

from .bias_patterns import Patterns, position_order
from .cause_search import FAMILY, MOST
from .names import common_ball, length_name, name, reading_name
from .suspects import Diagnosis, MoreScatter, Refit, Suspect, Unexplained

# Standard uncertainties from which on a direction of a cause is reported.
CLEAR = 3.0


def diagnosis_lines(diagnosis: Diagnosis, marks: Sequence[Mark] = ()) -> list[str]:
    """Return one line per cause, gross errors first; `marks` locate the readings in their file."""
    lines = [f"suspected: {words}" for words in diagnosis_words(diagnosis, marks)]
    if len(diagnosis.suspects) == MOST:
        remedy = "look for a common cause, or state larger uncertainties or a larger error model"
        lines.append(f"suspected: there may be more than these {MOST}; {remedy}")
    return lines


def diagnosis_words(diagnosis: Diagnosis, marks: Sequence[Mark] = ()) -> list[str]:
    """Return a sentence for each cause, gross errors first."""
    words = [refit_words(diagnosis.refit)] if diagnosis.refit else []
    words += [suspect_words(suspect, marks) for suspect in diagnosis.suspects]
    words += [scatter_words(diagnosis.scatter)] if diagnosis.scatter else []
    return words + ([unexplained_words(diagnosis.unexplained)] if diagnosis.unexplained else [])


def suspect_words(suspect: Suspect, marks: Sequence[Mark] = ()) -> str:
    """Return a suspect with its significance and a remedy."""
    fact, remedy = _fact_and_remedy(suspect, marks)
    alternatives = [
        *(_cause_name(suspect.patterns, columns) for columns in suspect.alternatives),
        *suspect.of_model,
    ]
    ambiguity = f"; it cannot be distinguished from {listing(alternatives)}" if alternatives else ""
    return f"{fact} {_significance(suspect)}{ambiguity}; {remedy}"


def refit_words(refit: Refit) -> str:
    """Return errors in the file that explain the residuals, and a remedy."""
    ambiguity = "; the readings do not distinguish these" if len(refit.causes) > 1 else ""
    return (
        f"{', or '.join(refit.causes)}: then the residuals are {number(refit.times, 3)} times as"
        f" large as stated, not {number(refit.before, 3)} {_significance(refit)}{ambiguity};"
        f" {refit.cure}"
    )


def scatter_words(scatter: MoreScatter) -> str:
    """Return readings with more noise than the others."""
    return (
        f"readings {_noisy_group(scatter)} vary {number(scatter.times, 2)} times as much as"
        f" stated for the others {_significance(scatter)}; look for a cause there, or state their"
        " uncertainty in a column u"
    )


def unexplained_words(unexplained: Unexplained) -> str:
    """Return a statement on residuals that no gross error explains."""
    best = (
        f"the best explanation is {unexplained.words} {_significance(unexplained)}"
        if unexplained.words
        else f"{_significance(unexplained)[1:-1]}"
    )
    fact = (
        "the error model, a drift or the noise: no single gross error explains the residuals,"
        f" which are {number(unexplained.times, 3)} times as large as stated"
    )
    if unexplained.too_large:
        return f"{fact}; {best}; try a larger error model, or larger uncertainties"
    return (
        f"{fact}, and so not too large; {best}; at most {100 * FAMILY:g} % of sound campaigns show"
        " any pattern: inspect it before you change the error model"
    )


def _noisy_group(scatter: MoreScatter) -> str:
    if scatter.of.position >= 0:
        return f"in position {scatter.design.positions.names[scatter.of.position]}"
    return f"with probe {scatter.design.probes.names[scatter.of.probe]}"


def _significance(cause: Suspect | MoreScatter | Unexplained | Refit) -> str:
    return f"(statistic {number(cause.statistic, 3)}, limit {number(cause.limit, 3)})"


def _cause_name(biases: Patterns, columns: Sequence[int]) -> str:
    """Return a cause's name, without the axis if there are several."""
    name_of_first = name(biases, columns[0])
    if biases.kind[columns[0]] == "distance" and len(columns) > 1:
        ball = common_ball(biases.design, biases.subject[list(columns)])
        return f"all certified distances of ball {biases.design.ball_label(ball)}"
    if biases.kind[columns[0]] == "probe" and len(columns) > 1:
        return f"offset of probe {biases.design.probes.names[biases.subject[columns[0]]]}"
    return name_of_first if len(columns) == 1 else name_of_first.rpartition(", ")[0]


def with_uncertainty(value: float, uncertainty: float) -> str:
    """Return a value with its standard uncertainty in brackets, to one digit, or two if it begins
    with 1 or 2.

    >>> with_uncertainty(4.128, 0.71), with_uncertainty(31.28, 17.3)
    ('4.1(0.7)', '31(17)')
    >>> with_uncertainty(0.1234, 0.0123)
    '0.123(0.012)'
    """
    exponent = math.floor(math.log10(uncertainty))
    decimals = max(-exponent + int(uncertainty / 10.0**exponent < 3.0), 0)
    return f"{value:.{decimals}f}({uncertainty:.{decimals}f})"


# In one piece: one sentence for each kind of cause, side by side.
def _fact_and_remedy(suspect: Suspect, marks: Sequence[Mark]) -> tuple[str, str]:
    biases, k = suspect.patterns, suspect.pattern
    design, kind, subject, axis = (
        biases.design,
        biases.kind[k],
        int(biases.subject[k]),
        int(biases.axis[k]),
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
        common = common_ball(design, biases.subject[suspect.columns])
        exact = ", stated as exact" if suspect.of_exact else ""
        fact = f"certified distances of ball {design.ball_label(common)}{exact}:"
        return f"{fact} {_distance_errors(common, suspect)}", "check the certificate"
    if kind == "length":
        return f"{name(biases, k)} read {size} too {long}", leave
    if kind == "length value":
        fact = f"{length_name(design, subject, False)} certified {size} too {long}"
        return fact, "check the certificate"
    for observation in design.observations:
        if observation.word == kind:
            words = observation.words
            too = words.more if suspect.value > 0 else words.less
            if suspect.of_exact:
                fact = f"is stated as exact and would have to be {size} too {too}"
                return f"{name(biases, k)} {fact}", words.cure
            return f"{name(biases, k)} {words.verb} {size} too {too}", words.cure
    if kind == "scale":
        artefact = design.artefacts.names[subject]
        fact = f"all that is certified of {artefact} is {size} too {long}"
        return fact, "check the certificate, and the temperature of the artefact and of the scales"
    if kind == "probe":
        fact = f"offset {letter} of probe {design.probes.names[subject]} stated {size} too {high}"
        if len(suspect.columns) > 1:
            sizes = _sizes(suspect, "too high")
            fact = f"offset of probe {design.probes.names[subject]} stated {sizes}"
        return fact, "qualify the probe again, or estimate its offset"
    position = design.positions.names[subject] if kind in ("shift", "turn", "expansion") else ""
    if kind in ("ball", "moved"):
        ball = design.ball_label(int(design.readings.ball[subject]))
        position = design.positions.names[design.readings.position[subject]]
        if kind == "ball":
            fact = (
                f"ball {ball} in position {position} read {_sizes(suspect, 'too high')} each time"
            )
            return fact, f"clean the ball, and {leave}"
        fact = (
            f"ball {ball} displaced on its plate from position {position} on, by"
            f" {_sizes(suspect, 'along')}"
        )
        return (
            fact,
            "check whether it is loose, dirty or replaced; it counts as another ball from there on",
        )
    artefact = design.artefacts.names[design.positions.artefact[subject]]
    if kind in ("shift", "turn"):
        return (
            (
                f"{artefact} slipped in position {position}, by {_sizes(suspect, 'along')},"
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
        fact = f"{size} {SHOWN[suspect.unit]} {larger}"
        parts.append(f"{fact} in position {design.positions.names[biases.subject[column]]}")
    return f"{artefact} {' and '.join(parts)}", "check the temperature there"


def _distance_errors(ball: int, suspect: Suspect) -> str:
    """Return the significant errors of the distances of a ball."""
    distances, ends = (
        suspect.patterns.design.of(CalibratedDistances),
        suspect.patterns.design.balls.names,
    )
    parts = []
    for k in _significant(suspect):
        distance, value = (
            int(suspect.patterns.subject[suspect.columns[k]]),
            float(suspect.values[k]),
        )
        first, second = int(distances.first[distance]), int(distances.second[distance])
        size = with_uncertainty(1e6 * abs(value), 1e6 * float(suspect.standard_uncertainties[k]))
        far_end = ends[second if first == ball else first]
        parts.append(f"to {far_end} {size} µm too {'long' if value > 0 else 'short'}")
    return listed(parts)


def _significant(suspect: Suspect) -> Integers:
    """Return indices of the significant directions, at least of the most significant one."""
    ratio = np.abs(suspect.values) / suspect.standard_uncertainties
    return np.flatnonzero((ratio >= CLEAR) | (ratio == ratio.max()))


def _sizes(suspect: Suspect, how: str) -> str:
    """Return the significant sizes of a cause by direction: "1.2(0.2) µm too high in x" or "…
    along x".
    """
    biases = suspect.patterns
    parts = []
    for k in _significant(suspect):
        column, value = suspect.columns[k], float(suspect.values[k])
        size = with_uncertainty(1e6 * abs(value), 1e6 * float(suspect.standard_uncertainties[k]))
        letter, unit = AXIS_NAMES[biases.axis[column]], SHOWN[biases.unit(int(column))]
        if how == "too high":
            parts.append(f"{size} {unit} too {'high' if value > 0 else 'low'} in {letter}")
        else:
            preposition = "about" if biases.kind[column] == "turn" else "along"
            parts.append(f"{'' if value > 0 else '-'}{size} {unit} {preposition} {letter}")
    return listed(parts)


def _moment(suspect: Suspect, marks: Sequence[Mark]) -> str:
    """Return the moment of a slip, between two readings or lines."""
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
    """Return the readings of a suspect."""
    biases, k = suspect.patterns, suspect.pattern
    design, kind, subject = biases.design, biases.kind[k], int(biases.subject[k])
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
        return [int(biases.start[k])]
    return []


def _lines(readings: Sequence[int], marks: Sequence[Mark]) -> str:
    """Return lines of readings, such as "lines 5 and 7 of readings.csv"; empty without a file."""
    if not marks or not readings:
        return ""
    numbers = [str(marks[i].line) for i in readings]
    file = Path(marks[readings[0]].file).name
    return f"line{'s' * (len(numbers) > 1)} {listed(numbers)} of {file}"


def diagnosis_data(diagnosis: Diagnosis, marks: Sequence[Mark] = ()) -> list[Data]:
    """Return all causes as plain data in metres, radians and ratios."""
    items = []
    if diagnosis.refit:
        refit = diagnosis.refit
        items.append(_other_data(refit.causes[0], "offsets", refit, refit_words(refit)))
        items[0]["alternatives"] = list(refit.causes[1:])
    items += [_suspect_data(suspect, marks) for suspect in diagnosis.suspects]
    if diagnosis.scatter:
        subject = f"scatter of the readings {_noisy_group(diagnosis.scatter)}"
        items.append(
            _other_data(subject, "scatter", diagnosis.scatter, scatter_words(diagnosis.scatter))
        )
    if diagnosis.unexplained:
        subject = diagnosis.unexplained.words or "error model, drift or noise"
        items.append(
            _other_data(
                subject, "model", diagnosis.unexplained, unexplained_words(diagnosis.unexplained)
            )
        )
    return items


def _suspect_data(suspect: Suspect, marks: Sequence[Mark]) -> Data:
    biases = suspect.patterns
    return {
        "name": name(biases, suspect.pattern),
        "kind": str(biases.kind[suspect.pattern]),
        **picked(suspect, "value", "standard_uncertainty", "unit", "statistic", "limit"),
        "lines": [marks[i].line for i in _touched(suspect)] if marks else [],
        "directions": [
            {
                "name": name(biases, k),
                "value": value,
                "standard_uncertainty": u,
                "unit": biases.unit(k),
            }
            for k, value, u in zip(
                suspect.columns.tolist(),
                suspect.values.tolist(),
                suspect.standard_uncertainties.tolist(),
                strict=True,
            )
        ],
        "alternatives": [
            *(_cause_name(biases, columns) for columns in suspect.alternatives),
            *suspect.of_model,
        ],
        "words": suspect_words(suspect, marks),
    }


def _other_data(
    subject: str, kind: str, cause: MoreScatter | Unexplained | Refit, words: str
) -> Data:
    return {
        "name": subject,
        "kind": kind,
        "value": cause.times,
        "standard_uncertainty": None,
        "unit": "1",
        **picked(cause, "statistic", "limit"),
        "lines": [],
        "directions": [],
        "alternatives": [],
        "words": words,
    }
