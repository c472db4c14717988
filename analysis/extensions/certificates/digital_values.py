"""Certified values in a Digital Calibration Certificate: which of them are those of an item."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
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


def read_digital(
    settings: Any,
    wanted: Sequence[tuple[str, str]],
    is_pair: bool,
    steps: Steps,
    references: References,
) -> FileValues | None:
    """The wanted values in a digital certificate; None after reporting faults.

    The result is the one that is named, or else the only one that has them all.
    """
    # Loaded with a parser of XML, which few experiments need.
    from .digital_certificates import RELATIVE, matrix_of, read_digital_certificate

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
    forms = _forms(wanted)
    by_result = [_matched(item, forms) for item in chosen]
    full = [k for k, matches in enumerate(by_result) if len(matches) == len(wanted)]
    if len(full) > 1:
        named = listing(chosen[k].label for k in full)
        text = f"{len(full)} results have these values: {named}; choose one with result:"
        problems.add(place, f"{path.name}: {text}")
        return None
    best = full[0] if full else max(range(len(chosen)), key=lambda k: len(by_result[k]))
    result, matches = chosen[best], by_result[best]
    if not full:
        text = _nothing_found(result, matches, wanted, is_pair)
        problems.add(place, f"{path.name}: {text}; it has {labels}")
        return None
    before = len(problems.messages)
    entries = []
    for k, names in enumerate(wanted):
        values = [result.lengths[i] for i in matches[k]]
        if len(values) > 1:
            lines = listing(str(value.mark.line) for value in values)
            text = f"{value_name(names, is_pair)} has several values, in lines {lines}"
            problems.add_at(values[1].mark, place, text)
        # Who states the uncertainty needs none of the file.
        is_stated = values[0].problem == RELATIVE and settings.standard_uncertainty is not None
        if values[0].problem and not is_stated:
            text = f"{value_name(names, is_pair)} {values[0].problem}"
            problems.add_at(values[0].mark, place, text)
        entries.append(
            CertificateEntry(names, values[0].value, values[0].uncertainty, values[0].mark, place)
        )
    if len(problems.messages) > before:
        return None
    covariance = matrix_of(result, [matches[k][0] for k in range(len(wanted))])
    _tell(
        version,
        result,
        [result.lengths[matches[k][0]] for k in range(len(wanted))],
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
    settings: Any,
    correlated: bool,
    steps: Steps,
    references: References,
) -> None:
    """Say which result was taken, and the temperature that it is stated for."""
    factors = sorted({f"{value.factor:g}" for value in values if not math.isnan(value.uncertainty)})
    line = f"DCC {version}, result {result.label}: {len(values)} values"
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


def _matched(result: DigitalResult, forms: dict[tuple[str, ...], int]) -> dict[int, list[int]]:
    """Places of the values of a result by what is wanted."""
    matches: dict[int, list[int]] = {}
    for i, length in enumerate(result.lengths):
        texts = [*length.names, *length.contexts]
        texts += [f"{name} {about}" for name in length.names for about in length.contexts]
        tried = [_words(text) for text in texts]
        tried += [tuple(word for word in words if word not in IDLE) for words in tried]
        k = next((forms[words] for words in tried if words in forms), None)
        if k is not None:
            matches.setdefault(k, []).append(i)
    return matches
