"""Advice for tables of readings that lack columns."""

from __future__ import annotations

from collections.abc import Sequence

from ballplate.simulator.inputs import listing

from .heading_words import LESS_CLEAR, WORDS, heading, quoted
from .headings import TEXTS, Vocabulary


def missing_columns(cells: Sequence[str], words: Vocabulary, axes: Sequence[str] = ()) -> str:
    """Return advice on all columns that a table lacks: the existing ones, and the entries to write.

    `axes` are co-ordinates that are not all there.
    """
    names = [heading(cell)[0] for cell in cells]
    missing = {
        role
        for role in TEXTS
        if {*WORDS[role], *LESS_CLEAR[role]}.isdisjoint(names)
        and getattr(words.stated, role, None) is None
    }
    needed = [role for role in ("ball",) if role in missing]
    needed += [axis for axis in axes if axis not in " ".join(names).split()] or axes
    # Positions may be named by files, and probes by the plan.
    others = [role for role in ("position", "probe") if role in missing]
    elsewhere = f" (and {listing(others)}, unless stated elsewhere)" if needed and others else ""
    mapping = ", ".join(f"{role}: …" for role in [*needed, *others])
    return (
        f"columns found: {quoted(filter(None, cells), 12) or 'none'}; missing:"
        f" {listing(needed or others)}{elsewhere}; name them in the experiment file: readings:"
        f" {{columns: {{{mapping}}}}}{', or axis: …, value: … of one row per axis' if axes else ''}"
    )
