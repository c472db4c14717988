"""A document's published values and ballplate's, as a result."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ballplate.designs import shipped
from ballplate.presentation import Data, Result, aligned, amount_of, number, picked
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.inputs import hint, number_of

from .compare import ComparedValue, compare_section
from .published import Document, npl
from .shipped import Shipped

HEAD = ("table", "quantity", "case", "published", "computed", "ratio", "limits", "agrees", "note")
RIGHT = (False, False, False, True, True, True, True, False, False)


@dataclass(frozen=True, repr=False)
class ReproducedDocument(Result):
    """A document with the comparisons of its sections."""

    document: Document
    sections: dict[str, list[ComparedValue]]

    @property
    def label(self) -> str:
        return "npl"

    @property
    def title(self) -> str:
        return self.document.title

    @property
    def is_right(self) -> bool:
        """Return whether everything agrees within its limits."""
        return all(row.agrees for rows in self.sections.values() for row in rows)

    def headline(self) -> str:
        agrees = "agree" if self.is_right else "do not all agree"
        return f"{number_of(len(self.sections), 'section')}, figures {agrees}"

    # In one piece: the document from its title to its verdict.
    def lines(self) -> list[str]:
        stated, limits = self.document, self.document.limits
        lines = [
            f"{self.title}: published values, and those computed from the shipped designs",
            "Ratios are published over computed values, in µm and µrad; those of U1 to U6 after the"
            " common factor of their column. They agree if they are within"
            f" {100 * limits.figure:g} %, and the factor within {100 * limits.factor:g} %, unless"
            " an exception states other limits.",
            "",
            "Assumptions",
        ]
        lines += [
            f"{assumption.key}: {assumption.text}."
            for assumption in stated.assumptions
            if not assumption.sections or self.sections.keys() & set(assumption.sections)
        ]
        for name, rows in self.sections.items():
            table = aligned([HEAD, *map(_cells, rows)], RIGHT) if rows else ["left out"]
            lines += ["", f"Section {name}", *table]
        rows = [row for section in self.sections.values() for row in section]
        noted = {row.note for row in rows}
        lines += ["", "Exceptions"]
        lines += [
            f"{exception.key}{' (open)' if exception.open else ''}: {exception.reason}."
            for exception in stated.exceptions
            if f"see {exception.key}" in noted
        ] or ["none"]
        tables = {row.table for row in rows}
        lines += [
            f"Not legible in the copy at hand: Table {table}, {what}."
            for table, what in stated.illegible.items()
            if table in tables
        ]
        count = sum(row.agrees for row in rows)
        verdict = (
            "Everything compared agrees within the stated limits"
            if self.is_right
            else "NOT everything compared agrees"
        )
        return [*lines, "", f"{verdict}: {count} of {len(rows)}."]

    def data(self) -> Data:
        stated = self.document
        return {
            "document": self.title,
            "agrees": self.is_right,
            "assumptions": {one.key: one.text for one in stated.assumptions},
            "exceptions": {one.key: picked(one, "reason", "open") for one in stated.exceptions},
            "comparisons": self.rows(),
        }

    def rows(self) -> list[Data]:
        """Return one row per comparison; NaN of what a statement lacks."""
        names = ("table", "quantity", "case", "unit", "published", "computed", "ratio")
        return [
            {
                "section": section,
                **picked(row, *names),
                "least": row.within[0],
                "largest": row.within[1],
                **picked(row, "agrees", "note"),
            }
            for section, rows in self.sections.items()
            for row in rows
        ]


def _cells(row: ComparedValue) -> tuple[str, ...]:
    low, high = row.within
    limits = f"{low:g}" if low == high else f"{low:g} to {high:g}"
    if math.isinf(high):
        limits = f"at least {low:g}"
    return (
        *(row.table, row.quantity, row.case, _shown(row.published, row.unit)),
        *(_shown(row.computed, row.unit), "" if row.factor is None else number(row.ratio, 4)),
        *(limits, "yes" if row.agrees else "NO", row.note),
    )


def _shown(value: float, unit: str) -> str:
    """Return a value in µm or µrad, or without unit; nothing for NaN."""
    if math.isnan(value):
        return ""
    return number(amount_of(value, unit)[0], 5) if unit else f"{value:.4g}"


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
    for name in wanted:
        if name not in document.sections:
            raise ValueError(f'no experiment "{name}"; {hint(name, document.sections)}')
    designs = Shipped(folder or shipped("npl"))
    return ReproducedDocument(
        document,
        {
            name: compare_section(document, designs, name, trials, report)
            for name in document.sections
            if name in (wanted or document.sections)
        },
    )
