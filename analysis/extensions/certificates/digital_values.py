"""Certified values in a Digital Calibration Certificate: which of them are those of an item."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.simulator.experiment import CertificateEntry, FileValues, References, value_name
from ballplate.simulator.inputs import ExperimentError, Steps, listing, shorten

if TYPE_CHECKING:
    from .digital_certificates import DigitalResult, DigitalValue

REFERENCE_TEMPERATURE = 20.0
# Words about a value that are part of no name.
IDLE = {
    "distance",
    "length",
    "coordinate",
    "co-ordinate",
    "ball",
    "axis",
    "of",
    "from",
    "to",
    "and",
}
# Reference types of good practice: quantities of the same name that stand side by side.
KIND = re.compile("[a-z]+_(?:(nominal|reference|measured)Value|measurement(Error)(?:_error)?)")


def read_digital(
    settings: Any,
    wanted: Sequence[tuple[str, str]],
    is_pair: bool,
    steps: Steps,
    references: References,
) -> FileValues | None:
    """The wanted values in a digital certificate; None after reporting faults.

    The result is the one that is named, or else the only one that has them all. Of quantities side
    by side it is the one that is named, or else the measured one, or else the nominal one with the
    error added.
    """
    # Loaded with a parser of XML, which few experiments need.
    from .digital_certificates import matrix_of, read_digital_certificate

    problems, place = references.problems, (*steps, "values")
    try:
        path = references.file(settings.values)
        version, results = read_digital_certificate(path)
    except ExperimentError as error:
        problems.take(error, place)
        return None
    found = _chosen_result(settings, results, wanted, is_pair, steps, references)
    if found is None:
        return None
    result, matches = found
    before, values, sources = len(problems.messages), [], []
    for k, names in enumerate(wanted):
        called = value_name(names, is_pair)
        measured = _measured(result, matches[k])
        if measured is None:
            some = [result.lengths[i] for i in matches[k]]
            lines = listing(str(value.mark.line) for value in some)
            text = f"{called} has several values, in lines {lines}; choose those of one quantity"
            text += f" with quantity: {listing(dict.fromkeys(map(_label, some)))}"
            problems.add_at(some[1].mark, place, text)
            return None
        value, source = measured
        if value.names == ("nominal",) and settings.quantity is None:
            label = _label(result.lengths[matches[k][0]])
            text = f"{called} has no measured value, only a nominal one; write quantity: {label}"
            problems.add_at(value.mark, place, f"{text} if nominal values are meant")
            return None
        if value.problem:
            problems.add_at(value.mark, place, f"{called} {value.problem}")
        values.append(value)
        sources.append(source)
    if len(problems.messages) > before:
        return None
    covariance = matrix_of(result, sources)
    _tell(version, result, values, settings, covariance is not None, place, references)
    entries = [
        CertificateEntry(names, value.value, value.uncertainty, value.mark, place)
        for names, value in zip(wanted, values, strict=True)
    ]
    return FileValues(entries, covariance)


def _chosen_result(
    settings: Any,
    results: Sequence[DigitalResult],
    wanted: Sequence[tuple[str, str]],
    is_pair: bool,
    steps: Steps,
    references: References,
) -> tuple[DigitalResult, dict[int, list[int]]] | None:
    """The result with all wanted values, and the places of these; None after reporting faults."""
    problems, place = references.problems, (*steps, "values")
    name_of_file = Path(settings.values).name
    labels = listing(result.label for result in results)
    name = settings.result
    chosen = [result for result in results if name is None or result.is_called(name)]
    if not chosen or name is not None and len(chosen) > 1:
        many = "several results are" if chosen else "no result is"
        text = f'{name_of_file}: {many} called "{shorten(name)}"; it has {labels}'
        problems.add((*steps, "result"), text)
        return None
    forms, quantity = _forms(wanted), settings.quantity
    by_result = [_matched(item, forms, quantity) for item in chosen]
    full = [k for k, matches in enumerate(by_result) if len(matches) == len(wanted)]
    if len(full) > 1:
        named = listing(chosen[k].label for k in full)
        text = f"{len(full)} results have these values: {named}; choose one with result:"
        problems.add(place, f"{name_of_file}: {text}")
        return None
    if quantity is not None and not any(by_result):
        called = dict.fromkeys(_label(length) for item in chosen for length in item.lengths)
        text = f'no quantity is called "{shorten(quantity)}" for these balls; it has'
        problems.add((*steps, "quantity"), f"{name_of_file}: {text} {listing(called)}")
        return None
    best = full[0] if full else max(range(len(chosen)), key=lambda k: len(by_result[k]))
    if not full:
        text = _nothing_found(chosen[best], by_result[best], wanted, is_pair)
        problems.add(place, f"{name_of_file}: {text}; it has {labels}")
        return None
    return chosen[best], by_result[best]


def _tell(
    version: str,
    result: DigitalResult,
    values: list[DigitalValue],
    settings: Any,
    correlated: bool,
    steps: Steps,
    references: References,
) -> None:
    """Say which result was taken, and which values, and the temperature they are stated for."""
    factors = sorted({f"{value.factor:g}" for value in values if not math.isnan(value.uncertainty)})
    line = f"DCC {version}, result {result.label}: {len(values)} values"
    kinds = listing(sorted({*filter(None, (value.names[0] for value in values))}))
    line += f" ({kinds})" if kinds else ""
    line += f", k = {listing(factors)}" if factors else ""
    line += ", with their covariance" if correlated else ""
    for name, degrees in result.temperatures:
        line += f"; {shorten(name)} {degrees:.4g} °C"
    references.problems.note(steps, f"{settings.values}: {line}")
    away = [value for _, value in result.temperatures if abs(value - REFERENCE_TEMPERATURE) > 0.5]
    if away:
        text = (
            f"{settings.values} states a temperature of {away[0]:.4g} °C; its values are"
            " used unchanged, as lengths at the reference temperature"
        )
        references.problems.doubt(steps, text)


def _label(value: DigitalValue) -> str:
    """How the quantity of a value is called: by a reference type, a name or an identifier."""
    types = [context for context in value.contexts if KIND.fullmatch(context)]
    return f'"{shorten((*types, *value.contexts[::-1], "without a name")[0])}"'


def _kind(value: DigitalValue) -> str:
    """The part of a reference type that says what a value is, empty without any."""
    kinds = (KIND.fullmatch(context) for context in reversed(value.contexts))
    return next((str(kind[kind.lastindex or 0]).lower() for kind in kinds if kind), "")


def _measured(result: DigitalResult, places: list[int]) -> tuple[DigitalValue, int] | None:
    """The measured one of lengths, or the nominal one with the error added, named by what it is,
    and the place of its uncertainty, which may be stated of the error only; None if it is open.
    """
    kinds = {i: _kind(result.lengths[i]) for i in places}
    of_lengths = [i for i in places if kinds[i] or result.lengths[i].is_length]
    places = of_lengths or places
    errors = [i for i in places if kinds[i] == "error"]
    terms = [i for i in places if kinds[i] == "measured"] if len(places) > 1 else places
    if not terms and len(places) == 2 and len(errors) == 1 and all(kinds.values()):
        terms = sorted(places, key=errors.__contains__)
    elif len(terms) != 1:
        return None
    sources = [terms[-1], *(errors if len(errors) == 1 else ()), terms[0]]
    lengths = [result.lengths[i] for i in terms]
    source = next((i for i in sources if result.lengths[i].uncertainty >= 0.0), sources[0])
    name = " plus ".join(kinds[i] for i in terms)
    name += "" if source in terms else ", with uncertainties of errors"
    problem = next((length.problem for length in lengths if length.problem), "")
    value = sum(length.value for length in lengths)
    of_source = replace(result.lengths[source], value=value, names=(name,), problem=problem)
    return replace(of_source, mark=lengths[0].mark), source


def _nothing_found(
    result: DigitalResult,
    matches: dict[int, list[int]],
    wanted: Sequence[tuple[str, str]],
    is_pair: bool,
) -> str:
    missing = listing(
        value_name(names, is_pair) for k, names in enumerate(wanted) if k not in matches
    )
    if matches:
        return f"result {result.label} has no value of {missing}"
    names_known = list(dict.fromkeys(name for length in result.lengths for name in length.names))
    example = " ".join(wanted[0])
    names_text = (
        f"its values are called {listing(names_known)}"
        if names_known
        else "its values have no names"
    )
    return f'no result has values for these balls, with names such as "{example}"; {names_text}'


def _words(text: str) -> tuple[str, ...]:
    return tuple(word for word in re.split(r"[\s_\-–—/.,:;|()\[\]]+", text.casefold()) if word)


def _forms(wanted: Sequence[tuple[str, str]]) -> dict[tuple[str, ...], int]:
    """Words that name each value, in either order; those that name several are left out."""
    forms: dict[tuple[str, ...], int] = {}
    for k, (first, second) in enumerate(wanted):
        for words in (_words(first) + _words(second), _words(second) + _words(first)):
            forms[words] = -1 if forms.get(words, k) != k else k
    return {words: k for words, k in forms.items() if k >= 0}


def _matched(
    result: DigitalResult, forms: dict[tuple[str, ...], int], quantity: str | None
) -> dict[int, list[int]]:
    """Places of the values of a result, or of one quantity of it, by what is wanted."""
    matches: dict[int, list[int]] = {}
    for i, length in enumerate(result.lengths):
        if quantity is not None and quantity not in (*length.names, *length.contexts):
            continue
        texts = [*length.names, *length.contexts]
        texts += [f"{name} {about}" for name in length.names for about in length.contexts]
        tried = [_words(text) for text in texts]
        tried += [tuple(word for word in words if word not in IDLE) for words in tried]
        k = next((forms[words] for words in tried if words in forms), None)
        if k is not None:
            matches.setdefault(k, []).append(i)
    return matches
