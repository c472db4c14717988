"""Elements of a page: texts are escaped, HTML is marked as such."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape

from ballplate.simulator.inputs import in_one_line

# A table with more columns is printed on a page of its own, across.
MOST_COLUMNS = 11


class Html(str):
    """A text that is HTML already."""

    __slots__ = ()


def as_html(content: str) -> Html:
    """Return HTML unchanged, and any other text in one line with its special characters escaped.

    >>> as_html("a < b"), as_html(Html("<b>"))
    ('a &lt; b', '<b>')
    """
    return content if isinstance(content, Html) else Html(escape(in_one_line(content)))


def joined(parts: Iterable[str], between: str = "") -> Html:
    """Parts behind one another, with a text between them."""
    return Html(as_html(between).join(map(as_html, parts)))


def element(tag: str, *content: str, **attributes: str | float | bool | None) -> Html:
    """Return an element of a page.

    A name of an attribute may end in an underscore, and its other underscores become hyphens.
    Attributes that are None or False are omitted.

    >>> element("p", "a < b", element("br"), class_="note", data_path="/a", hidden=False)
    '<p class="note" data-path="/a">a &lt; b<br></p>'
    """
    written = [tag]
    for key, value in attributes.items():
        name = key.removesuffix("_").replace("_", "-")
        if value is True:
            written.append(name)
        elif value is not None and value is not False:
            written.append(f'{name}="{escape(in_one_line(str(value)))}"')
    start = f"<{' '.join(written)}>"
    if tag in ("br", "img", "input", "link", "meta"):
        return Html(start)
    return Html(f"{start}{joined(content)}</{tag}>")


def sentence(*parts: str) -> Html:
    """A paragraph."""
    return element("p", *parts)


def note(*parts: str) -> Html:
    """Return a paragraph in small letters, below its subject."""
    return element("p", *parts, class_="note")


def table(
    name: str,
    caption: str,
    heads: Sequence[str],
    rows: Iterable[Iterable[str]],
    words: Iterable[int] = (0,),
    is_long: bool = False,
) -> Html:
    """Return a table; the columns `words` are texts, all others numbers.

    `name` is an id, unique on the page; a table that `is_long` scrolls separately on screens.

    >>> [table("a", "", [""] * count, []).split('"')[1] for count in (11, 12)]
    ['scroll', 'scroll wide']
    """
    texts = set(words)
    head = joined(
        element("th", cell, scope="col", class_="words" if k in texts else None)
        for k, cell in enumerate(heads)
    )
    body = joined(
        element(
            "tr",
            *(
                element("th", cell, scope="row", class_=_width(cell) or None)
                if k == 0
                else element(
                    "td", cell, class_=f"words {_width(cell)}".strip() if k in texts else None
                )
                for k, cell in enumerate(row)
            ),
        )
        for row in rows
    )
    kind = "scroll high" if is_long else "scroll"
    kind += " wide" if len(heads) > MOST_COLUMNS else ""
    parts = element("thead", element("tr", head), class_="tall"), element("tbody", body)
    return scrolling(f"table-{name}", caption, *parts, kind=kind, class_="tight")


def scrolling(
    name: str, caption: str, *parts: str, kind: str = "scroll", class_: str | None = None
) -> Html:
    """Return a table that scrolls where it is wide; `name` is the id of its caption."""
    inner = element("table", element("caption", caption, id=name), *parts, class_=class_)
    return element("div", inner, class_=kind, role="region", tabindex="0", aria_labelledby=name)


def _width(content: str) -> str:
    """Return the class of a long text, which may wrap.

    >>> _width("a" * 41), _width("a" * 40), _width(Html(f"<b>{'a' * 16}</b>"))
    ('long', 'some', '')
    """
    shown = len(re.sub("<[^>]*>", "", content) if isinstance(content, Html) else content)
    return "long" if shown > 40 else "some" if shown > 16 else ""


def folded(summary: str, *content: str, is_open: bool = False) -> Html:
    """Return content shown on demand, and in print."""
    return element("details", element("summary", summary), *content, open=is_open)
