"""Causes of a fit's residuals in words, with what to do, and lines of the readings' file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from ballplate.results import ParameterEstimate
from ballplate.simulator.design import Lengths
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import Mark, listed
from ballplate.simulator.machines import Array, Integers

from .bias_patterns import Patterns, position_order
from .cause_search import FoundCause, Search
from .events import ASSUMED, cause
from .findings import Finding
from .hypotheses import MODEL
from .names import common_ball, length_name, name, reading_name

CURES = {
    "probe": "qualify the probe again, or estimate its offset",
    "scale": "check the certificate, and the temperatures of artefact and scales",
    "expansion": "check the temperature there",
    "slip": "read the position again, or state two positions, one for each part",
    "moved": "check whether the ball is loose, dirty or replaced: from there on it is another one",
    "length value": "check the certificate",
}


def findings(search: Search, marks: Sequence[Mark]) -> Iterator[Finding]:
    """Return the causes that a search has found; `marks` locate the readings in their file."""
    for found, (values, uncertainties) in zip(search.found, search.sizes(), strict=True):
        others = [*(words_of(search.patterns, some) for some in found.others)]
        others += [hypothesis.words for hypothesis in found.of_others]
        assumed = found.hypothesis.assumed if found.hypothesis else ""
        kind, is_gross, lines = assumed, False, list[int]()
        if found.hypothesis is None:
            kind = cause(search.patterns, found.columns).kind
            is_gross = kind not in ASSUMED
            lines = _touched(search.patterns, found)
            words, cure = words_of(search.patterns, found.columns), _cure(search, found, marks)
            if found.of_exact:
                words = f"{words}, stated as exact"
            if kind == "slip":
                words = f"{words} {_moment(search.patterns, found, marks)}"
        else:
            words, cure = found.hypothesis.words, found.hypothesis.cure
        yield Finding(
            kind,
            words,
            cure,
            found.p_value,
            found.sigma,
            tuple(_sizes(search, found, values, uncertainties)),
            tuple(dict.fromkeys(others)),
            tuple(marks[i].line for i in lines) if marks else (),
            is_gross,
            may_be_model=any(each.assumed == MODEL for each in found.of_others),
        )
    if search.scatter:
        scatter, times, found = search.scatter
        where = f"with probe {search.design.probes.names[scatter.probe]}"
        if scatter.position >= 0:
            where = f"in position {search.design.positions.names[scatter.position]}"
        words = f"readings {where} vary {times:.2g} times as much as stated for the others"
        cure = "look for a cause there, or state their uncertainty in a column u"
        yield Finding("scatter", words, cure, found.p_value, found.sigma)
    if search.model:
        best = search.model.hypothesis
        words = "no single cause explains the residuals"
        cure = "compare error models (ballplate models), or state larger uncertainties"
        if best:
            lacks = f"the error model lacks {best.words}"
            words, cure = lacks if best.assumed == MODEL else best.words, best.cure
        p_value, sigma = search.model.p_value, search.model.sigma
        yield Finding(MODEL, words, cure, p_value, sigma, is_model=True, may_be_model=True)


def words_of(biases: Patterns, columns: Integers) -> str:
    """Return the name of the cause of some patterns, without the direction."""
    design, first, subject = biases.design, int(columns[0]), int(biases.subject[columns[0]])
    kind = cause(biases, columns).kind
    if kind in ("reading", "end"):
        return f"reading of {reading_name(design, subject)}"
    if kind == "probe":
        return f"offset of probe {design.probes.names[subject]}"
    if kind == "scale":
        artefact = design.artefacts.names[subject]
        return f"scale of the certificate of {artefact}, or its temperature in all positions"
    if kind == "expansion":
        names, artefacts = design.positions.names, design.positions.artefact
        return " and ".join(
            f"size of {design.artefacts.names[artefacts[k]]} in position {names[k]}"
            for k in biases.subject[columns].tolist()
        )
    if kind == "slip":
        artefact = design.artefacts.names[design.positions.artefact[subject]]
        return f"{artefact} slipped in position {design.positions.names[subject]}"
    if kind == "distance" and len(columns) > 1:
        ball = common_ball(design, biases.subject[columns])
        return f"all certified distances of ball {design.ball_label(ball)}"
    if kind == "length value":
        return f"certified {length_name(design, subject, False)}"
    words = name(biases, first)
    return words.rpartition(", ")[0] if kind in ("ball", "moved") else words


def _cure(search: Search, found: FoundCause, marks: Sequence[Mark]) -> str:
    biases = search.patterns
    kind = cause(biases, found.columns).kind
    for observation in biases.design.observations:
        if observation.word == kind and kind != "length":
            return str(observation.words.cure)
    leave = "check or leave out the readings"
    if marks and kind not in CURES:
        readings = _touched(biases, found)
        lines = [str(marks[i].line) for i in readings]
        where = f"line{'s' * (len(lines) > 1)} {listed(lines)}"
        leave = f"check or leave out {where} of {Path(marks[readings[0]].file).name}"
    return CURES.get(kind, f"clean the ball, and {leave}" if kind == "ball" else leave)


def _sizes(
    search: Search, found: FoundCause, values: Array, uncertainties: Array
) -> Iterator[ParameterEstimate]:
    """Return the size of a cause along each direction: what is stated or read less the truth."""
    biases = search.patterns
    each = zip(values.tolist(), uncertainties.tolist(), strict=True)
    for number, (value, u) in enumerate(each):
        if found.hypothesis is not None:
            letter, unit = found.hypothesis.parameters[number], found.hypothesis.unit
        else:
            k = int(found.columns[number])
            letter, unit = AXIS_NAMES[biases.axis[k]] if biases.axis[k] >= 0 else "", biases.unit(k)
            if biases.kind[k] == "turn":
                letter = f"about {letter}"
            elif len(found.columns) > 1 and not letter:
                letter = name(biases, k)
        if u > 0.0:
            yield ParameterEstimate(letter, value, u, unit)


def _moment(biases: Patterns, found: FoundCause, marks: Sequence[Mark]) -> str:
    """Return the moment of a slip, between two readings or lines."""
    design, position = biases.design, biases.subject[found.columns[0]]
    rows = np.flatnonzero(design.readings.position == position)
    before = int(rows[np.searchsorted(rows, found.first) - 1])
    if marks:
        file = Path(marks[before].file).name
        return f"between lines {marks[before].line} and {marks[found.last].line} of {file}"
    return f"between {reading_name(design, before)} and {reading_name(design, found.last)}"


def _touched(biases: Patterns, found: FoundCause) -> list[int]:
    """Return the readings of a cause."""
    k = int(found.columns[0])
    kind, subject, readings = biases.kind[k], int(biases.subject[k]), biases.design.readings
    if kind in ("reading", "end"):
        return [subject]
    if kind == "length":
        lengths = biases.design.of(Lengths)
        return [i for i in (int(lengths.first[subject]), int(lengths.second[subject])) if i >= 0]
    if kind in ("ball", "moved"):
        order = position_order(biases.design)[readings.position]
        here = order == order[subject] if kind == "ball" else order >= order[subject]
        return np.flatnonzero((readings.ball == readings.ball[subject]) & here).tolist()
    return [int(biases.start[k])] if kind in ("shift", "turn") else []
