"""The page around the sections: head, list of sections, and style."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib import resources
from importlib.metadata import version

from .elements import Html, element, joined, note


@dataclass(frozen=True)
class PageSection:
    """A section of a page; `name` is its id. One without a body is left out."""

    name: str
    title: str
    body: Html


@dataclass(frozen=True)
class Page:
    """A page: its title, the introduction below it, sections, and foot."""

    title: str
    introduction: Html
    sections: Sequence[PageSection]
    foot: str


@cache
def shipped(name: str) -> str:
    """Return the text of a file in this folder."""
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def written(page: Page) -> str:
    """The page as a file that needs no other and asks no network for anything."""
    sections = [section for section in page.sections if section.body]
    links = joined(
        element("li", element("a", section.title, href=f"#{section.name}")) for section in sections
    )
    top = element(
        "header",
        element("h1", page.title),
        page.introduction,
        element("nav", element("ul", links), aria_label="Sections"),
    )
    body = joined(
        element(
            "section",
            element("h2", section.title, id=section.name),
            section.body,
            aria_labelledby=section.name,
        )
        for section in sections
    )
    parts = [
        element("a", "Skip to the results", class_="skip", href="#main"),
        top,
        element("main", body, id="main"),
        element("footer", element("p", page.foot)),
    ]
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n{_head(page.title)}\n'
        f"{element('body', *parts)}\n</html>\n"
    )


def _head(title: str) -> Html:
    """The head of a page that runs no script."""
    policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
    return element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        Html(f'<meta http-equiv="Content-Security-Policy" content="{policy}">'),
        element("link", rel="icon", href="data:,"),
        element("title", title),
        Html(f"<style>\n{shipped('marks.css')}{shipped('page.css')}</style>"),
    )


def introduction(verdict: Html, is_good: bool, *files: str) -> Html:
    """Return source files, date and version of a page, and its verdict."""
    moment = f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC"
    origin = joined([*filter(None, files), moment, f"ballplate {version('ballplate')}"], " · ")
    kind = "verdict" if is_good else "verdict bad"
    return joined([note(origin), element("div", verdict, class_=kind)])


def facts_list(facts: Sequence[tuple[str, str]]) -> Html:
    """Facts by name."""
    rows = (joined([element("dt", name), element("dd", words)]) for name, words in facts)
    return element("dl", *rows)
