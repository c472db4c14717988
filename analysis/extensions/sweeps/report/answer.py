"""Answer of a sweep: which settings meet the target, which of these takes fewest observations, and
what each axis changes while the others stay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.presentation import Block, Entry, Row, Table, number, percent
from ballplate.simulator.computing import comparable
from ballplate.simulator.inputs import listing, number_of
from numpy.typing import NDArray

from .axis_worth import AxisWorth, axis_worths
from .measures import column_unit
from .results import Integers, ReportedSweep, best_first, criterion, partly_open

# Settings that the answer lists.
LISTED = 8

WITHIN = "U6_within_target"

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SweepAnswer:
    """Sentences, the settings that they are about, and what each axis is worth in the average of
    the quantity `symbol`; `is_good` unless there is a target that no setting meets.
    """

    symbol: str
    sentences: tuple[str, ...]
    settings: Table | None
    worth: tuple[AxisWorth, ...]
    is_good: bool


def answer(results: ReportedSweep) -> SweepAnswer | None:
    """The answer of a sweep; None where nothing is done or recorded that cells are judged by."""
    judged = criterion(results)
    done = np.flatnonzero(results.done)
    if judged is None or not len(done):
        return None
    column, symbol = judged
    value, observations = results.figure(column)[done], results.figure("observations")[done]
    partly = partly_open(results, symbol)[done] | ~np.isfinite(value)
    share = results.figure(WITHIN)[done]
    meets = share == 1.0
    if np.isfinite(share).any():
        sentences = _of_target(results, done, column, share, observations, value)
        order = (
            best_first(~meets, observations, value) if meets.any() else best_first(-share, value)
        )
    else:
        sentences = _without_target(results, done, column, value, partly)
        order = best_first(partly, value)
    sentences += _left_out(results, done)
    return SweepAnswer(
        _symbol(column),
        tuple(sentences),
        _table(results, done[order[:LISTED]], column, symbol),
        tuple(axis_worths(results, column, done[~partly])),
        bool(meets.any()) or not np.isfinite(share).any(),
    )


def _of_target(
    results: ReportedSweep,
    done: Integers,
    column: str,
    share: Floats,
    observations: Floats,
    value: Floats,
) -> list[str]:
    """Sentences on settings that have a target, which may be an axis of the sweep."""
    meets, judged = share == 1.0, int(np.isfinite(share).sum())
    apart = len(done) - judged
    if meets.any():
        told = [
            f"{meets.sum()} of {_settings(judged)} {_verb(int(meets.sum()), 'meet')} the target"
            " uncertainty with all lengths.",
            _cheapest(results, done, column, np.flatnonzero(meets), observations, value),
        ]
    else:
        best = best_first(-share, value)[0]
        alike = int((share == share[best]).sum()) - 1
        tied = f"; {_settings(alike)} more {_verb(alike, 'have')} as many" if alike else ""
        subject = "The only setting does not meet" if judged == 1 else f"None of the {judged}"
        subject += "" if judged == 1 else " settings meets"
        told = [
            f"{subject} the target uncertainty with all lengths. The"
            f" nearest is {_setting(results, done[best])}, with {percent(float(share[best]))} of"
            f" the lengths{tied}."
        ]
    if apart:
        told.append(
            f"{_settings(apart)} more {_verb(apart, 'have')} no target to be compared with."
        )
    return told


def _cheapest(
    results: ReportedSweep,
    done: Integers,
    column: str,
    candidates: Integers,
    observations: Floats,
    value: Floats,
) -> str:
    """The setting of the fewest observations; of several, that with the smallest average."""
    known = candidates[np.isfinite(observations[candidates])]
    if not len(known):
        return "How many observations they take is not recorded."
    fewest = known[observations[known] == observations[known].min()]
    best, same = _first_of_best(value, fewest)
    name, count = _setting(results, done[best]), f"{observations[best]:.0f} observations"
    if len(fewest) == 1:
        return f"The one with the fewest observations is {name}: {count}."
    tied = f", as {_verb(same, 'have')} {same} more" if same else ""
    return (
        f"The fewest observations are {observations[best]:.0f}, in {len(fewest)} of these settings."
        f" Of them {name} has the smallest average of {_quantity(results, column, value[best])}"
        f"{tied}."
    )


def _without_target(
    results: ReportedSweep, done: Integers, column: str, value: Floats, partly: NDArray[np.bool_]
) -> list[str]:
    """Sentences where nothing was compared with a target."""
    if WITHIN.partition("_")[0] in results.definition["record"]:
        told = "No setting has a target uncertainty that its lengths are compared with."
    else:
        told = "U6 is not recorded, so that no setting is compared with a target uncertainty."
    if partly.all():
        return [told, f"In every setting some of {_symbol(column)} is undetermined."]
    best, alike = _first_of_best(value, np.flatnonzero(~partly))
    tied = f"; {_settings(alike)} more {_verb(alike, 'have')} the same" if alike else ""
    return [
        f"{told} The smallest average of {_quantity(results, column, value[best])}, is that of"
        f" {_setting(results, done[best])}{tied}."
    ]


def _first_of_best(value: Floats, places: Integers) -> tuple[int, int]:
    """The first of `places` that has the smallest value, and how many more have it."""
    found = comparable(value[places])
    best = best_first(found)[0]
    return int(places[best]), int((found == found[best]).sum()) - 1


def _left_out(results: ReportedSweep, done: Integers) -> list[str]:
    """Sentences on settings that leave something open, and on those without figures."""
    told = []
    deficient = int((results.figure("rank_deficiency")[done] > 0).sum())
    if deficient:
        verb = _verb(deficient, "leave")
        told.append(f"{deficient} of {_settings(len(done))} {verb} something undetermined.")
    missing = (
        (results.count("failed"), "failed"),
        (results.left, "not computed yet"),
        (len(results.found.damaged), "not readable"),
    )
    parts = [f"{count} {words}" for count, words in missing if count]
    if parts:
        told.append(
            f"Of {_settings(len(results.cells))}, {listing(parts)}; the answer is that of the"
            " others."
        )
    return told


def _settings(count: int) -> str:
    return number_of(count, "setting")


def _verb(count: int, verb: str) -> str:
    """A verb of so many settings.

    >>> _verb(1, "have"), _verb(2, "have"), _verb(1, "meet")
    ('has', 'have', 'meets')
    """
    return verb if count != 1 else "has" if verb == "have" else f"{verb}s"


def _setting(results: ReportedSweep, row: int) -> str:
    return results.label(int(results.frame["cell"].to_numpy()[row]))


def _symbol(column: str) -> str:
    return column.partition("_average_")[0].replace("_", " ")


def _quantity(results: ReportedSweep, column: str, value: float) -> str:
    """A quantity with its average."""
    return f"{_symbol(column)}, {number(1e6 * value, 3)} {column_unit(column)}"


def _table(results: ReportedSweep, rows: Integers, column: str, symbol: str) -> Table:
    cells = results.frame["cell"].to_numpy()
    of_largest = column.replace("_average_", "_maximum_")
    unit, words = column_unit(column), _symbol(column)
    columns = [("observations", "observations", 1.0), (f"{words} average, {unit}", column, 1e6)]
    if of_largest in results.frame:
        columns.append((f"{words} maximum, {unit}", of_largest, 1e6))
    if WITHIN in results.frame:
        columns.append(("lengths within target", WITHIN, 100.0))
    starred = partly_open(results, symbol)
    found = []
    for row in rows.tolist():
        entries = []
        for _, name, factor in columns:
            value = results.value(name, row)
            text = number(factor * value, 4) + ("*" if starred[row] and factor == 1e6 else "")
            if name == WITHIN:
                text = "-" if np.isnan(value) else percent(value)
            if name == "observations":
                text = "-" if np.isnan(value) else f"{value:.0f}"
            entries.append(Entry(text, value, int(cells[row]), name))
        labels = [axis.labels[k] for axis, k in zip(results.axes, results.chosen[row], strict=True)]
        found.append(Row(tuple(labels), tuple(entries)))
    headings = tuple(axis.name for axis in results.axes)
    told = tuple(name for name, _, _ in columns)
    notes = [
        "Observations are readings and certified values; what else a setting costs is not here."
    ]
    if starred[rows].any():
        notes.append("Values marked * leave out what is undetermined.")
    caption = "The settings that come first"
    blocks = (Block("", tuple(found)),)
    return Table("answer", caption, headings, told, blocks, notes=tuple(notes))
