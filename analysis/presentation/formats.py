"""Tables as Markdown, HTML and LaTeX."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from .table import Row, Table

if TYPE_CHECKING:
    import pandas


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
