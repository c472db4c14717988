"""Answer of a sweep: the settings that meet the target, the cheapest of these, and each axis's
effect.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.presentation import Block, Entry, Row, Table, number, percent
from ballplate.simulator.computing import comparable
from ballplate.simulator.design import Flags
from ballplate.simulator.inputs import listing, number_of
from ballplate.simulator.machines import Array, Integers

from .axis_worth import AxisWorth, axis_worths
from .measures import column_unit
from .results import ReportedSweep, best_first, criterion, given_sentences, texts_of_cell

# Settings in the answer's table.
LISTED = 8

WITHIN = "U6_within_target"


@dataclass(frozen=True)
class SweepAnswer:
    """Sentences, a table of settings, and each axis's effect on the average of the quantity
    `symbol`.

    `is_good` unless no setting meets an existing target.
    """

    symbol: str
    sentences: tuple[str, ...]
    settings: Table
    worth: tuple[AxisWorth, ...]
    is_good: bool


def answer(results: ReportedSweep) -> SweepAnswer | None:
    """Return the answer of a sweep; None if no cell is done, or no criterion is recorded."""
    judged = criterion(results)
    done = np.flatnonzero(results.done)
    if judged is None or not len(done):
        return None
    column = judged[0]
    value, observations = results.figure(column)[done], results.figure("observations")[done]
    partly = ~np.isfinite(value)
    share = results.figure(WITHIN)[done]
    meets = share == 1.0
    if np.isfinite(share).any():
        sentences = _sentences_with_target(results, done, column, share, observations, value)
        order = (
            best_first(~meets, observations, value) if meets.any() else best_first(-share, value)
        )
    else:
        sentences = _sentences_without_target(results, done, column, value, partly)
        order = best_first(partly, value)
    sentences[1:1] = given_sentences(results)
    sentences += _sentences_on_others(results, done)
    return SweepAnswer(
        _symbol(column),
        tuple(sentences),
        _table(results, done[order[:LISTED]], column),
        tuple(axis_worths(results, column, done[~partly])),
        bool(meets.any()) or not np.isfinite(share).any(),
    )


def _sentences_with_target(
    results: ReportedSweep,
    done: Integers,
    column: str,
    share: Array,
    observations: Array,
    value: Array,
) -> list[str]:
    """Return sentences on settings with a target, which may be an axis of the sweep."""
    meets, judged = share == 1.0, int(np.isfinite(share).sum())
    apart = len(done) - judged
    if meets.any():
        sentences = [
            f"{meets.sum()} of {_settings(judged)} {_verb(int(meets.sum()), 'meet')} the target"
            " uncertainty with all lengths.",
            _cheapest_sentence(results, done, column, np.flatnonzero(meets), observations, value),
        ]
    else:
        best = best_first(-share, value)[0]
        alike = int((share == share[best]).sum()) - 1
        tied = f"; {_settings(alike)} more {_verb(alike, 'have')} as many" if alike else ""
        subject = "The only case does not meet" if judged == 1 else f"None of the {judged}"
        subject += "" if judged == 1 else " cases meets"
        sentences = [
            f"{subject} the target uncertainty with all lengths. The"
            f" nearest is {_setting(results, done[best])}, with {percent(float(share[best]))} of"
            f" the lengths{tied}."
        ]
    if apart:
        sentences.append(
            f"{_settings(apart)} more {_verb(apart, 'have')} no target to be compared with."
        )
    return sentences


def _cheapest_sentence(
    results: ReportedSweep,
    done: Integers,
    column: str,
    candidates: Integers,
    observations: Array,
    value: Array,
) -> str:
    """Return a sentence on the setting with the fewest observations and, among those, the
    smallest average.
    """
    counted = candidates[np.isfinite(observations[candidates])]
    if not len(counted):
        return "Their numbers of observations are not recorded."
    fewest = counted[observations[counted] == observations[counted].min()]
    best, same = _first_of_best(value, fewest)
    name, count = _setting(results, done[best]), f"{observations[best]:.0f} observations"
    if len(fewest) == 1:
        return f"The one with the fewest observations is {name}: {count}."
    tied = f", as {_verb(same, 'have')} {same} more" if same else ""
    return (
        f"The fewest observations are {observations[best]:.0f}, in {len(fewest)} of these cases."
        f" Among these, {name} has the smallest average of"
        f" {_quantity(results, column, value[best])}"
        f"{tied}."
    )


def _sentences_without_target(
    results: ReportedSweep, done: Integers, column: str, value: Array, partly: Flags
) -> list[str]:
    """Return sentences on settings without a target."""
    if WITHIN.partition("_")[0] in results.definition["record"]:
        sentence = "No case has a target uncertainty for its lengths."
    else:
        sentence = "U6 is not recorded, so that no case is compared with a target uncertainty."
    if partly.all():
        return [sentence, f"Every case leaves some of {_symbol(column)} undetermined."]
    best, alike = _first_of_best(value, np.flatnonzero(~partly))
    tied = f"; {_settings(alike)} more {_verb(alike, 'have')} the same" if alike else ""
    return [
        f"{sentence} The smallest average of {_quantity(results, column, value[best])}, is that of"
        f" {_setting(results, done[best])}{tied}."
    ]


def _first_of_best(value: Array, places: Integers) -> tuple[int, int]:
    """Return the first of `places` with the smallest value, and the number of further ones."""
    values = comparable(value[places])
    best = best_first(values)[0]
    return int(places[best]), int((values == values[best]).sum()) - 1


def _sentences_on_others(results: ReportedSweep, done: Integers) -> list[str]:
    """Return sentences on settings that are deficient, or without results."""
    sentences = []
    deficient = int((results.figure("rank_deficiency")[done] > 0).sum())
    if deficient:
        verb = _verb(deficient, "leave")
        sentences.append(f"{deficient} of {_settings(len(done))} {verb} something undetermined.")
    missing = (
        (results.count("failed"), "failed"),
        (results.left, "not computed yet"),
        (len(results.found.damaged), "not readable"),
    )
    parts = [f"{count} {words}" for count, words in missing if count]
    if parts:
        sentences.append(
            f"Of {_settings(len(results.cells))}, {listing(parts)}; the answer is that of the"
            " others."
        )
    lost = (texts["unspanned"] for texts in results.texts.values() if "unspanned" in texts)
    return sentences + [f"Places do not follow the size: {text}." for text in dict.fromkeys(lost)]


def _settings(count: int) -> str:
    return number_of(count, "case")


def _verb(count: int, verb: str) -> str:
    """Return a verb that agrees with a number of settings.

    >>> _verb(1, "have"), _verb(2, "have"), _verb(1, "meet")
    ('has', 'have', 'meets')
    """
    return verb if count != 1 else "has" if verb == "have" else f"{verb}s"


def _setting(results: ReportedSweep, row: int) -> str:
    return results.label(results.cell(row))


def _symbol(column: str) -> str:
    return column.partition("_average_")[0].replace("_", " ")


def _quantity(results: ReportedSweep, column: str, value: float) -> str:
    """Return a quantity with its average."""
    return f"{_symbol(column)}, {number(1e6 * value, 3)} {column_unit(column)}"


def _table(results: ReportedSweep, rows: Integers, column: str) -> Table:
    of_largest = column.replace("_average_", "_maximum_")
    unit, words = column_unit(column), _symbol(column)
    columns = [("observations", "observations", 1.0), (f"{words} average, {unit}", column, 1e6)]
    if of_largest in results.frame:
        columns.append((f"{words} maximum, {unit}", of_largest, 1e6))
    if WITHIN in results.frame:
        columns.append(("lengths within target", WITHIN, 100.0))
    listed = []
    for row in rows.tolist():
        entries = []
        for _, name, factor in columns:
            value = results.value(name, row)
            text = number(factor * value, 4)
            if name == WITHIN:
                text = "-" if np.isnan(value) else percent(value)
            if name == "observations":
                text = "-" if np.isnan(value) else f"{value:.0f}"
            entries.append(Entry(text, value, results.cell(row), name))
        listed.append(
            Row(results.labels(row), tuple(entries), texts_of_cell(results, results.cell(row)))
        )
    headings = tuple(axis.name for axis in results.axes)
    names = tuple(name for name, _, _ in columns)
    costs = "Observations are readings and certified values; other costs are not included."
    notes = (*given_sentences(results), costs)
    caption = "The best cases"
    blocks = (Block("", tuple(listed)),)
    return Table("answer", caption, headings, names, blocks, notes=notes)
