"""A table before any of the forms that it is written in."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Entry:
    """A place in a table; `value` is the figure of the cell as it is stored, None where a text
    stands alone.
    """

    text: str
    value: float | None = None
    cell: int | None = None
    figure: str = ""


@dataclass(frozen=True)
class Row:
    """A row: what it is about, then its entries."""

    headings: tuple[str, ...]
    entries: tuple[Entry, ...]


@dataclass(frozen=True)
class Block:
    """Rows that belong together; `title` is empty where a table has no blocks."""

    title: str
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Table:
    """A table.

    `headings` stand above what rows are about, `columns` above the entries, `spanner` above all of
    these, and `block` says what the blocks' titles are values of.
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
    def size(self) -> int:
        """Number of rows."""
        return sum(len(block.rows) for block in self.blocks)
