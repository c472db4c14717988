"""A sweep's results as one page that needs no network, script or further file."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import PurePosixPath

import numpy as np
from ballplate.extensions.pages.interface import (
    Html,
    Page,
    PageSection,
    element,
    facts_list,
    joined,
    note,
    sentence,
    table,
    written,
)
from ballplate.presentation import number, percent, table_rows
from ballplate.simulator.machines import Array

from .answer import WITHIN, SweepAnswer, answer, criterion, described
from .cases import IN_TEXT, MOST_ROWS, SHOWN, SweepCases, columns_of
from .curves import curves, frontier_chart
from .design_drawings import drawings, drawn
from .effects import effects, frontier, known_hours

# Values of an axis in the list of facts.
LISTED = 12

# Temporary sweep file of the studio.
MADE_IN_STUDIO = ".ballplate-sweep.yaml"

FOOT = "Standard uncertainties throughout; ballplate sweep --export has all figures and digits."


def sweep_page(result: SweepCases) -> str:
    """Return the page of a sweep."""
    found, judged, hours = answer(result), criterion(result), known_hours(result)
    value = result.figure(judged or "")
    best = [] if hours is None else frontier(hours, value).tolist()
    first = [] if found is None else [*found.outstanding, *found.best]
    order = dict.fromkeys([*first, *best, *range(len(result.table))])
    rows = sorted(list(order)[:MOST_ROWS])
    designs = drawings(result, rows)
    drawn_rows = {row for group in designs.values() for row in group}
    left_out = len(result.table) - len(rows)
    more = note(f"Cases not shown here: {left_out}.") if left_out else ""
    cases = joined([_table("cases", "", result, rows, SHOWN, drawn_rows), more])
    listed = element("ul", *(element("li", text) for text in result.shortcomings))
    answered = axes = costs = Html()
    if found is not None and judged is not None:
        answered = _answer(result, found, judged)
        targets = {row: f"case-{result.table['cell'][row]}" for row in rows}
        charts = curves(result, judged, targets)
        axes = joined([_effects(result, value), element("div", *charts, class_="charts")])
        if hours is not None and best:
            chart = frontier_chart(result, judged, hours, best, targets)
            caption = "Cases that no other beats in both"
            shown = _table(
                "frontier", caption, result, [row for row in best if row in targets], IN_TEXT
            )
            costs = joined([element("div", chart, class_="charts"), shown])
    sections = [
        PageSection("answer", "Answer", answered),
        PageSection("costs", "Uncertainty against hours", costs),
        PageSection("axes", "Effect of each axis", axes),
        PageSection("cases", "Cases", cases if rows else Html()),
        PageSection("designs", "Designs", _designs(result, designs, judged or "")),
        PageSection("notes", "Failures and notes", listed if result.shortcomings else Html()),
        PageSection("swept", "What was swept", facts_list(_facts(result))),
    ]
    return written(Page(result.title, sentence(f"{result.headline()}."), sections, FOOT))


def _answer(result: SweepCases, found: SweepAnswer, column: str) -> Html:
    first, *further = found.sentences
    verdict = element("p", first, class_="verdict" if found.is_good else "verdict bad")
    shown = (
        _outstanding(result, row, reason, found.case) for row, reason in found.outstanding.items()
    )
    best = _table("best", "The best cases", result, found.best, IN_TEXT)
    is_timed = np.isfinite(result.figure("hours")).any()
    others = "hours include set-ups and changes" if is_timed else "other costs are not included"
    costs = note(f"Observations are readings and certified values; {others}.")
    pictures = element("div", *shown, class_="picked")
    return joined([verdict, *map(sentence, further), pictures, best, costs])


def _outstanding(result: SweepCases, row: int, reason: str, assessed: int) -> Html:
    """Return a case with its figures, what they take for granted, and its design."""
    number_of_case = result.table["cell"][row]
    heads, (texts,) = _cells(result, [row], IN_TEXT)
    facts = [(head, text) for head, text in zip(heads, texts, strict=True) if text]
    share = result.figure(WITHIN)[row]
    met = "met with all lengths" if share == 1.0 else f"met with {percent(float(share))} of lengths"
    facts += [("target", met)] if np.isfinite(share) else []
    if "assess" not in result.table["given"][row] and (
        number_of_case != assessed or result.summary.left
    ):
        facts.append(("assumptions", "not assessed for this case"))
    pictures = (
        drawn(text, sentence("Positions in the volume")) for text in drawings(result, [row])
    )
    head = element("h3", f"Case {number_of_case}: {reason}")
    return element("div", head, *pictures, facts_list(facts))


def _effects(result: SweepCases, value: Array) -> Html:
    """Return the table of the axes' effects."""
    rows = []
    for axis in effects(result, value):
        compared = len(axis.ratios)
        ratios = (np.median(axis.ratios), axis.ratios.min(), axis.ratios.max()) if compared else ()
        best = f"{' or '.join(axis.best)}, in {axis.wins} of {compared}" if compared else "-"
        texts = [f"{ratio:.2f}" if np.isfinite(ratio) else "-" for ratio in ratios] or ["-"] * 3
        counts = f"{compared} of {axis.combinations}", str(axis.complete)
        rows.append([axis.name, str(axis.values), *texts, best, *counts])
    heads = ["axis", "values", "largest / smallest, median", "least", "most"]
    heads += ["best value, in combinations", "combinations compared", "of these, with all values"]
    words = note(
        "The largest average along the axis over the smallest, for each combination of the other"
        " axes with two or more cases that determine it. Dots of the charts lead to the case's"
        " design."
    )
    return joined([table("effects", "", heads, rows, (0, 5)), words]) if rows else Html()


