"""Statements on cells: rank, weak directions, Monte Carlo, failures."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ballplate.simulator.inputs import number_of

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
Form = tuple[str, tuple[str, ...]]


def ranks(results: ReportedSweep) -> VerdictGroups:
    """Return cells by rank deficiency and undetermined directions."""
    if "rank_deficiency" not in results.frame:
        return VerdictGroups(())
    columns = results.frame[["cell", "rank_deficiency", "as_expected"]][results.done]
    statements = []
    for cell, deficiency, expected in columns.to_numpy():
        rank = f"rank deficiency {int(deficiency)}" if deficiency else "full rank"
        lines = results.texts.get(int(cell), {}).get("undetermined", ())
        statements.append((f"{rank}, {'' if expected else NOT}as expected", lines, int(cell)))
    return _grouped(results, statements)


def weak(results: ReportedSweep) -> VerdictGroups:
    """Return cells by weakly determined directions."""
    return _grouped(
        results,
        [
            (f"{number_of(len(texts['weak']), 'direction')} weakly determined", texts["weak"], cell)
            for cell, texts in results.texts.items()
            if texts.get("weak")
        ],
    )


def flags(results: ReportedSweep) -> VerdictGroups:
    """Return cells by differences of Monte Carlo from linear theory, or by why it is absent."""
    statements = []
    for cell, texts in results.texts.items():
        parts = [
            f"{symbol}: {', '.join(names)}" for symbol, names in texts.get("flags", {}).items()
        ]
        if "monte_carlo" in texts:
            parts.append(f"no Monte Carlo: {texts['monte_carlo']}")
        elif texts.get("not_converged"):
            parts.append("data sets that did not converge, and are left out")
        if parts:
            statements.append(("; ".join(parts), (), cell))
    return _grouped(results, statements)


def failures(results: ReportedSweep) -> VerdictGroups:
    """Return failed cells by reason."""
    statements: list[tuple[str, list[str], int]] = []
    failed = results.frame[results.frame["status"] == "failed"]
    for cell, reason in zip(failed["cell"], failed["reason"], strict=True):
        lines = str(reason).splitlines() or ["failed"]
        heading, *lines = lines if len(lines) == 1 else [f"{len(lines)} errors", *lines]
        statements.append((heading, lines, int(cell)))
    return _grouped(results, statements)


def _grouped(
    results: ReportedSweep, statements: Iterable[tuple[str, Sequence[str], int]]
) -> VerdictGroups:
    """Return groups of cells whose headings agree, and whose lines differ only in amounts."""
    texts: dict[Form, set[Form]] = {}
    firsts: dict[Form, tuple[Form, list[int]]] = {}
    for heading, lines, cell in statements:
        text = heading, tuple(lines)
        form = heading, tuple(AMOUNT.sub("", line) for line in lines)
        texts.setdefault(form, set()).add(text)
        firsts.setdefault(form, (text, []))[1].append(cell)
    differ = any(len(variants) > 1 for variants in texts.values())
    groups = [
        _group(results, *text, sorted(cells), differ)
        for text, cells in list(firsts.values())[:MOST_GROUPS]
    ]
    return VerdictGroups(tuple(groups), max(len(firsts) - MOST_GROUPS, 0))


def _group(
    results: ReportedSweep,
    heading: str,
    lines: tuple[str, ...],
    cells: list[int],
    with_example: bool,
) -> VerdictGroup:
    values = results.label(cells[0]) if len(cells) == 1 else common_values(results, cells)
    if with_example and lines and len(cells) > 1:
        heading += f", with the values of case {cells[0]}"
    shown, more = lines[:MOST_LINES], max(len(lines) - MOST_LINES, 0)
    return VerdictGroup(
        heading, cell_list(cells), values, len(cells), shown, f"{NOT}as expected" in heading, more
    )
