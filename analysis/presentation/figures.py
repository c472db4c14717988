"""Figures that show themselves in a notebook, whatever has been set up there for drawing."""

from __future__ import annotations

import io
from typing import Any

import matplotlib
from matplotlib.figure import Figure


class Picture(Figure):
    """A figure of `settings` of its own; the words for those who do not see it are its label."""

    settings: Any

    def _repr_png_(self) -> bytes:
        found = io.BytesIO()
        with matplotlib.rc_context(self.settings):
            self.savefig(found, format="png", facecolor="white", dpi=144)
        return found.getvalue()
