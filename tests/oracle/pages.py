"""Pages of results: their tables, and their sentences as text."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

VOID = {"br", "col", "hr", "img", "input", "link", "meta", "wbr"}
TEXTS = {"p", "li", "figcaption"}


class _Page(HTMLParser):
    """Collects tables by the id of their caption, and texts."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tables: dict[str, list[list[str]]] = {}
        self.paragraphs: list[str] = []
        self.name = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in VOID:
            return
        self.open.append(tag)
        if tag == "caption":
            self.name = (dict(attrs)["id"] or "").removeprefix("table-")
            self.tables[self.name] = []
        elif tag == "tr":
            self.tables[self.name].append([])
        elif tag in ("th", "td"):
            self.tables[self.name][-1].append("")
        elif tag in TEXTS:
            self.paragraphs.append("")

    def handle_endtag(self, tag: str) -> None:
        while self.open and self.open.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        if not {"script", "style", "svg"}.isdisjoint(self.open):
            return
        if "th" in self.open or "td" in self.open:
            self.tables[self.name][-1][-1] += data
        elif not TEXTS.isdisjoint(self.open) and self.paragraphs:
            self.paragraphs[-1] += data


def page_of(path: Path) -> tuple[dict[str, list[list[str]]], list[str]]:
    """Tables of a page by name, each with its heads, and paragraphs, entries of lists, and captions of pictures."""
    parsed = _Page()
    parsed.feed(path.read_text(encoding="utf-8"))
    return parsed.tables, [re.sub(r"\s+", " ", one).strip() for one in parsed.paragraphs]
