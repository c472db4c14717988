"""A sweep's results as one page that needs no network, script or further file."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from pathlib import PurePosixPath

from ballplate.extensions.pages.interface import (
    Html,
    Page,
    PageSection,
    chart_svg,
    element,
    facts_list,
    figure,
    joined,
    note,
    sentence,
    table,
    written,
)

from .answer import answer, criterion
from .axis_effects import effects, frontier
from .cases import IN_TEXT, MOST_ROWS, SHOWN, SweepCases, described, texts_of
from .curves import charts
from .design_drawings import drawings, drawn
from .temporary import TEMPORARY

# Values of an axis in the list of facts.
LISTED = 12

CAPTIONS = {
    "best": "The best cases",
    "frontier": "Cases of which no other has less uncertainty in as few hours",
    "cases": "Cases by number",
}
COSTS = note(
    "Observations are readings and certified values. Where cases are not planned, assumptions are"
    " assessed for the first case of this table and those above it only, when all cases are done."
)
EFFECTS = "Largest average over smallest along each axis, for each combination of the others"
HEADS = (
    "axis",
    "median",
    "least",
    "most",
    "smallest at, in combinations",
    "combinations with two or more values",
    "with all values",
)

IN_WORDS = ("status", "given", "unspanned")

FOOT = "Standard uncertainties throughout; ballplate sweep --export has all figures and digits."


def sweep_page(result: SweepCases) -> str:
    """Return the page of a sweep."""
    found, judged = answer(result), criterion(result)
    value = result.figure(judged or "")
    best = frontier(result, value)[:MOST_ROWS]
    first = [] if found is None else [*found.outstanding, *found.best, *best]
    rows = sorted(list(dict.fromkeys([*first, *range(len(result.table))]))[:MOST_ROWS])
    designs = drawings(result, rows)
    cells = result.table["cell"]
    targets = {row: f"case-{cells[row]}" for group in designs.values() for row in group}
    listed = partial(_table, result, targets)
    left_out = len(result.table) - len(rows)
    more = note(f"Cases not shown here: {left_out}.") if left_out else ""
    notes = element("ul", *(element("li", text) for text in result.shortcomings))
    sections, drawn_cases = [], []
    if found is not None and judged is not None:
        verdict, *further = found.sentences
        kind = "verdict" if found.is_good else "verdict bad"
        others = (sentence(each) for each in further if each not in found.outstanding.values())
        pictures = (
            element("div", sentence(line), *map(drawn, drawings(result, [row])))
            for row, line in found.outstanding.items()
        )
        shown = element("div", *pictures, class_="picked"), *others, listed("best", found.best)
        answered = joined([element("p", verdict, class_=kind), *shown, COSTS])
        drawn_charts = charts(result, judged, best, targets)
        figures = [figure(chart.words, chart_svg(chart)) for chart in drawn_charts]
        costs = [figures.pop(0), listed("frontier", best)] if best else []
        axes = [table("effects", EFFECTS, HEADS, effects(result, value), (0, 4)), *figures]
        for text, group in designs.items():
            lines = zip(group, described(result, group), strict=True)
            texts = (element("p", line, id=targets[k]) for k, line in lines)
            drawn_cases.append(element("div", drawn(text, *texts), class_="design"))
        sections = [
            PageSection("answer", "Answer", answered),
            PageSection("frontier", "Uncertainty against hours", joined(costs)),
            PageSection("axes", "Effect of each axis", joined(axes if figures else [])),
        ]
    if rows:
        cases = joined([listed("cases", rows, SHOWN), more])
        sections.append(PageSection("cases", "Cases", cases))
    sections += [
        PageSection("designs", "Designs", joined(drawn_cases)),
        PageSection("notes", "Failures and notes", notes if result.shortcomings else Html()),
        PageSection("swept", "What was swept", facts_list(_facts(result))),
    ]
    return written(Page(result.title, sentence(f"{result.headline()}."), sections, FOOT))


def _table(
    result: SweepCases,
    targets: Mapping[int, str],
    name: str,
    rows: Sequence[int],
    shown: Collection[str] = IN_TEXT,
) -> Html:
    """Return a table of cases that leads to their designs."""
    heads, texts = texts_of(result, rows, shown)
    for row, cells in zip(rows, texts, strict=True):
        case = str(result.table["cell"][row])
        cells.insert(0, element("a", case, href=f"#{targets[row]}") if row in targets else case)
    words = [k for k, head in enumerate(heads, 1) if k <= len(result.axes) or head in IN_WORDS]
    caption = CAPTIONS[name]
    return table(name, caption, ["case", *heads], texts, [0, *words], is_long=len(texts) > LISTED)


def _facts(result: SweepCases) -> list[tuple[str, str]]:
    stored = result.definition
    base = stored["experiment"].get("title", "") if isinstance(stored["experiment"], dict) else ""
    source = stored["source"]
    # Readers cannot look up a temporary file.
    is_made = PurePosixPath(source).name == TEMPORARY
    facts = [
        ("Sweep", "in Python or the studio") if is_made else ("Sweep file", source),
        ("Experiment", f"{stored['base']}: {base}" if base else stored["base"]),
    ]
    if plan := stored["sweep"].get("plan"):
        facts.append(("Plan", ", ".join(f"{key} {value}" for key, value in plan.items())))
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
