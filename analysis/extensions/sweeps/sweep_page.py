"""A sweep's results as one page that needs no network, script or further file."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import PurePosixPath

from ballplate.extensions.pages.interface import (
    Html,
    Page,
    PageSection,
    element,
    facts_list,
    figures,
    joined,
    note,
    sentence,
    table,
    written,
)
from ballplate.presentation import number, table_rows

from .answer import SweepAnswer, answer, criterion
from .cases import IN_TEXT, MOST_ROWS, SHOWN, SweepCases, columns_of
from .curves import curves

# Values of an axis in the list of facts.
LISTED = 12

# Temporary sweep file of the studio.
MADE_IN_STUDIO = ".ballplate-sweep.yaml"

FOOT = "Standard uncertainties throughout; ballplate sweep --export has all figures and digits."


def sweep_page(result: SweepCases) -> str:
    """Return the page of a sweep."""
    found, judged = answer(result), criterion(result)
    charts = [] if found is None or judged is None else curves(result, judged)
    rows = range(min(len(result.table), MOST_ROWS))
    left_out = len(result.table) - len(rows)
    more = note(f"Cases not shown here: {left_out}.") if left_out else ""
    cases = joined([_table("cases", "Cases", result, rows), more]) if rows else Html()
    listed = element("ul", *(element("li", text) for text in result.shortcomings))
    sections = [
        PageSection("answer", "Answer", Html() if found is None else _answer(result, found)),
        PageSection("axes", "Along the axes", figures(*charts) if charts else Html()),
        PageSection("cases", "Cases", cases),
        PageSection("notes", "Failures and notes", listed if result.shortcomings else Html()),
        PageSection("swept", "What was swept", facts_list(_facts(result))),
    ]
    return written(Page(result.title, sentence(f"{result.headline()}."), sections, FOOT))


def _answer(result: SweepCases, found: SweepAnswer) -> Html:
    first, *further = found.sentences
    verdict = element("p", first, class_="verdict" if found.is_good else "verdict bad")
    best = _table("best", "The best cases", result, found.best, IN_TEXT)
    costs = note("Observations are readings and certified values; other costs are not included.")
    return joined([verdict, *map(sentence, further), best, costs])


def _table(
    name: str,
    caption: str,
    result: SweepCases,
    rows: Sequence[int],
    shown: Collection[str] = SHOWN,
) -> Html:
    columns = columns_of(result, rows, shown)
    texts = [
        ["" if v is None else number(v) if isinstance(v, float) else str(v) for v in row.values()]
        for row in table_rows(columns, in_units=True)
    ]
    words = [k for k, (_, values) in enumerate(columns) if isinstance(values[0], str)]
    heads = [heading for heading, _ in columns]
    return table(name, caption, heads, texts, words, is_long=len(texts) > LISTED)


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
