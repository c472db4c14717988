"""Results that show themselves: as text, as plain data, as a data frame, and in a notebook."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from .formats import as_html, as_latex, as_markdown
from .table import Block, Entry, Row, Table

if TYPE_CHECKING:
    import pandas


class Result:
    """A result with a label and a title. Numbers in data and frames are in metres, radians and
    ratios.
    """

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

    def to_dict(self) -> dict[str, Any]:
        """The result as plain data, as the command's --json prints it; what is undetermined is
        None.
        """
        raise NotImplementedError

    def rows(self) -> list[dict[str, Any]]:
        """The rows of its main table, by the names of the columns; units have a column of their
        own.
        """
        raise NotImplementedError

    def to_frame(self) -> pandas.DataFrame:
        """Its main table as a data frame; what is undetermined is NaN."""
        import pandas

        return pandas.DataFrame(self.rows())

    def to_markdown(self) -> str:
        """Its main table in Markdown, with label and title above."""
        return self._written(as_markdown)

    def to_latex(self) -> str:
        """Its main table in LaTeX, as a table environment that needs no package."""
        return self._written(as_latex)

    def to_html(self) -> str:
        """Its main table as elements of a page, as a notebook shows it."""
        return self._written(as_html)

    def to_csv(self) -> str:
        """Its main table as CSV with a line of headings, with all digits; what is undetermined is
        empty.
        """
        return self.to_frame().to_csv(index=False)

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.label}: {self.headline()}>"

    def _repr_html_(self) -> str:
        return self.to_html()

    def _written(self, form: Callable[[str, Sequence[Table]], str]) -> str:
        """Title and main table in a form, with four digits; without any row, the result in a few
        words.
        """
        rows, title = self.rows(), f"{self.label}: {self.title}"
        if not rows:
            return form(f"{title}: {self.headline()}", [])
        names = list(rows[0])
        are_text = [all(isinstance(row[name], str) for row in rows) for name in names]
        left = are_text.index(False) if False in are_text else len(names)
        texts = [tuple(_shown(row[name]) for name in names) for row in rows]
        block = Block(
            "", tuple(Row(row[:left], tuple(Entry(text) for text in row[left:])) for row in texts)
        )
        return form(
            title, [Table("", self.headline(), tuple(names[:left]), tuple(names[left:]), (block,))]
        )


def _shown(value: Any) -> str:
    """A value in a table that is shown."""
    if value is None:
        return ""
    if isinstance(value, float):
        return "undetermined" if math.isnan(value) else f"{value:.4g}"
    return ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
