"""A table, independent of its written forms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Entry:
    """A cell of a table; `value` is its stored number, None for a text."""

    text: str
    value: float | None = None
    cell: int | None = None
    figure: str = ""


@dataclass(frozen=True)
class Row:
    """A row: its headings, then its entries; `texts` are further columns of CSV."""

    headings: tuple[str, ...]
    entries: tuple[Entry, ...]
    texts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Block:
    """A group of rows; `title` is empty in a table without blocks."""

    title: str
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Table:
    """A table.

    `headings` are above row headings, `columns` above entries, `spanner` above all columns; titles
    of blocks are values of `block`.
    """

    name: str
    caption: str
    headings: tuple[str, ...]
    columns: tuple[str, ...]
    blocks: tuple[Block, ...]
    spanner: str = ""
    block: str = ""
    notes: tuple[str, ...] = ()

    @property
    def spanned(self) -> list[str]:
        """Columns, each with the spanner in front."""
        return [f"{self.spanner} {column}".lstrip() for column in self.columns]

    @property
    def size(self) -> int:
        """Number of rows."""
        return sum(len(block.rows) for block in self.blocks)
