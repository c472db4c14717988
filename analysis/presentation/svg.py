"""Reproducible SVG drawings for pages, in the page's colours."""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.simulator.inputs.arguments import ensure_path
from ballplate.simulator.inputs.messages import in_one_line
from ballplate.simulator.inputs.number_arrays import Array

from .files import write_file

if TYPE_CHECKING:
    from ballplate.simulator.inputs.number_arrays import Array
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Placeholders that the page's colours replace, so that drawings follow its light and dark schemes.
INK, MUTED, PAPER = "#010203", "#808182", "#fdfcfb"
SERIES = ("#0a72b1", "#d55e01", "#019e74", "#cc79a8", "#e69f02", "#57b4e8")
# Redundant to colour, for readers who cannot distinguish colours.
DASHES = ("-", "--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (8, 3)))
MARKERS = ("o", "s", "^", "D", "v", "P")

# Width of a drawing in points: small enough for a telephone with its text still readable.
WIDTH = 360.0

SETTINGS: Any = {
    "svg.hashsalt": "ballplate",
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 10.0,
    "axes.labelsize": 10.0,
    "axes.titlesize": 10.5,
    "xtick.labelsize": 9.5,
    "ytick.labelsize": 9.5,
    "legend.fontsize": 9.5,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "grid.color": MUTED,
    "grid.alpha": 0.35,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.5,
    "lines.markersize": 5.0,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "path.simplify": False,
    "hatch.color": MUTED,
    "axes.unicode_minus": True,
}


def round_number(value: float) -> float:
    """Return the largest of …, 0.1, 0.2, 0.5, 1, 2, 5, 10, … up to a positive value.

    >>> round_number(730.0), round_number(0.0021), round_number(1e6)
    (500.0, 0.002, 1000000.0)
    """
    power = 10.0 ** math.floor(math.log10(value) + 1e-12)
    return power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9))


@contextmanager
def drawing(height: float, width: float = WIDTH) -> Iterator[Figure]:
    """Yield a figure of a size in points, for axes placed by hand, which takes half the time of an
    automatic layout.

    :raises ImportError: matplotlib is missing; the text has the command that installs it.
    """
    try:
        import matplotlib
    except ImportError as error:
        text = (
            "pictures need matplotlib; install it with: python -m pip install 'ballplate[report]'"
        )
        raise ImportError(text, name="matplotlib") from error
    # A user's own settings must not change the page.
    with matplotlib.rc_context(), warnings.catch_warnings():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(SETTINGS)
        # Letters that the measuring font lacks are drawn by the reader's.
        warnings.filterwarnings("ignore", message="Glyph .* missing")
        figure = _picture()(figsize=(width / 72.0, height / 72.0), facecolor="none")
        figure.settings = SETTINGS
        yield figure


@cache
def _picture() -> Any:
    """The class of figures that show themselves in a notebook with their own `settings`; their
    label is the alternative text.
    """
    import matplotlib
    from matplotlib.figure import Figure

    class Picture(Figure):
        settings: Any

        def _repr_png_(self) -> bytes:
            stream = io.BytesIO()
            with matplotlib.rc_context(self.settings):
                self.savefig(stream, format="png", facecolor="white", dpi=144)
            return stream.getvalue()

    return Picture


def placed_axes(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Return axes at a location in points."""
    w, h = 72.0 * figure.get_size_inches()
    return figure.add_axes((left / w, bottom / h, width / w, height / h))


def blank_axes(figure: Figure) -> Axes:
    """Return axes of the whole figure, with equal scales, no frame, ticks and background."""
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_aspect("equal")
    return axes


def sticks(axes: Axes, starts: Array, tips: Array, **style: Any) -> None:
    """Draw lines from starts to tips (m, 2), each with a marker at its start."""
    ends = np.stack([starts, tips, np.full_like(starts, np.nan)], axis=1)
    axes.plot(*ends.reshape(-1, 2).T, markevery=3, **style)


def scale_bar(axes: Axes, length: float, height: float, text: str) -> None:
    """Draw a bar of a length along x at the left of axes, with its meaning; its height is a share
    of theirs.
    """
    lower, upper = axes.get_xlim()
    x = lower + 0.05 * (upper - lower)
    style: Any = {"transform": axes.get_xaxis_transform(), "clip_on": False}
    axes.plot([x, x + length], [height, height], color=INK, linewidth=2.5, **style)
    axes.text(x + length + 0.02 * (upper - lower), height, text, va="center", **style)


def legend_above(axes: Axes, columns: int) -> None:
    """Draw a legend in columns above axes."""
    axes.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        borderaxespad=0.3,
        borderpad=0.2,
        columnspacing=1.2,
        handlelength=2.0,
        handletextpad=0.5,
    )


def common_legend(figure: Figure, axes: Axes, **more: Any) -> None:
    """Draw a legend of the figure for the contents of some axes."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, **more)


PICTURES = (".svg", ".png", ".pdf")


def save(figure: Figure, path: str | Path | None, words: str) -> Figure:
    """Write the figure to a file in the format of its suffix, with alternative text, and return it
    with the text as its label; without a path nothing is written.

    The background is white and text is outlines; the same figure gives the same bytes.

    :raises ValueError: the suffix is not in `PICTURES`.
    :raises OSError: the file cannot be written.
    """
    import matplotlib

    figure.set_label(words)
    if path is None:
        return figure
    ensure_path("path", path)
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in PICTURES:
        raise ValueError(f"{path} should end in one of {', '.join(PICTURES)}")
    metadata = {"Title": words, "Creator": None}
    if kind == ".svg":
        metadata["Date"] = None
    elif kind == ".pdf":
        metadata |= {"CreationDate": None, "Producer": None}
    else:
        metadata = {"Title": words, "Software": None}
    with matplotlib.rc_context({"svg.fonttype": "path"}):
        # Into memory first: if a disk is full, errors of the compression would hide that of the
        # file.
        whole = io.BytesIO()
        figure.savefig(whole, format=kind[1:], facecolor="white", dpi=200, metadata=metadata)
    write_file(path, whole.getvalue())
    return figure


def escaped(text: str) -> str:
    """Return a text for HTML, in one line."""
    return escape(in_one_line(text))
