"""Certified values in a Digital Calibration Certificate: which of them are those of an item."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence, Set
from typing import TYPE_CHECKING, Any

from ballplate.simulator.design import CertificateEntry, FileValues, References, value_name
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
    from .digital_certificates import NO_LENGTH, RELATIVE, matrix_of, read_digital_certificate

    problems, place = references.problems, (*steps, "values")
    try:
        path = references.file(settings.values)
        version, results = read_digital_certificate(path)
    except ExperimentError as error:
        problems.take(error, place)
        return None
    labels = listing(result.label for result in results)
    name = settings.result
    chosen = [result for result in results if name is None or result.is_called(name)]
    if not chosen or name is not None and len(chosen) > 1:
        many = "several results are" if chosen else "no result is"
        text = f'{path.name}: {many} called "{shorten(name)}"; it has {labels}'
        problems.add((*steps, "result"), text)
        return None
    forms, quantity = _forms(wanted), settings.quantity
    by_result = [_matched(item, forms, quantity) for item in chosen]
    full = [k for k, matches in enumerate(by_result) if len(matches) == len(wanted)]
    if len(full) > 1:
        named = listing(chosen[k].label for k in full)
        text = f"{len(full)} results have these values: {named}; choose one with result:"
        problems.add(place, f"{path.name}: {text}")
        return None
    if quantity is not None and not any(by_result):
        called = dict.fromkeys(_label(length) for item in chosen for length in item.lengths)
        text = f'no quantity is called "{shorten(quantity)}" for these balls; it has'
        problems.add((*steps, "quantity"), f"{path.name}: {text} {listing(called)}")
        return None
    best = full[0] if full else max(range(len(chosen)), key=lambda k: len(by_result[k]))
    result, matches = chosen[best], by_result[best]
    if not full:
        text = _nothing_found(result, matches, wanted, is_pair)
        problems.add(place, f"{path.name}: {text}; it has {labels}")
        return None
    before = len(problems.messages)
    entries, sources, kinds = [], [], set[str]()
    for k, names in enumerate(wanted):
        candidates = [
            i for i in matches[k] if not result.lengths[i].problem.startswith(NO_LENGTH)
        ] or matches[k]
        terms, source = _measured(result, candidates)
        values = [result.lengths[i] for i in terms]
        if not values:
            called = listing(dict.fromkeys(_label(result.lengths[i]) for i in candidates))
            lines = listing(str(result.lengths[i].mark.line) for i in candidates)
            text = (
                f"{value_name(names, is_pair)} has several values, in lines {lines}; choose those"
                f" of one quantity with quantity: {called}"
            )
            problems.add_at(result.lengths[candidates[1]].mark, place, text)
            return None
        for value in values:
            # Who states the uncertainty needs none of the file.
            is_stated = value.problem == RELATIVE and settings.standard_uncertainty is not None
            if value.problem and not is_stated:
                text = f"{value_name(names, is_pair)} {value.problem}"
                problems.add_at(value.mark, place, text)
        length, u = sum(value.value for value in values), result.lengths[source].uncertainty
        entries.append(CertificateEntry(names, length, u, values[0].mark, place))
        sources.append(source)
        beside = "" if source in terms else ", with uncertainties of errors"
        kinds.add(" plus ".join(map(_kind, values)) + beside)
    if len(problems.messages) > before:
        return None
    covariance = matrix_of(result, sources)
    _tell(
        version,
        result,
        [result.lengths[source] for source in sources],
        kinds,
        settings,
        covariance is not None,
        place,
        references,
    )
    return FileValues(entries, covariance)


def _tell(
    version: str,
    result: DigitalResult,
    values: list[DigitalValue],
    kinds: Set[str],
    settings: Any,
    correlated: bool,
    steps: Steps,
    references: References,
) -> None:
    """Say which result was taken, and the temperature that it is stated for."""
    factors = sorted({f"{value.factor:g}" for value in values if not math.isnan(value.uncertainty)})
    line = f"DCC {version}, result {result.label}: {len(values)} values"
    line += f" ({listing(sorted(kinds))})" if any(kinds) else ""
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


def _measured(result: DigitalResult, places: list[int]) -> tuple[list[int], int]:
    """Places of the lengths that are the measured one or add up to it, none if it is open which
    are, and of the length with its uncertainty, which may be stated of the error only.
    """
    kinds = {i: _kind(result.lengths[i]) for i in places}
    errors = [i for i in places if kinds[i] == "error"]
    terms = [i for i in places if kinds[i] == "measured"] if len(places) > 1 else places
    if not terms and len(places) == 2 and len(errors) == 1 and all(kinds.values()):
        terms = sorted(places, key=errors.__contains__)
    elif len(terms) != 1:
        return [], places[0]
    sources = [terms[-1], *(errors if len(errors) == 1 else ()), terms[0]]
    return terms, next((i for i in sources if result.lengths[i].uncertainty >= 0.0), sources[0])


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
