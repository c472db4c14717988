"""Statements on cells: rank, weak directions, Monte Carlo, failures."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from .results import ReportedSweep, cell_list, common_values

# Limits: groups, and lines of each.
MOST_GROUPS, MOST_LINES = 30, 8

# Amounts, in which the statements of one group may differ.
AMOUNT = re.compile(r"(?<![\w.])-?\d+(\.\d+)?(e[-+]?\d+)? ([uµμ](?=(m|rad)\b)|(?=ppm\b))")


@dataclass(frozen=True)
class VerdictGroup:
    """Cells with the same statement, except for amounts: `heading`, and `lines` with `more` left
    out.
    """

    heading: str
    cells: str
    values: str
    count: int
    lines: tuple[str, ...]
    is_surprise: bool = False
    more: int = 0


@dataclass(frozen=True)
class VerdictGroups:
    """Groups in the order of their first cells; `more` are left out."""

    shown: tuple[VerdictGroup, ...]
    more: int = 0

    @property
    def size(self) -> int:
        """Number of lines."""
        return sum(len(group.lines) for group in self.shown)


NOT = "not "

# A heading with its lines.
Statement = tuple[str, tuple[str, ...]]


def ranks(results: ReportedSweep) -> VerdictGroups:
    """Return cells by rank deficiency and undetermined directions."""
    if "rank_deficiency" not in results.frame:
        return VerdictGroups(())
    columns = results.frame[["cell", "rank_deficiency", "as_expected"]][results.done]
    cells_by_statement: dict[Statement, list[int]] = {}
    for cell, deficiency, expected in columns.to_numpy():
        heading = f"rank deficiency {int(deficiency)}" if deficiency else "full rank"
        lines = tuple(results.texts.get(int(cell), {}).get("undetermined", ()))
        cells_by_statement.setdefault(
            (f"{heading}, {'' if expected else NOT}as expected", lines), []
        ).append(int(cell))
    return _grouped(results, cells_by_statement)


def weak(results: ReportedSweep) -> VerdictGroups:
    """Return cells by weakly determined directions."""
    cells_by_statement: dict[Statement, list[int]] = {}
    for cell, texts in results.texts.items():
        if texts.get("weak"):
            lines = tuple(texts["weak"])
            word = "direction" if len(lines) == 1 else "directions"
            cells_by_statement.setdefault(
                (f"{len(lines)} {word} weakly determined", lines), []
            ).append(cell)
    return _grouped(results, cells_by_statement)


def flags(results: ReportedSweep) -> VerdictGroups:
    """Return cells by differences of Monte Carlo from linear theory, or by the reason for its
    absence.
    """
    cells_by_statement: dict[Statement, list[int]] = {}
    for cell, texts in results.texts.items():
        parts = [
            f"{symbol}: {', '.join(names)}" for symbol, names in texts.get("flags", {}).items()
        ]
        if "monte_carlo" in texts:
            parts.append(f"no Monte Carlo: {texts['monte_carlo']}")
        elif texts.get("not_converged"):
            parts.append("data sets that did not converge, and are left out")
        if parts:
            cells_by_statement.setdefault(("; ".join(parts), ()), []).append(cell)
    return _grouped(results, cells_by_statement)


def failures(results: ReportedSweep) -> VerdictGroups:
    """Return failed cells by reason."""
    cells_by_statement: dict[Statement, list[int]] = {}
    failed = results.frame[results.frame["status"] == "failed"]
    for cell, reason in zip(failed["cell"], failed["reason"], strict=True):
        lines = tuple(str(reason).splitlines())
        statement: Statement = (
            (lines[0] if lines else "failed", ())
            if len(lines) < 2
            else (f"{len(lines)} errors", lines)
        )
        cells_by_statement.setdefault(statement, []).append(int(cell))
    return _grouped(results, cells_by_statement)


def _grouped(
    results: ReportedSweep, cells_by_statement: Mapping[Statement, list[int]]
) -> VerdictGroups:
    """Return groups of cells whose statements differ only in amounts."""
    alike: dict[Statement, tuple[Statement, list[int]]] = {}
    for (heading, lines), cells in cells_by_statement.items():
        form = heading, tuple(AMOUNT.sub("", line) for line in lines)
        alike.setdefault(form, ((heading, lines), []))[1].extend(cells)
    shown = list(alike.values())[:MOST_GROUPS]
    groups = [
        _group(results, *statement, sorted(cells), len(cells_by_statement) > len(alike))
        for statement, cells in shown
    ]
    return VerdictGroups(tuple(groups), max(len(alike) - MOST_GROUPS, 0))


def _group(
    results: ReportedSweep,
    heading: str,
    lines: tuple[str, ...],
    cells: list[int],
    with_example: bool,
) -> VerdictGroup:
    values = results.label(cells[0]) if len(cells) == 1 else common_values(results, cells)
    if with_example and lines and len(cells) > 1:
        heading += f", with the amounts of cell {cells[0]}"
    shown, more = lines[:MOST_LINES], max(len(lines) - MOST_LINES, 0)
    return VerdictGroup(
        heading, cell_list(cells), values, len(cells), shown, f"{NOT}as expected" in heading, more
    )
