"""Designs of a sweep's cases, drawn from what their rows state of them."""

from __future__ import annotations

import json
from collections.abc import Iterable

import numpy as np
from ballplate.extensions.pages.interface import Html, folded, joined, plates_view, still_figure
from ballplate.simulator.inputs import in_one_line, number_of
from ballplate.simulator.machines import Array

from .cases import SweepCases


def drawings(result: SweepCases, rows: Iterable[int]) -> dict[str, list[int]]:
    """Return the drawings of rows that have one, each with its rows."""
    found: dict[str, list[int]] = {}
    if "drawing" in result.table:
        texts = result.table["drawing"]
        for row in rows:
            if result.done[row] and isinstance(texts[row], str) and _read(texts[row]):
                found.setdefault(texts[row], []).append(row)
    return found


def drawn(text: str, *captions: Html) -> Html:
    """Return the figure of a drawing, with its captions and the names of its positions below."""
    volume, positions = _read(text) or (np.zeros((2, 0)), [])
    names = [f"{k + 1}: {name}" for k, (name, _) in enumerate(positions)]
    words = number_of(len(names), "position")
    caption = joined([*captions, folded(words, ", ".join(names))])
    return still_figure(plates_view(*volume, positions, f"{words} in the volume", caption))


def _read(text: str) -> tuple[Array, list[tuple[str, Array]]] | None:
    """Return the corners of the volume (2, d) and the balls (k, d) at the corners of each position,
    by name; None unless a text states them.
    """
    try:
        stated = json.loads(text)
        volume = np.array(stated["volume"], float).T
        positions = [
            (in_one_line(name), np.array(balls, float)) for name, balls in stated["positions"]
        ]
    except (ValueError, TypeError, KeyError, AttributeError):
        return None
    shapes = {balls.shape[1:] for _, balls in positions}
    is_whole = all(np.isfinite(each).all() for each in (volume, *(balls for _, balls in positions)))
    is_drawn = (
        all(len(balls) for _, balls in positions)
        and volume.shape in ((2, 2), (2, 3))
        and shapes == {volume.shape[1:]}
    )
    return (volume, positions) if is_drawn and is_whole else None
