"""Elements of a sweep's page: tables with values at full precision, and groups of cells."""

from __future__ import annotations

from ballplate.extensions.pages.elements import (
    Html,
    element,
    folded,
    joined,
    note,
    scrolling,
    sentence,
)
from ballplate.presentation import Block, Entry, Row, Table, micro

from .heatmaps import BLANK, DEFICIENT, Heat
from .verdicts import VerdictGroup, VerdictGroups

# Limits: columns of a table, rows that need no scrolling, letters of a heading in one line, and
# lines of all groups together that are shown unfolded.
MOST_COLUMNS, MOST_ROWS, MOST_LETTERS, MOST_LINES = 11, 60, 24, 20

# Classes of entries that have no shade by size.
OTHER_SHADES = {DEFICIENT: "heat deficient", BLANK: "heat"}


def table_element(table: Table) -> Html:
    """Return a table with its notes."""
    width = len(table.headings) + len(table.columns)
    kind = "scroll wide" if width > MOST_COLUMNS else "scroll"
    if table.size > MOST_ROWS and not table.spanner:
        kind += " high"
    names = [
        element("th", name or "figure", scope="col", class_="words") for name in table.headings
    ]
    names += [element("th", micro(name), scope="col") for name in table.columns]
    head = element("thead", element("tr", *names), class_="tall")
    if table.spanner:
        corner = element("td", colspan=len(table.headings))
        spanner = _spanner(table.spanner, len(table.columns))
        head = element("thead", element("tr", corner, spanner), element("tr", *names))
    blocks = [_block(block, width) for block in table.blocks]
    made = scrolling(f"table-{table.name}", table.caption, head, *blocks, kind=kind)
    return joined([made, *map(note, table.notes)])


def _spanner(words: str, columns: int) -> Html:
    return element("th", words, scope="colgroup", class_="spanner", colspan=columns)


def _block(block: Block, width: int) -> Html:
    rows = [_row(row) for row in block.rows]
    if block.title:
        title = element("th", block.title, scope="rowgroup", class_="group", colspan=width)
        rows.insert(0, element("tr", title))
    return element("tbody", *rows)


def _row(row: Row) -> Html:
    places = [element("th", row.headings[0], scope="row")]
    for heading in row.headings[1:]:
        kind = "words long" if len(heading) > MOST_LETTERS else "words"
        places.append(element("td", micro(heading), class_=kind))
    return element("tr", *places, *map(_place, row.entries))


def _place(entry: Entry, kind: str | None = None) -> Html:
    """Return an entry, with its cell, figure and value if it has them."""
    return element(
        "td",
        entry.text,
        class_=kind,
        data_cell=entry.cell,
        data_figure=entry.figure or None,
        data_value=None if entry.value is None else repr(entry.value),
    )


def heat_element(heat: Heat, number: int) -> Html:
    """Return a measure over two axes, shaded by size; `number` counts them on the page."""
    spanner = _spanner(micro(heat.columns.title), len(heat.column_labels))
    first = element("th", micro(heat.rows.title), scope="col", class_="words")
    labels = [element("th", label, scope="col") for label in heat.column_labels]
    rows = [element("tr", element("td"), spanner), element("tr", first, *labels)]
    head = element("thead", *rows, class_="tall")
    body = []
    for label, entries, shades in zip(heat.row_labels, heat.entries, heat.shades, strict=True):
        kinds = [OTHER_SHADES.get(shade, f"heat heat-{shade}") for shade in shades]
        places = map(_place, entries, kinds)
        body.append(element("tr", element("th", label, scope="row"), *places))
    caption = f"{micro(heat.measure.title)}, over {heat.rows.name} and {heat.columns.name}"
    made = scrolling(f"heat-{number}", caption, head, element("tbody", *body))
    return joined([made, note("Darker is larger. ", heat.note)])


def groups_element(groups: VerdictGroups) -> Html:
    """Return groups of cells with the same statement, or nothing."""
    is_lengthy = groups.size > MOST_LINES
    parts = [_group(group, is_lengthy) for group in groups.shown]
    if groups.more:
        words = f"{groups.more} further groups of cases are not shown; the store has them."
        parts.append(sentence(words))
    return joined(parts)


def _group(group: VerdictGroup, is_lengthy: bool) -> Html:
    heading = element("span", group.heading, class_="surprise" if group.is_surprise else None)
    count = "case" if group.count == 1 else f"{group.count} cases,"
    values = f" ({group.values})" if group.values else ""
    summary = joined([heading, f": {count} {group.cells}{values}"])
    if not group.lines:
        return sentence(summary)
    parts = [element("ol", *(element("li", line) for line in group.lines))]
    if group.more:
        parts.append(sentence(f"{group.more} further lines are not shown; the store has them."))
    return folded(summary, *parts, is_open=not is_lengthy, is_lengthy=is_lengthy)
