"""Statements of a document as data: values, ranks, remarks, errata, and assumptions of a
comparison.
"""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files
from typing import Literal

from ballplate.simulator.inputs import Settings, parse_tree, to_python

SYMBOLS = ("U1", "U2", "U3", "U4", "U5", "U6")
Statistic = Literal["maximum", "average"]
REPEATABILITY = "repeatability"
SUM_OF_SQUARES = "S^2"


class Assumption(Settings):
    """An assumption that the document does not state; for all sections if there are none."""

    key: str
    text: str
    sections: tuple[str, ...] = ()


class Limits(Settings):
    """Limits of agreement: `figure` and `factor` are relative, the others factors."""

    figure: float
    factor: float
    step: float
    sum_of_squares: float
    median: float


class Reservation(Settings):
    """Published values with limits of their own for their ratio, and the reason.

    An `open` one is an unexplained difference.
    """

    key: str
    tables: tuple[str, ...]
    quantities: tuple[str, ...]
    within: tuple[float, float]
    reason: str
    designs: tuple[str, ...] = ()
    statistic: Statistic | None = None
    open: bool = False

    def concerns(self, column: PublishedColumn, quantity: str) -> bool:
        """Return whether it applies to a quantity of a column."""
        return (
            column.table in self.tables
            and quantity in self.quantities
            and column.design in (self.designs or (column.design,))
            and self.statistic in (None, column.statistic)
        )


class Erratum(Settings):
    """A block of a table, the designs in its heading, and those to which its values belong."""

    table: str
    statistics: tuple[Statistic, ...]
    headed: tuple[str, ...]
    meant: tuple[str, ...]
    text: str
    figures_of: str | None = None


class RankStatement(Settings):
    """The rank deficiency of designs: a number, or "some"."""

    section: str
    designs: tuple[str, ...]
    deficiency: int | Literal["some"]


class Remark(Settings):
    """A remark on averages, as limits of their ratios in pairs of designs.

    The quantity `S^2` is the final sum of squares of fits of exact readings.
    """

    section: str
    text: str
    quantities: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    at_least: float | None = None
    at_most: float | None = None


class PublishedIterations(Settings):
    """Step lengths and sums of squares, in square metres with weight 1 for a reading, of
    Gauss-Newton iterations.

    The fit `settles` by the last of them, or not, or is not compared in that respect if None;
    without any value, it settles at all. With a `misfit`, the final sum of squares is not mere
    rounding. Values that are only shown have a reason.
    """

    table: str
    design: str
    settles: bool | None
    steps: tuple[float, ...] = ()
    sums_of_squares: tuple[float, ...] = ()
    misfit: bool = False
    steps_shown_only: tuple[int, ...] = ()
    sums_shown_only: tuple[int, ...] = ()
    reason: str = ""


class Difference(Settings):
    """Root mean square and largest difference, in metres, of distances corrected by two
    estimators.
    """

    design: str
    rms: float
    maximum: float


class PublishedColumn(Settings):
    """One column of a printed table: the legible values of U1 to U6, in metres and radians, of a
    design.
    """

    table: str
    section: str
    design: str
    statistic: Statistic
    figures: dict[str, float]

    @property
    def case(self) -> str:
        return case_of(self.design)


class Document(Settings):
    """A published document: the columns of its tables of uncertainties, and its statements."""

    title: str
    sections: tuple[str, ...]
    columns: tuple[PublishedColumn, ...]
    assumptions: tuple[Assumption, ...]
    limits: Limits
    exceptions: tuple[Reservation, ...]
    errata: tuple[Erratum, ...]
    illegible: dict[str, str]
    ranks: tuple[RankStatement, ...]
    remarks: tuple[Remark, ...]
    convergence: tuple[PublishedIterations, ...]
    differences: tuple[Difference, ...]


def case_of(design: str) -> str:
    """Return the variant of a design, or its file without variants.

    >>> case_of("6.2.1[n=4 NDEL=5]"), case_of("6.2.1")
    ('n=4 NDEL=5', '6.2.1')
    """
    return design.partition("[")[2].removesuffix("]") or design


def section_of(design: str) -> str:
    """Return the section of the document with a design.

    >>> section_of("6.1.1-weights[C w=1]")
    '6.1.1'
    """
    return design.partition("[")[0].partition("-")[0]


@cache
def npl() -> Document:
    """Return NPL Report CISE 15/98, sections 5 and 6: legible values of Tables 1 to 12, and
    statements.
    """
    name = "npl-cise-15-98"
    folder = files(__package__)
    text = folder.joinpath(f"{name}.yaml").read_text(encoding="utf-8")
    columns = [
        {
            **{key: row[key] for key in ("table", "design", "statistic")},
            "section": row["experiment"],
            "figures": {symbol: float(row[symbol]) for symbol in SYMBOLS if row[symbol]},
        }
        for row in csv.DictReader(
            folder.joinpath(f"{name}-tables.csv").read_text(encoding="utf-8").splitlines()
        )
    ]
    stated = to_python(parse_tree(text, f"{name}.yaml"))
    return Document.model_validate({**stated, "columns": tuple(columns)})
