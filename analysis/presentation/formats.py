"""Tables as Markdown, HTML and LaTeX."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas


def as_markdown(
    title: str, caption: str, frame: pandas.DataFrame, stubs: int, notes: Sequence[str]
) -> str:
    """Return a table of texts, whose first columns `stubs` head its rows, in the Markdown of GitHub
    and Pandoc.

    :raises ImportError: tabulate is missing.
    """
    parts = [f"# {_markdown(title)}", f"## {_markdown(caption)}"]
    if not frame.empty:
        texts = frame.map(_markdown).rename(columns=_markdown)
        sides = ["left"] * stubs + ["right"] * (len(frame.columns) - stubs)
        parts.append(texts.to_markdown(index=False, disable_numparse=True, colalign=sides))
    return "\n\n".join([*parts, *map(_markdown, notes)]) + "\n"


def _markdown(text: str) -> str:
    r"""Return text with Markdown's special characters escaped.

    >>> _markdown("a|b *c* <d>")
    'a\\|b \\*c\\* \\<d\\>'
    """
    return re.sub(r"([\\`*_{}\[\]<>|#$~])", r"\\\1", text)


def as_html(
    title: str, caption: str, frame: pandas.DataFrame, stubs: int, notes: Sequence[str]
) -> str:
    """Return a table of texts as HTML elements, below a title."""
    rows = [] if frame.empty else [frame.to_html(index=False, border=0)]
    above = [f"<p><strong>{escape(title)}</strong></p>", f"<p>{escape(caption)}</p>"]
    return "\n".join([*above, *rows, *(f"<p>{escape(note)}</p>" for note in notes)]) + "\n"


def as_latex(
    title: str, caption: str, frame: pandas.DataFrame, stubs: int, notes: Sequence[str]
) -> str:
    r"""Return a table of texts as a tabular for the package booktabs; title, caption and notes are
    comments.

    :raises ImportError: jinja2 is missing.
    """
    sides = "l" * stubs + "r" * (len(frame.columns) - stubs)
    rows = frame.to_latex(index=False, escape=True, column_format=sides).rstrip()
    shown = [] if frame.empty else [rows]
    return "\n".join([_comment(title), _comment(caption), *shown, *map(_comment, notes)]) + "\n"


def _comment(text: str) -> str:
    return f"% {' '.join(text.split())}"
