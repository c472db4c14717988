"""A document's published figures beside ours, as they show themselves."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ballplate.designs import shipped
from ballplate.presentation import Result
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.inputs import hint, number_of

from .compare import Reproduction, reproduce
from .published import npl
from .reproduction_tables import reproduction_data, reproduction_lines, reproduction_markdown
from .shipped import Shipped


@dataclass(frozen=True, repr=False)
class ReproducedDocument(Result):
    """A document with its figures `found` anew."""

    found: Reproduction

    @property
    def label(self) -> str:
        return "npl"

    @property
    def title(self) -> str:
        return self.found.document.statements.title

    @property
    def is_right(self) -> bool:
        """Whether everything agrees within what is stated."""
        return self.found.agrees

    def headline(self) -> str:
        count = len(self.found.sections)
        agrees = "agree" if self.is_right else "do not all agree"
        return f"{number_of(count, 'section')}, figures {agrees}"

    def lines(self) -> list[str]:
        return reproduction_lines(self.found)

    def to_dict(self) -> dict[str, Any]:
        return reproduction_data(self.found)

    def to_markdown(self) -> str:
        """All of it in Markdown, with the assumptions that each figure rests on."""
        return reproduction_markdown(self.found)

    def rows(self) -> list[dict[str, Any]]:
        """One row for each published figure of the tables."""
        names = ("design", "table", "quantity", "statistic", "published", "ours", "ratio")
        return [
            {name: figure[name] for name in (*names, "unit", "agrees")}
            for section in self.to_dict()["sections"]
            for figure in section["figures"]
        ]


def reproduce_npl(
    sections: Iterable[str] = (),
    trials: int | None = 100,
    folder: Path | None = None,
    report: Report = unreported,
) -> ReproducedDocument:
    """NPL Report CISE 15/98 computed anew, all sections if none are named, from the designs in a
    folder or those that come with ballplate; see `compare.reproduce`.

    :raises ValueError: the report has no such section.
    :raises ExperimentError: a design is missing or has errors.
    """
    document, wanted = npl(), tuple(sections)
    known = document.statements.sections
    for name in wanted:
        if name not in known:
            raise ValueError(f'no experiment "{name}"; {hint(name, known)}')
    designs = Shipped(folder or shipped("npl"))
    return ReproducedDocument(reproduce(document, designs, wanted, trials, report))
