"""Statements on cells: rank, weak directions, flags of Monte Carlo, failures."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from .results import ReportedSweep, cell_list, common_values

# Groups that are told, and lines of each.
MOST_GROUPS, MOST_LINES = 30, 8

# Amounts, by which alone cells of a sweep may differ in what is told of them.
AMOUNT = re.compile(r"(?<![\w.])-?\d+(\.\d+)?(e[-+]?\d+)? ([uµμ](?=(m|rad)\b)|(?=ppm\b))")


@dataclass(frozen=True)
class VerdictGroup:
    """Cells of which the same is told, but for amounts: `heading` in short, `lines` in full, less
    `more` of them.
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

# A heading, and the lines that belong to it.
Told = tuple[str, tuple[str, ...]]


def ranks(results: ReportedSweep) -> VerdictGroups:
    """Cells by rank deficiency and by what is undetermined."""
    if "rank_deficiency" not in results.frame:
        return VerdictGroups(())
    done = results.done
    columns = (
        results.frame[name].to_numpy()[done] for name in ("cell", "rank_deficiency", "as_expected")
    )
    found: dict[Told, list[int]] = {}
    for cell, deficiency, expected in zip(*columns, strict=True):
        heading = f"rank deficiency {int(deficiency)}" if deficiency else "full rank"
        lines = tuple(results.texts.get(int(cell), {}).get("undetermined", ()))
        found.setdefault((f"{heading}, {'' if expected else NOT}as expected", lines), []).append(
            int(cell)
        )
    return _told(results, found)


def weak(results: ReportedSweep) -> VerdictGroups:
    """Cells by what is weakly determined."""
    found: dict[Told, list[int]] = {}
    for cell, texts in results.texts.items():
        if texts.get("weak"):
            lines = tuple(texts["weak"])
            word = "direction" if len(lines) == 1 else "directions"
            found.setdefault((f"{len(lines)} {word} weakly determined", lines), []).append(cell)
    return _told(results, found)


def flags(results: ReportedSweep) -> VerdictGroups:
    """Cells by what Monte Carlo finds different from linear theory, and by why there is no Monte
    Carlo.
    """
    found: dict[Told, list[int]] = {}
    for cell, texts in results.texts.items():
        told = [f"{symbol}: {', '.join(names)}" for symbol, names in texts.get("flags", {}).items()]
        if "monte_carlo" in texts:
            told.append(f"no Monte Carlo: {texts['monte_carlo']}")
        elif texts.get("not_converged"):
            told.append("data sets that did not converge, and are left out")
        if told:
            found.setdefault(("; ".join(told), ()), []).append(cell)
    return _told(results, found)


def failures(results: ReportedSweep) -> VerdictGroups:
    """Failed cells by reason."""
    found: dict[Told, list[int]] = {}
    failed = results.frame[results.frame["status"] == "failed"]
    for cell, reason in zip(failed["cell"], failed["reason"], strict=True):
        lines = tuple(str(reason).splitlines())
        told: Told = (
            (lines[0] if lines else "failed", ())
            if len(lines) < 2
            else (f"{len(lines)} errors", lines)
        )
        found.setdefault(told, []).append(int(cell))
    return _told(results, found)


def _told(results: ReportedSweep, found: Mapping[Told, list[int]]) -> VerdictGroups:
    """Groups of cells of which the same is told, those together that differ in amounts only."""
    alike: dict[Told, tuple[Told, list[int]]] = {}
    for (heading, lines), cells in found.items():
        form = heading, tuple(AMOUNT.sub("", line) for line in lines)
        alike.setdefault(form, ((heading, lines), []))[1].extend(cells)
    some = list(alike.values())[:MOST_GROUPS]
    groups = [
        _group(results, *told, sorted(cells), len(found) > len(alike)) for told, cells in some
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
