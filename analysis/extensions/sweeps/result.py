"""A sweep of a store as a result: text, tables, data frame and page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ballplate.presentation import Data, MainTable, Result, picked, table_lines

from .answer import answer
from .cases import IN_TEXT, MOST_ROWS, SweepCases, columns_of

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, repr=False)
class SweepResult(SweepCases, Result):
    """A sweep as computed so far: a row of the store for each case.

    `number` is the sweep's in its store and `definition` its content there; `shortcomings` are
    reasons of failed cases and differences of versions.
    """

    @property
    def notes(self) -> tuple[str, ...]:
        return self.shortcomings

    def page_text(self) -> str:
        """Return the sweep's page."""
        from .sweep_page import sweep_page

        return sweep_page(self)

    def lines(self) -> list[str]:
        found, rows = answer(self), range(len(self.table))
        lines = [self.heading, self.headline(), *(found.sentences if found else ())]
        shown: Sequence[int] = rows[:MOST_ROWS]
        if found and len(rows) > MOST_ROWS:
            shown = found.best
            lines.append(f"The best cases of {len(rows)}; --export has all:")
        return [*lines, "", *table_lines(columns_of(self, shown, IN_TEXT))]

    def data(self) -> Data:
        return {
            "sweep": self.label,
            "title": self.title,
            "store": None if self.store is None else str(self.store),
            **picked(self.summary, "cells", "done", "failed", "left"),
            "shortcomings": self.shortcomings,
            "rows": self.rows(),
        }

    def rows(self) -> list[Data]:
        """Return one mapping per case, with its axes' values and its results; None for missing
        ones.
        """
        table = self.table.astype(object)
        return [
            {str(k): v for k, v in row.items()}
            for row in table.where(table.notna(), None).to_dict("records")
        ]

    def columns(self) -> MainTable:
        return columns_of(self, range(len(self.table))), range(len(self.table))

    def to_frame(self) -> pandas.DataFrame:
        return self.table
