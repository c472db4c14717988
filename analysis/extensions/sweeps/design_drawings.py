"""Designs of a sweep's cases, drawn from what their rows state of them."""

from __future__ import annotations

import json
from collections.abc import Iterable

import numpy as np
from ballplate.extensions.pages.interface import Html, folded, joined, plates_view, still_figure
from ballplate.simulator.inputs import number_of

from .cases import SweepCases


def drawings(result: SweepCases, rows: Iterable[int]) -> dict[str, list[int]]:
    """Return the drawings of the rows that have one, each with its rows."""
    texts = result.table.reindex(columns=["drawing"], fill_value="")["drawing"].iloc[list(rows)]
    return {text: list(of.index) for text, of in texts.groupby(texts, sort=False) if text}


def drawn(text: str, *captions: Html) -> Html:
    """Return the figure of a drawing, with captions and the names of its positions below."""
    stated = json.loads(text)
    lower, upper = np.array(stated["volume"], float).T
    positions = [(name, np.array(balls, float)) for name, balls in stated["positions"]]
    words = number_of(len(positions), "position")
    names = (f"{k}: {name}" for k, (name, _) in enumerate(positions, 1))
    caption = joined([*captions, folded(words, ", ".join(names))])
    return still_figure(plates_view(lower, upper, positions, f"{words} in the volume", caption))
