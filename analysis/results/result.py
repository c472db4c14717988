"""Results that show themselves: as text, as plain data, as a data frame, and in a notebook."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas


class Result:
    """A result with a label and a title. Numbers in data and frames are in metres, radians and ratios."""

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
        """The result as plain data, as the command's --json prints it; what is undetermined is None."""
        raise NotImplementedError

    def rows(self) -> list[dict[str, Any]]:
        """The rows of its main table, by the names of the columns; units have a column of their own."""
        raise NotImplementedError

    def to_frame(self) -> pandas.DataFrame:
        """Its main table as a data frame; what is undetermined is NaN."""
        import pandas

        return pandas.DataFrame(self.rows())

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.label}: {self.headline()}>"

    def _repr_html_(self) -> str:
        table = self.to_frame().to_html(index=False, na_rep="undetermined", float_format="{:.4g}".format, border=0)
        return f"<p><strong>{escape(self.label)}: {escape(self.title)}</strong><br>{escape(self.headline())}</p>{table}"
