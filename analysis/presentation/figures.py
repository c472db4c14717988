"""Figures that show themselves in a notebook with their own drawing parameters."""

from __future__ import annotations

import io
from typing import Any

import matplotlib
from matplotlib.figure import Figure


class Picture(Figure):
    """A figure with its own `settings`; its label is the alternative text."""

    settings: Any

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        with matplotlib.rc_context(self.settings):
            self.savefig(stream, format="png", facecolor="white", dpi=144)
        return stream.getvalue()
