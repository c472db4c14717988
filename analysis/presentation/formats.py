"""Tables as Markdown, HTML and LaTeX."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape

from .table import Block, Row, Table


def as_markdown(title: str, tables: Sequence[Table]) -> str:
    """Return tables in the Markdown of GitHub and Pandoc."""
    parts = [f"# {_markdown(title)}"]
    for table in tables:
        parts += ["", f"## {_markdown(table.caption)}"]
        for block in table.blocks:
            if block.title:
                parts += ["", f"### {_markdown(block.title)}"]
            head = [*table.headings, *table.spanned]
            marks = [" --- "] * len(table.headings) + [" ---: "] * len(table.columns)
            parts += ["", _markdown_row(head), f"|{'|'.join(marks)}|"]
            parts += [_markdown_row(_texts(row)) for row in block.rows]
        for note in table.notes:
            parts += ["", _markdown(note)]
    return "\n".join(parts) + "\n"


def _markdown_row(texts: Sequence[str]) -> str:
    return "|" + "|".join(f" {_markdown(text)} " for text in texts) + "|"


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
        head = [*table.headings, *table.spanned]
        stubs = len(table.headings)
        parts.append(f"<table><caption>{escape(table.caption)}</caption>")
        parts.append(f"<thead>{_html_row(head, 'th', stubs)}</thead>")
        for block in table.blocks:
            titled = (
                f'<tr><th colspan="{len(head)}">{escape(block.title)}</th></tr>'
                if block.title
                else ""
            )
            rows = "\n".join(_html_row(_texts(row), "td", stubs) for row in block.rows)
            parts.append(f"<tbody>{titled}{rows}</tbody>")
        parts += ["</table>", *(f"<p>{escape(note)}</p>" for note in table.notes)]
    return "\n".join(parts) + "\n"


def _html_row(texts: Sequence[str], element: str, stubs: int) -> str:
    sides = ["left"] * stubs + ["right"] * (len(texts) - stubs)
    cells = (
        f'<{element} style="text-align: {side}">{escape(text)}</{element}>'
        for text, side in zip(texts, sides, strict=True)
    )
    return f"<tr>{''.join(cells)}</tr>"


def as_latex(title: str, tables: Sequence[Table]) -> str:
    """Return a table environment for each table, without any package."""
    parts = [f"% {' '.join(title.split())}"]
    for table in tables:
        stubs, count = len(table.headings), len(table.columns)
        parts += ["\\begin{table}", "\\centering", f"\\caption{{{_latex(table.caption)}}}"]
        parts += [f"\\begin{{tabular}}{{{'l' * stubs}{'r' * count}}}", "\\hline"]
        if table.spanner:
            parts.append(
                f"{'& ' * stubs}\\multicolumn{{{count}}}{{c}}{{{_latex(table.spanner)}}} \\\\"
            )
        parts += [_latex_row([*table.headings, *table.columns]), "\\hline"]
        for block in table.blocks:
            parts += _latex_block(block, stubs + count)
        parts += ["\\end{tabular}", "\\end{table}"]
        parts += [_latex(note) + "\n" for note in table.notes]
    return "\n".join(parts) + "\n"


def _latex_block(block: Block, columns: int) -> list[str]:
    title = (
        [f"\\multicolumn{{{columns}}}{{l}}{{{_latex(block.title)}}} \\\\"] if block.title else []
    )
    return [*title, *(_latex_row(_texts(row)) for row in block.rows), "\\hline"]


def _latex_row(texts: Sequence[str]) -> str:
    return " & ".join(_latex(text) for text in texts) + " \\\\"


LATEX = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': "{\\char34}",
    # A bracket after \\ would be its argument.
    "[": "{[}",
    "]": "{]}",
    "*": "{*}",
    "µ": r"$\mu$",
    "μ": r"$\mu$",
    **{character: f"\\{character}" for character in "&%$#_{}"},
}


def _latex(text: str) -> str:
    r"""Return text with LaTeX's special characters escaped, and micrometres in math mode.

    >>> _latex("50 % of a_b, um")
    '50 \\% of a\\_b, $\\mu$m'
    >>> _latex("0.5 µm")
    '0.5 $\\mu$m'
    """
    if text == "-":
        return "--"
    escaped = "".join(LATEX.get(character, character) for character in text)
    return re.sub(r"(^|, | or )u(m|rad)\b", r"\1$\\mu$\2", escaped)


def _texts(row: Row) -> list[str]:
    return [*row.headings, *(entry.text for entry in row.entries)]