def _designs(result: SweepCases, designs: dict[str, list[int]], column: str) -> Html:
    """Return drawings of cases, each once for all cases with the same positions."""
    parts = []
    for text, rows in designs.items():
        cases = [
            element("p", described(result, row, column), id=f"case-{result.table['cell'][row]}")
            for row in rows
        ]
        parts.append(drawn(text, *cases))
    return element("div", *parts, class_="designs") if parts else Html()


def _table(
    name: str,
    caption: str,
    result: SweepCases,
    rows: Sequence[int],
    shown: Collection[str] = SHOWN,
    drawn_rows: Collection[int] | None = None,
) -> Html:
    """Return a table of cases that leads to what is drawn, and to the table of all cases."""
    heads, texts = _cells(result, rows, shown)
    for row, cells in zip(rows, texts, strict=True):
        case = str(result.table["cell"][row])
        is_here = drawn_rows is not None and row not in drawn_rows
        where = {"id": f"case-{case}"} if is_here else {"href": f"#case-{case}"}
        cells.insert(0, element("span" if is_here else "a", case, **where))
    words = [
        k + 1
        for k, (_, values) in enumerate(columns_of(result, rows, shown))
        if isinstance(values[0], str)
    ]
    return table(name, caption, ["case", *heads], texts, words, is_long=len(texts) > LISTED)


def _cells(
    result: SweepCases, rows: Sequence[int], shown: Collection[str]
) -> tuple[list[str], list[list[str]]]:
    """Return headings and texts of the cells of some rows."""
    columns = columns_of(result, rows, shown)
    texts = [
        ["" if v is None else number(v) if isinstance(v, float) else str(v) for v in row.values()]
        for row in table_rows(columns, in_units=True)
    ]
    return [heading for heading, _ in columns], texts


def _source(path: str) -> tuple[str, str]:
    """Return the source of a sweep, from its path in the store.

    >>> _source("plates/sizes.yaml"), _source("plates/.ballplate-sweep.yaml")
    (('Sweep file', 'plates/sizes.yaml'), ('Sweep', 'made in the studio'))
    """
    # Readers cannot look up a temporary file.
    if PurePosixPath(path).name == MADE_IN_STUDIO:
        return "Sweep", "made in the studio"
    return "Sweep file", path


def _facts(result: SweepCases) -> list[tuple[str, str]]:
    stored = result.definition
    base = stored["experiment"].get("title", "") if isinstance(stored["experiment"], dict) else ""
    facts = [
        _source(stored["source"]),
        ("Experiment", f"{stored['base']}: {base}" if base else stored["base"]),
    ]
    for axis in result.axes:
        labels = list(axis.labels)
        if len(labels) > LISTED:
            labels = [*labels[: LISTED - 1], f"… {labels[-1]} ({len(labels)} values)"]
        facts.append((f"Axis {axis.name}", ", ".join(labels)))
    trials = stored["trials"]
    monte_carlo = f"{trials} data sets of each case, seed {stored['seed']}" if trials else "none"
    facts += [("Recorded", ", ".join(stored["record"])), ("Monte Carlo", monte_carlo)]
    for name in result.table.columns:
        if name.endswith("_version"):
            versions = sorted(set(map(str, result.table[name])))
            facts.append((f"Computed with {name.removesuffix('_version')}", ", ".join(versions)))
    return facts
