"""A sweep of a store as a result: text, tables, data frame and page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ballplate.presentation import Data, MainTable, Result, picked, table_lines

from .answer import answer
from .cases import IN_TEXT, MOST_ROWS, SweepCases, columns_of

if TYPE_CHECKING:
    from pathlib import Path

    import pandas
    import xarray
    from matplotlib.figure import Figure


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
        table = self.to_frame().astype(object)
        return [
            {str(k): v for k, v in row.items()}
            for row in table.where(table.notna(), None).to_dict("records")
        ]

    def columns(self) -> MainTable:
        return columns_of(self, range(len(self.table))), range(len(self.table))

    def to_frame(self) -> pandas.DataFrame:
        return self.table.drop(columns="drawing", errors="ignore")

    def to_xarray(self) -> xarray.Dataset:
        """The table with a dimension for each axis, in metres, radians or texts as in `to_frame`;
        NaN where a case is missing.

        :raises ImportError: xarray is missing.
        """
        axes = self.definition["axes"]
        every = {axis["column"]: axis["values" if axis["unit"] else "labels"] for axis in axes}
        try:
            return self.to_frame().set_index(list(every)).to_xarray().reindex(every)
        except ImportError as error:
            text = "this needs xarray; install it with: python -m pip install 'ballplate[xarray]'"
            raise ImportError(text, name="xarray") from error

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw the average that cases are judged by against hours, or else along each axis.

        With a path, which ends in .svg, .png or .pdf, the picture is written as well.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path has another suffix, or no averages can be compared.
        """
        from .sweep_plot import draw_sweep

        return draw_sweep(self, path)
