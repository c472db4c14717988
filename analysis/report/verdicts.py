"""What was told of the cells in words: rank, weak directions, flags of Monte Carlo, failures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .results import Results, cell_list, common_values

# Groups that are told in full.
MOST_GROUPS = 40


@dataclass(frozen=True)
class Group:
    """Cells of which the same is told: `heading` in short, `lines` in full."""

    heading: str
    cells: str
    values: str
    count: int
    lines: tuple[str, ...]
    is_surprise: bool = False


@dataclass(frozen=True)
class Groups:
    """Groups in the order of their first cells; `more` are left out."""

    shown: tuple[Group, ...]
    more: int = 0

    @property
    def size(self) -> int:
        """Number of lines."""
        return sum(len(group.lines) for group in self.shown)


# A heading, and the lines that belong to it.
Told = tuple[str, tuple[str, ...]]


def ranks(results: Results) -> Groups:
    """Cells by rank deficiency and by what is undetermined."""
    if "rank_deficiency" not in results.frame:
        return Groups(())
    done = (results.frame["status"] == "done").to_numpy()
    columns = (results.frame[name].to_numpy()[done] for name in ("cell", "rank_deficiency", "as_expected"))
    found: dict[tuple[int, bool, tuple[str, ...]], list[int]] = {}
    for cell, deficiency, expected in zip(*columns, strict=True):
        lines = tuple(results.texts.get(int(cell), {}).get("undetermined", ()))
        found.setdefault((int(deficiency), bool(expected), lines), []).append(int(cell))
    groups = []
    for (deficiency, expected, lines), cells in list(found.items())[:MOST_GROUPS]:
        heading = f"rank deficiency {deficiency}" if deficiency else "full rank"
        groups.append(_group(results, heading + (", as expected" if expected else ", not as expected"), cells, lines))
    return Groups(tuple(groups), max(len(found) - MOST_GROUPS, 0))


def weak(results: Results) -> Groups:
    """Cells by what is weakly determined."""
    found: dict[tuple[str, ...], list[int]] = {}
    for cell, texts in results.texts.items():
        if texts.get("weak"):
            found.setdefault(tuple(texts["weak"]), []).append(cell)
    return _told(results, {(f"{len(lines)} weakly determined", lines): cells for lines, cells in found.items()})


def flags(results: Results) -> Groups:
    """Cells by what Monte Carlo finds different from linear theory, and by why there is no Monte Carlo."""
    found: dict[Told, list[int]] = {}
    for cell, texts in results.texts.items():
        told = [f"{symbol}: {', '.join(names)}" for symbol, names in texts.get("flags", {}).items()]
        if "monte_carlo" in texts:
            told.append(f"no Monte Carlo: {texts['monte_carlo']}")
        if texts.get("not_converged"):
            told.append("data sets that did not converge, and are left out")
        if told:
            found.setdefault(("; ".join(told), ()), []).append(cell)
    return _told(results, found)


def failures(results: Results) -> Groups:
    """Failed cells by reason."""
    found: dict[Told, list[int]] = {}
    failed = results.frame[results.frame["status"] == "failed"]
    for cell, reason in zip(failed["cell"], failed["reason"], strict=True):
        lines = tuple(str(reason).splitlines())
        told: Told = (lines[0] if lines else "failed", ()) if len(lines) < 2 else (f"{len(lines)} errors", lines)
        found.setdefault(told, []).append(int(cell))
    return _told(results, found)


def _told(results: Results, found: Mapping[Told, list[int]]) -> Groups:
    groups = [_group(results, heading, cells, lines) for (heading, lines), cells in list(found.items())[:MOST_GROUPS]]
    return Groups(tuple(groups), max(len(found) - MOST_GROUPS, 0))


def _group(results: Results, heading: str, cells: list[int], lines: tuple[str, ...]) -> Group:
    values = results.label(cells[0]) if len(cells) == 1 else common_values(results, cells)
    return Group(heading, cell_list(cells), values, len(cells), lines, "not as expected" in heading)
