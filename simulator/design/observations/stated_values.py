"""Values of a calibration item that a file states, with their uncertainties and covariance.

The file is a table (CSV), to which another may give the covariance, or a Digital Calibration
Certificate (XML).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import Field

from ...inputs.covariances import read_matrix
from ...inputs.digital_certificates import (
    DigitalResult,
    DigitalValue,
    matrix_of,
    read_digital_certificate,
)
from ...inputs.messages import ExperimentError, Message, Steps
from ...inputs.settings import Settings, Text, hint, listing, shorten
from ...inputs.tables import FileRow, header_cells, read_table, table_lines
from ...inputs.yamltree import Mark
from ...machines.protocol import Array, Integers
from ..lookup import References
from .joint_values import MOST_JOINT_VALUES
from .whitening import CovarianceRoot, IndefiniteError, covariance_root

STANDARD, EXPANDED, FACTOR = "standard_uncertainty", "expanded_uncertainty", "k"
NO_FACTOR = "-"
# Names of columns that do not say which uncertainty they hold.
UNCLEAR = re.compile(r"(u|u95|unc|uncertainty)_[^_]+", re.IGNORECASE)
# An uncertainty and the variance beside it agree to their last digits, this being a generous share.
AGREE = 0.02
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


class CertificateSettings(Settings):
    """Keys of an item of calibration whose values may stand in a file."""

    covariance: Text | None = Field(
        None,
        description=(
            "CSV file with the covariance matrix of the values: first cell covariance_um2 (or"
            " another unit), or correlation, then the names of values, as row and as column"
        ),
    )
    result: Text | None = Field(
        None, description="name, id or refType of the result of a DCC (XML) that is meant"
    )
    coverage_factor: float | None = Field(
        None, gt=0, description="k of the expanded uncertainties of a CSV file without a column k"
    )


@dataclass(frozen=True)
class Entry:
    """A value of a file: two names, value and standard uncertainty (NaN without one) in metres, and
    where it is written.
    """

    names: tuple[str, str]
    value: float
    uncertainty: float
    mark: Mark
    steps: Steps


@dataclass(frozen=True)
class Uncertainties:
    """Standard uncertainties (m,) of values in metres, and the root of their covariance where they
    are correlated.
    """

    standard: Array
    root: CovarianceRoot | None = None


@dataclass(frozen=True)
class FileValues:
    """What a file states: its entries, and of a digital certificate a covariance (m, m) with its
    rounding of the values that were asked for.
    """

    entries: list[Entry]
    covariance: tuple[Array, Array] | None = None


def is_digital(values: object) -> bool:
    """Whether the values of an item are in a digital certificate."""
    return isinstance(values, str) and values.lower().endswith(".xml")


def check_keys(settings: Any, steps: Steps, references: References) -> bool:
    """Tell whether the keys about a file go with one another, after saying which do not."""
    is_right = True
    of_file = isinstance(settings.values, str)
    digital = is_digital(settings.values)
    for key, fits, instead in (
        ("result", digital, "goes with values in a DCC (XML)"),
        ("coverage_factor", of_file and not digital, "goes with values in a CSV file"),
        ("covariance", not digital, "is for values that are no DCC, which has its own"),
    ):
        if getattr(settings, key) is not None and not fits:
            references.problems.add((*steps, key), f"{instead}; remove it", of_key=True)
            is_right = False
    return is_right


def read_rows(
    settings: Any,
    texts: Sequence[str],
    lengths: Sequence[str],
    others: Sequence[str],
    steps: Steps,
    references: References,
) -> tuple[tuple[FileRow, ...], list[Array]] | None:
    """Rows of a CSV file, and the standard uncertainties of each row's `lengths`, NaN without any;
    None after saying what is wrong.
    """
    path = references.folder / settings.values
    problems = references.problems
    own = [f"{one}_{name}" for name in (STANDARD, EXPANDED) for one in lengths]
    optional = [*others, STANDARD, EXPANDED, *own]
    columns = [*texts, FACTOR]
    try:
        _refuse_unclear(table_lines(path), str(path))
        rows = read_table(
            path, columns, lengths, optional, defaults={FACTOR: NO_FACTOR}, absent=math.nan
        )
    except ExperimentError as error:
        problems.take(error, steps)
        return None
    count, before = len(lengths), len(problems.messages)
    uncertainties = []
    for row in rows:
        extra = dict(zip(optional, row.lengths[count:], strict=True))
        factor = _factor(row.texts[-1], settings.coverage_factor)
        found = np.full(count, math.nan)
        for k, one in enumerate(lengths):
            stated = [
                value
                for name in (STANDARD, EXPANDED)
                for value in (extra[f"{one}_{name}"], extra[name])
                if not math.isnan(value)
            ]
            if len(stated) > 1:
                text = "states an uncertainty twice; leave one column out"
                problems.add_at(row.mark, steps, text)
                break
            if not stated:
                continue
            is_expanded = not all(math.isnan(extra[n]) for n in (EXPANDED, f"{one}_{EXPANDED}"))
            text = _wrong(stated[0], is_expanded, factor, row.texts[-1])
            if text:
                problems.add_at(row.mark, steps, text)
                break
            found[k] = stated[0] / (factor or 1.0) if is_expanded else stated[0]
        if not is_right_factor(row.texts[-1], extra, own):
            text = "has a coverage factor k and no expanded uncertainty; call the column"
            problems.add_at(row.mark, steps, f"{text} expanded_uncertainty_um, or leave k out")
        uncertainties.append(found)
    return None if len(problems.messages) > before else (rows, uncertainties)


def is_right_factor(text: str, extra: dict[str, float], own: list[str]) -> bool:
    """Whether a coverage factor stands beside an expanded uncertainty, or there is none."""
    names = [EXPANDED, *(name for name in own if name.endswith(EXPANDED))]
    return text == NO_FACTOR or any(not math.isnan(extra[name]) for name in names)


def _refuse_unclear(lines: list[tuple[int, str]], file: str) -> None:
    if not lines:
        return
    mark = Mark(file, lines[0][0], 1)
    for place, cell, _, unit in header_cells(mark, lines[0][1], "ball_1,ball_2,distance_mm"):
        if UNCLEAR.fullmatch(cell):
            text = (
                f'"{shorten(cell)}" does not say which uncertainty it is; call it'
                f" {STANDARD}_{unit}, or {EXPANDED}_{unit} beside a column k"
            )
            raise ExperimentError([place.message("", text)])


def _factor(text: str, common: float | None) -> float | None:
    if text == NO_FACTOR:
        return common
    try:
        return float(text)
    except ValueError:
        return math.nan


def _wrong(value: float, is_expanded: bool, factor: float | None, text: str) -> str:
    """What is wrong with a stated uncertainty; empty if nothing is."""
    if value < 0.0:
        return "an uncertainty is below zero; correct it"
    if not is_expanded:
        return ""
    if factor is None:
        return (
            "an expanded uncertainty has no coverage factor; add a column k, or coverage_factor to"
            " the item, or call the column standard_uncertainty if it is one"
        )
    return (
        ""
        if 0.0 < factor < math.inf
        else f'the coverage factor is "{shorten(text)}"; it must be above 0'
    )


def read_digital(
    settings: Any,
    wanted: Sequence[tuple[str, str]],
    is_pair: bool,
    steps: Steps,
    references: References,
) -> FileValues | None:
    """The wanted values in a digital certificate; None after saying what is wrong.

    The result is the one that is named, or else the only one that has them all.
    """
    problems, path = references.problems, references.folder / settings.values
    place = (*steps, "values")
    try:
        version, results = read_digital_certificate(path)
    except ExperimentError as error:
        problems.take(error, place)
        return None
    labels = listing(one.label for one in results)
    chosen = [one for one in results if settings.result is None or one.is_called(settings.result)]
    if not chosen or settings.result is not None and len(chosen) > 1:
        many = "several results are" if chosen else "no result is"
        text = f'{path.name}: {many} called "{shorten(settings.result)}"; it has {labels}'
        problems.add((*steps, "result"), text)
        return None
    forms = _forms(wanted, is_pair)
    by_result = [_matched(one, forms) for one in chosen]
    full = [k for k, found in enumerate(by_result) if len(found) == len(wanted)]
    if len(full) > 1:
        told = listing(chosen[k].label for k in full)
        text = f"{path.name}: {len(full)} results have these values: {told}; say which with result:"
        problems.add(place, text)
        return None
    best = full[0] if full else max(range(len(chosen)), key=lambda k: len(by_result[k]))
    result, found = chosen[best], by_result[best]
    if not full:
        text = _nothing_found(result, found, wanted, is_pair)
        problems.add(place, f"{path.name}: {text}; it has {labels}")
        return None
    before = len(problems.messages)
    entries = []
    for k, names in enumerate(wanted):
        values = [result.lengths[i] for i in found[k]]
        if len(values) > 1:
            lines = listing(str(one.mark.line) for one in values)
            text = f"{_named(names, is_pair)} has several values, in lines {lines}"
            problems.add_at(values[1].mark, place, text)
        if values[0].problem:
            text = f"{_named(names, is_pair)} {values[0].problem}"
            problems.add_at(values[0].mark, place, text)
        entries.append(Entry(names, values[0].value, values[0].uncertainty, values[0].mark, place))
    if len(problems.messages) > before:
        return None
    covariance = matrix_of(result, [found[k][0] for k in range(len(wanted))])
    _tell(
        version,
        result,
        [result.lengths[found[k][0]] for k in range(len(wanted))],
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
    factors = sorted({f"{one.factor:g}" for one in values if not math.isnan(one.uncertainty)})
    told = f"DCC {version}, result {result.label}: {len(values)} values"
    told += f", k = {listing(factors)}" if factors else ""
    told += ", with their covariance" if correlated else ""
    for name, degrees in result.temperatures:
        told += f"; {shorten(name)} {degrees:.4g} °C"
    references.problems.note(steps, f"{settings.values}: {told}")
    away = [one for _, one in result.temperatures if abs(one - REFERENCE_TEMPERATURE) > 0.5]
    if away:
        text = (
            f"{settings.values} states a temperature of {away[0]:.4g} °C; its values are taken as"
            " they are, as those at the temperature at which all lengths are meant"
        )
        references.problems.doubt(steps, text)


def _nothing_found(
    result: DigitalResult,
    found: dict[int, list[int]],
    wanted: Sequence[tuple[str, str]],
    is_pair: bool,
) -> str:
    missing = listing(_named(names, is_pair) for k, names in enumerate(wanted) if k not in found)
    if found:
        return f"result {result.label} has no value of {missing}"
    known = list(dict.fromkeys(name for one in result.lengths for name in one.names))
    example = " ".join(wanted[0])
    told = f"its values are called {listing(known)}" if known else "its values have no names"
    return f'no result has values of these balls, called for example "{example}"; {told}'


def _named(names: tuple[str, str], is_pair: bool) -> str:
    return "–".join(names) if is_pair else f"{names[1]} of {names[0]}"


def _words(text: str) -> tuple[str, ...]:
    return tuple(word for word in re.split(r"[\s_\-–—/.,:;|()\[\]]+", text.casefold()) if word)


def _forms(wanted: Sequence[tuple[str, str]], is_pair: bool) -> dict[tuple[str, ...], int]:
    """Words that name each value, in either order; those that name several are left out."""
    forms: dict[tuple[str, ...], int] = {}
    for k, (first, second) in enumerate(wanted):
        for words in (_words(first) + _words(second), _words(second) + _words(first)):
            forms[words] = -1 if forms.get(words, k) != k else k
    return {words: k for words, k in forms.items() if k >= 0}


def _matched(result: DigitalResult, forms: dict[tuple[str, ...], int]) -> dict[int, list[int]]:
    """Places of the values of a result by what is wanted."""
    found: dict[int, list[int]] = {}
    for i, one in enumerate(result.lengths):
        texts = [*one.names, *one.contexts]
        texts += [f"{own} {about}" for own in one.names for about in one.contexts]
        tried = [_words(text) for text in texts]
        tried += [tuple(word for word in words if word not in IDLE) for words in tried]
        k = next((forms[words] for words in tried if words in forms), None)
        if k is not None:
            found.setdefault(k, []).append(i)
    return found


def uncertainties_of(
    settings: Any,
    names: Sequence[tuple[str, str]],
    is_pair: bool,
    stated: Array | None,
    found: Array,
    covariance: tuple[Array, Array] | None,
    steps: Steps,
    references: References,
) -> Uncertainties | None:
    """Uncertainties of values with `names`: those `stated` (m,) with the item, or those `found`
    (m,) in its file, and those of a covariance; None after saying what is wrong.
    """
    problems, own = references.problems, (*steps, "standard_uncertainty")
    in_file = not np.isnan(found).any()
    matrix = covariance
    if settings.covariance is not None:
        matrix = _of_file(
            settings, names, is_pair, stated if stated is not None else found, steps, references
        )
        if matrix is None:
            return None
    is_correlation = settings.covariance is not None and len(matrix or ()) == 3
    states = in_file or (matrix is not None and not is_correlation)
    if stated is not None and states:
        where = settings.values if in_file or not settings.covariance else settings.covariance
        problems.add(own, f"{where} states uncertainties; remove one of the two", of_key=True)
        return None
    of_values = np.diag(matrix[0]) if states and matrix is not None else found
    without = np.flatnonzero(np.isnan(of_values))
    if 0 < len(without) < len(of_values):
        told = listing(_named(names[k], is_pair) for k in without.tolist())
        text = f"states no uncertainty of {told}, and of others it does; leave these out"
        problems.add((*steps, "values"), text)
        return None
    if stated is None and not states:
        text = 'missing; add "standard_uncertainty", or values with their uncertainties'
        problems.add(own, text)
        return None
    if matrix is None:
        return Uncertainties(_frozen(found if stated is None else stated))
    place = (*steps, "covariance") if settings.covariance is not None else (*steps, "values")
    size = np.sqrt(np.diag(matrix[0]))
    if in_file and not is_correlation:
        wrong = np.flatnonzero(np.abs(size - found) > AGREE * np.maximum(size, found) + 1e-12)
        if len(wrong):
            problems.add(place, _disagreement(names, is_pair, size, found, wrong))
            return None
    if len(size) > MOST_JOINT_VALUES:
        problems.add(
            place, f"{len(size)} correlated values; at most {MOST_JOINT_VALUES} are possible"
        )
        return None
    try:
        root = covariance_root(matrix[0], matrix[1])
    except IndefiniteError as error:
        problems.add(
            place,
            f"is no covariance: its correlations have {error}; correct it, or give more digits",
        )
        return None
    return Uncertainties(_frozen(size), root)


def _disagreement(
    names: Sequence[tuple[str, str]], is_pair: bool, size: Array, found: Array, wrong: Integers
) -> str:
    k = int(wrong[0])
    text = (
        f"the covariance has the standard uncertainty {1e6 * size[k]:.4g} µm for"
        f" {_named(names[k], is_pair)}, beside it stands {1e6 * found[k]:.4g} µm"
    )
    ratio = size[wrong] / np.maximum(found[wrong], 1e-300)
    if len(wrong) == len(size) and np.ptp(ratio) < 0.05 * ratio.mean() and ratio.mean() < 10.0:
        text += (
            f", always {ratio.mean():.3g} times; is one of the two expanded? State standard"
            " uncertainties and their covariance"
        )
        return text
    return f"{text}; correct one of the two"


def _of_file(
    settings: Any,
    names: Sequence[tuple[str, str]],
    is_pair: bool,
    standard: Array,
    steps: Steps,
    references: References,
) -> Any:
    """Covariance and rounding (m, m) of values from a CSV file, and a third entry where they are
    those of correlations; None after saying what is wrong.
    """
    problems, place = references.problems, (*steps, "covariance")
    try:
        matrix = read_matrix(references.folder / settings.covariance)
    except ExperimentError as error:
        problems.take(error, place)
        return None
    index: dict[str, int] = {}
    for k, (first, second) in enumerate(names):
        index[f"{first} {second}"] = k
        index[f"{second} {first}"] = k
    at = np.full(len(names), -1)
    messages: list[Message] = []
    for i, name in enumerate(matrix.names):
        known = index.get(" ".join(name.split()))
        if known is None:
            text = f'"{shorten(name)}" names no value of this item; {hint(name, index)}'
            messages.append(matrix.marks[i].message("", text))
        elif at[known] >= 0:
            messages.append(matrix.marks[i].message("", f'"{shorten(name)}" stands there twice'))
        else:
            at[known] = i
    missing = [_named(names[k], is_pair) for k in np.flatnonzero(at < 0).tolist()]
    if missing and not messages:
        problems.add(place, f"no covariance of {listing(missing)}; add it")
        return None
    if messages:
        problems.take(ExperimentError(messages), place)
        return None
    values, rounding = matrix.values[np.ix_(at, at)], matrix.rounding[np.ix_(at, at)]
    if not matrix.is_correlation:
        return values, rounding
    scale = np.outer(standard, standard)
    if np.isnan(standard).any():
        text = 'missing; a correlation needs "standard_uncertainty", or uncertainties in values'
        problems.add((*steps, "standard_uncertainty"), text)
        return None
    return values * scale, rounding * scale, True


def _frozen(values: Array) -> Array:
    found = np.array(values, float)
    found.setflags(write=False)
    return found
