"""Progress of a long step: a bar on a terminal's standard error."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ballplate.simulator.computing.steps import ProgressStep


class ProgressDisplay:
    """Bars of steps in sequence, on a terminal only and not if `is_quiet`."""

    def __init__(self, is_quiet: bool) -> None:
        self.is_shown = not is_quiet and sys.stderr.isatty()
        self.bar: Any = None

    def show(self, step: ProgressStep) -> None:
        """Report the progress of a step."""
        if not self.is_shown:
            return
        if self.bar is None or self.bar.desc != step.what:
            self.close()
            self.bar = _bar(step)
        self.bar.total = step.wanted
        self.bar.set_postfix_str(step.remark, refresh=False)
        self.bar.update(step.done - self.bar.n)
        if step.done == step.wanted:
            # However soon after the one before.
            self.bar.refresh()

    def step_aside(self) -> None:
        """Take the bar away while something else is printed; the next report brings it back."""
        if self.bar is not None:
            self.bar.clear()

    def close(self) -> None:
        """Remove the bar at the end of the step."""
        if self.bar is not None:
            self.bar.close()


def _bar(step: ProgressStep) -> Any:
    # Loaded only where it is seen, without a thread and a lock that a command would have to end.
    from threading import RLock

    from tqdm import tqdm

    tqdm.monitor_interval = 0
    tqdm.set_lock(RLock())
    return tqdm(desc=step.what, total=step.wanted, initial=step.before, miniters=1, leave=False)


@contextmanager
def progress(options: Namespace) -> Iterator[ProgressDisplay]:
    """Return the display of a command's steps."""
    shown = ProgressDisplay(options.quiet)
    try:
        yield shown
    finally:
        shown.close()


def duration(seconds: float) -> str:
    """A time to wait as text.

    >>> duration(3.2), duration(200), duration(9000)
    ('3 s', '3 min 20 s', '2 h 30 min')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
