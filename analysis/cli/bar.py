"""The bar of progress on a terminal."""

from __future__ import annotations

import shutil
from threading import RLock

from ballplate.simulator.computing.steps import ProgressStep
from tqdm import tqdm

# Columns below which progress is text alone.
LEAST_WIDTH_OF_BAR = 100


def _form(step: ProgressStep, columns: int | None = None) -> str:
    """Return tqdm's format of a step, for a terminal of some `columns` or for lines."""
    left = "{remaining} left" if step.is_last else "{remaining} left of this step"
    if columns is not None and columns < LEAST_WIDTH_OF_BAR:
        return "{n_fmt}/{total_fmt} {desc}, " + left + "{postfix}"
    text = "{n_fmt}/{total_fmt} {desc}, {elapsed} so far, " + left + "{postfix}"
    return text if columns is None else "|{bar}| " + text


class Bar(tqdm):
    """A bar that neither starts a thread nor makes a lock for other processes, which a command
    would have to end.
    """

    monitor_interval = 0
    _lock = RLock()

    def __init__(self, step: ProgressStep) -> None:
        # Sizes are given, as tqdm draws nothing on a terminal that does not know its own.
        super().__init__(
            desc=step.what,
            total=step.wanted,
            initial=step.before,
            miniters=1,
            leave=False,
            ncols=width(),
            nrows=2,
            bar_format=_form(step, width()),
        )


def width() -> int:
    """Columns of the terminal, less one, as some begin a new line after the last."""
    return shutil.get_terminal_size().columns - 1


def line(step: ProgressStep, elapsed: float) -> str:
    """Return the progress of a step as text alone.

    >>> line(ProgressStep("data sets", 512, 2048, "accurate to 1.5 %"), 20.0)
    '512/2048 data sets, 00:20 so far, 01:00 left, accurate to 1.5 %'
    """
    return tqdm.format_meter(
        step.done,
        step.wanted,
        elapsed,
        prefix=step.what,
        initial=step.before,
        bar_format=_form(step),
        postfix=step.remark or None,
    )
