"""Tables as text, Markdown, HTML, CSV and LaTeX."""

from __future__ import annotations

import io
import re
import textwrap
from collections.abc import Callable, Sequence
from html import escape
from typing import TYPE_CHECKING

from ballplate.simulator.inputs.spreadsheets import CsvWriter

from .formatting import aligned, ascii_units
from .table import Row, Table

if TYPE_CHECKING:
    import pandas

WIDTH = 120


def as_text(title: str, tables: Sequence[Table]) -> str:
    """Return tables as aligned text."""
    parts = [title]
    for table in tables:
        parts += ["", f"{table.caption}", *_text_rows(table)]
        for note in table.notes:
            parts += textwrap.wrap(note, WIDTH)
    return "\n".join(parts) + "\n"


def _text_rows(table: Table) -> list[str]:
    stubs, count = len(table.headings), len(table.columns)
    right = [False] * stubs + [True] * count
    indent = "  " if table.block else ""
    head = [*table.headings, *table.columns]
    head[0] = head[0] or table.spanner
    rows, titles = [head], {}
    for block in table.blocks:
        if block.title:
            titles[len(rows)] = block.title
        rows += [
            [indent + row.headings[0], *row.headings[1:], *(e.text for e in row.entries)]
            for row in block.rows
        ]
    lines = []
    for k, line in enumerate(aligned(rows, right)):
        lines += [titles[k]] if k in titles else []
        lines.append(line)
    return lines


def _frame(table: Table) -> pandas.DataFrame:
    """Return the cells of a table as text, with titles of blocks in the first column."""
    import pandas

    titles = [table.block] if table.block else []
    rows = [
        [block.title for _ in titles] + _texts(row) for block in table.blocks for row in block.rows
    ]
    return pandas.DataFrame(rows, columns=[*titles, *table.headings, *table.spanned], dtype=str)


def _sides(table: Table) -> list[str]:
    """Return the alignment of the columns of `_frame`."""
    stubs = bool(table.block) + len(table.headings)
    return ["left"] * stubs + ["right"] * len(table.columns)


def as_markdown(title: str, tables: Sequence[Table]) -> str:
    """Return tables in the Markdown of GitHub and Pandoc.

    :raises ImportError: tabulate is missing.
    """
    parts = [f"# {_markdown(title)}"]
    for table in tables:
        frame = _frame(table).map(_markdown).rename(columns=_markdown)
        rows = frame.to_markdown(index=False, disable_numparse=True, colalign=_sides(table))
        parts += [f"## {_markdown(table.caption)}", rows, *map(_markdown, table.notes)]
    return "\n\n".join(parts) + "\n"


def _markdown(text: str) -> str:
    r"""Return text with Markdown's special characters escaped.

    >>> _markdown("a|b *c* <d>")
    'a\\|b \\*c\\* \\<d\\>'
    """
    return re.sub(r"([\\`*_{}\[\]<>|#$~])", r"\\\1", text)


def as_html(title: str, tables: Sequence[Table]) -> str:
    """Return tables as HTML elements, below a title."""
    parts = [f"<p><strong>{escape(title)}</strong></p>"] if title else []
    for table in tables:
        rows = _frame(table).to_html(index=False, border=0)
        notes = (f"<p>{escape(note)}</p>" for note in table.notes)
        parts += [f"<p>{escape(table.caption)}</p>", rows, *notes]
    return "\n".join(parts) + "\n"


def as_csv(title: str, tables: Sequence[Table]) -> str:
    """Return tables separated by empty lines, each with a line of headings; blocks are a column."""
    parts = []
    for table in tables:
        stream = io.StringIO()
        writer = CsvWriter(stream)
        first = [table.block] if table.block else []
        headings = [heading or "figure" for heading in table.headings]
        rows = [row for block in table.blocks for row in block.rows]
        further = [*dict.fromkeys(name for row in rows for name, text in row.texts.items() if text)]
        writer.writerow([*first, *map(ascii_units, [*headings, *table.spanned]), *further])
        for block in table.blocks:
            label = [block.title.removeprefix(f"{table.block} ")] if table.block else []
            writer.writerows(
                [
                    *label,
                    *map(ascii_units, row.headings),
                    *(entry.text for entry in row.entries),
                    *(row.texts.get(name, "") for name in further),
                ]
                for row in block.rows
            )
        parts.append(stream.getvalue())
    return "\n".join(parts)


def as_latex(title: str, tables: Sequence[Table]) -> str:
    r"""Return a tabular for each table, for the package booktabs; title, captions and notes are
    comments.

    :raises ImportError: jinja2 is missing.
    """
    parts = [_comment(title)]
    for table in tables:
        sides = "".join(side[0] for side in _sides(table))
        rows = _frame(table).to_latex(index=False, escape=True, column_format=sides)
        parts += [_comment(table.caption), rows.rstrip(), *map(_comment, table.notes)]
    return "\n".join(parts) + "\n"


def _comment(text: str) -> str:
    return f"% {' '.join(text.split())}"


def _texts(row: Row) -> list[str]:
    return [*row.headings, *(entry.text for entry in row.entries)]


FORMATS: dict[str, Callable[[str, Sequence[Table]], str]] = {
    "text": as_text,
    "markdown": as_markdown,
    "csv": as_csv,
    "latex": as_latex,
}
