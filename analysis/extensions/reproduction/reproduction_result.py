"""A document's published values and ballplate's, as a result."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ballplate.designs import shipped
from ballplate.presentation import Data, Result
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.inputs import hint, number_of

from .compare import Reproduction, reproduce
from .published import npl
from .reproduction_tables import reproduction_data, reproduction_lines, reproduction_markdown
from .shipped import Shipped


@dataclass(frozen=True, repr=False)
class ReproducedDocument(Result):
    """A document with its comparisons."""

    reproduction: Reproduction

    @property
    def label(self) -> str:
        return "npl"

    @property
    def title(self) -> str:
        return self.reproduction.document.statements.title

    @property
    def is_right(self) -> bool:
        """Return whether everything agrees within its limits."""
        return self.reproduction.agrees

    def headline(self) -> str:
        count = len(self.reproduction.sections)
        agrees = "agree" if self.is_right else "do not all agree"
        return f"{number_of(count, 'section')}, figures {agrees}"

    def lines(self) -> list[str]:
        return reproduction_lines(self.reproduction)

    def data(self) -> Data:
        return reproduction_data(self.reproduction)

    def to_markdown(self) -> str:
        """Return all comparisons in Markdown, with the assumptions of each value."""
        return reproduction_markdown(self.reproduction)

    def rows(self) -> list[Data]:
        """Return one row per published value of the tables."""
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
    """Compute the sections of NPL Report CISE 15/98, by default all, from the designs in a folder
    or the shipped ones.

    :raises ValueError: the report has no such section.
    :raises ExperimentError: a design is missing or has errors.
    """
    document, wanted = npl(), tuple(sections)
    sections_of_document = document.statements.sections
    for name in wanted:
        if name not in sections_of_document:
            raise ValueError(f'no experiment "{name}"; {hint(name, sections_of_document)}')
    designs = Shipped(folder or shipped("npl"))
    return ReproducedDocument(reproduce(document, designs, wanted, trials, report))
