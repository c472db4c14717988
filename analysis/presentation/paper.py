"""Small parts of drawings that are written as SVG within a page."""

from __future__ import annotations

from html import escape

import numpy as np
from ballplate.simulator.inputs.messages import in_one_line
from ballplate.simulator.machines.protocol import Array


def escaped(text: str) -> str:
    """A text within a page, in one line."""
    return escape(in_one_line(text))


def pitch(points: Array) -> float:
    """The least distance between points, of the first few hundred."""
    some = points[:400]
    apart = np.linalg.norm(some[:, None] - some[None], axis=2)
    apart = apart[apart > 1e-9]
    return float(apart.min()) if len(apart) else 1.0


def on_paper(points: Array, lower: Array, scale: float, margin: float, height: float) -> Array:
    """Where points (n, 2) are in a drawing of a height, whose second axis runs downwards, with the
    corner `lower` (2,) at its margins.
    """
    moved = scale * (points - lower)
    return np.column_stack([margin + moved[:, 0], height - margin - moved[:, 1]])
