"""Elements of SVG drawings within a page."""

from __future__ import annotations

from html import escape

import numpy as np
from ballplate.simulator.inputs.messages import in_one_line
from ballplate.simulator.machines.protocol import Array


def escaped(text: str) -> str:
    """Return a text for HTML, in one line."""
    return escape(in_one_line(text))


def on_paper(points: Array, lower: Array, scale: float, margin: float, height: float) -> Array:
    """Return points (n, 2) in a drawing of a `height`, whose second axis runs downwards, with the
    corner `lower` (2,) at its margins.
    """
    moved = scale * (points - lower)
    return np.column_stack([margin + moved[:, 0], height - margin - moved[:, 1]])
