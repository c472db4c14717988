"""Results that show themselves as text, plain data, data frames and in notebooks."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.simulator.inputs.settings import number_of

from .formatting import Data, as_data

if TYPE_CHECKING:
    import pandas
    from ballplate.simulator.readings.observed_readings import ObservedReadings
    from matplotlib.figure import Figure

    from .table_columns import MainTable

# Rows of a table in a notebook.
MOST_ROWS_SHOWN = 60


class Result:
    """A result with a label and a title; data and frames are in metres, radians and ratios."""

    if TYPE_CHECKING:

        @property
        def label(self) -> str: ...

        @property
        def title(self) -> str: ...

    def headline(self) -> str:
        """The result in a few words."""
        raise NotImplementedError

    def lines(self) -> list[str]:
        """The result as lines of text, as the command prints it."""
        raise NotImplementedError

    def data(self) -> Data:
        """The content of `to_dict`, of any objects; NaN if undetermined."""
        raise NotImplementedError

    def to_dict(self) -> Data:
        """The result as plain data, as the command's --json prints it; None if undetermined."""
        return dict(as_data(self.data()))

    @property
    def heading(self) -> str:
        """Label and title."""
        return f"{self.label}: {self.title}"

    @property
    def named(self) -> Data:
        """Label and title as plain data."""
        return {"experiment": self.label, "title": self.title}

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings for users of the result."""
        return ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes below tables: remarks, warnings, reasons for an unexpected result."""
        return tuple(f"warning: {warning}" for warning in self.warnings)

    def rows(self) -> list[Data]:
        """The rows of its main table in metres, radians and ratios, by the names of the columns;
        units have a separate column.
        """
        from .table_columns import table_rows

        columns = self.columns()
        if columns is None:
            raise NotImplementedError
        return table_rows(*columns)

    def columns(self) -> MainTable | None:
        """The columns of its main table, see `presentation.table_columns`, and the items of its
        rows; None if `rows` has them.
        """
        return None

    def _shown_rows(self) -> list[Data]:
        """The rows in the units of text."""
        from .table_columns import table_rows

        columns = self.columns()
        return self.rows() if columns is None else table_rows(*columns, in_units=True)

    def to_frame(self) -> pandas.DataFrame:
        """Its main table as a data frame in the units of its headings or its column "unit"; NaN if
        undetermined.
        """
        import pandas

        return pandas.DataFrame(self._shown_rows())

    def to_markdown(self) -> str:
        """Its main table in Markdown, with label and title above."""
        from .table_columns import as_markdown

        return self._written(as_markdown)

    def to_latex(self) -> str:
        """Its main table as a tabular of LaTeX, which needs the package booktabs."""
        from .table_columns import as_latex

        return self._written(as_latex)

    def to_html(self) -> str:
        """Its main table as elements of a page; a notebook shows its first 60 rows."""
        from .table_columns import as_html

        return self._written(as_html)

    def to_csv(self, path: str | Path | None = None) -> str:
        """Return its main table as CSV with a line of headings, in metres, radians and ratios with
        all digits, and write it to the path, if given; empty cells are undetermined.

        :raises OSError: the file cannot be written.
        """
        import pandas

        from .files import write_file

        frame = pandas.DataFrame(self.rows())
        text = frame.to_csv(index=False, lineterminator="\n")
        if path is not None:
            write_file(path, text.encode())
        return text

    def __str__(self) -> str:
        return "\n".join([*self.lines(), *self.notes])

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.label}: {self.headline()}>"

    def _repr_html_(self) -> str:
        from .table_columns import as_html

        return self._written(as_html, MOST_ROWS_SHOWN)

    def _written(self, form: Callable[..., str], most: int | None = None) -> str:
        """Title, headline, up to `most` rows of the main table, with four digits, the number of
        omitted rows, and notes.
        """
        import pandas

        every = self._shown_rows()
        rows = every[:most]
        names = rows[0] if rows else ()
        # The first columns, of texts alone, head the rows.
        stubs = list(takewhile(lambda name: all(isinstance(row[name], str) for row in rows), names))
        left_out = len(every) - len(rows)
        more = [f"and {left_out} more rows, which to_frame() has"] if left_out else []
        cells = [{name: _shown(value) for name, value in row.items()} for row in rows]
        frame = pandas.DataFrame(cells, dtype=str)
        return form(self.heading, self.headline(), frame, len(stubs), [*more, *self.notes])


class FitResult(Result):
    """The result of an estimator, with notes on the readings."""

    if TYPE_CHECKING:

        @property
        def observed(self) -> ObservedReadings: ...

    @property
    def converged(self) -> bool:
        """Whether an estimate exists."""
        return True

    @property
    def cautions(self) -> tuple[str, ...]:
        """Warnings about the estimate."""
        return ()

    @property
    def complaint(self) -> str:
        """Reason why the estimate is unusable or parameters are undetermined; may be empty."""
        return ""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Notes on differences between readings and plan."""
        return self.observed.remarks

    @property
    def warnings(self) -> tuple[str, ...]:
        """Doubts about the readings, and the cautions."""
        return (*self.observed.doubts, *self.cautions)

    @property
    def notes(self) -> tuple[str, ...]:
        return (*self.remarks, *super().notes, *filter(None, [self.complaint]))

    def notes_data(self) -> Data:
        """Notes, warnings and failure reason as plain data."""
        return {
            "planned_but_not_read": self.observed.missing,
            "read_but_not_planned": self.observed.unplanned,
            "warnings": self.warnings,
            "complaint": self.complaint or None,
        }

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw the residuals as magnified vectors at the balls, and write the picture to the path,
        if given: a name in .svg, .png or .pdf.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: another suffix, or no residuals.
        """
        raise ValueError("residuals are drawn by the full estimator and reversal only")

    def report(self, path: str | Path) -> None:
        """Write the result as a self-contained page of HTML.

        :raises ValueError: it is not of the full estimator.
        :raises OSError: the file cannot be written.
        """
        raise ValueError("a page is written of fits by the full estimator only")

    def __repr__(self) -> str:
        count = len(self.warnings)
        words = f"; {number_of(count, 'warning')}>" if count else ">"
        return super().__repr__().removesuffix(">") + words


def _shown(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return "undetermined" if math.isnan(value) else f"{value:.4g}"
    return ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
