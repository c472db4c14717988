"""Progress of a long step on standard error: a bar on a terminal, occasional plain lines
otherwise.
"""

from __future__ import annotations

import sys
import time
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ballplate.cli.bar import Bar
    from ballplate.simulator.computing.steps import ProgressStep

# Seconds between two lines where there is no terminal.
LINE_INTERVAL = 5.0


@dataclass
class ProgressDisplay:
    """Display of steps in sequence; `what` is counted, and identifies the step."""

    is_quiet: bool = False
    is_verbose: bool = False
    what: str = ""
    done: int = 0
    wanted: int = 0
    started: float = 0.0
    last: float = 0.0
    bar: Bar | None = None

    def show(self, step: ProgressStep) -> None:
        """Report the progress of a step; the remaining time ignores earlier work."""
        if step.what != self.what:
            self.close()
            self.what, self.started, self.last = step.what, time.monotonic(), time.monotonic()
        self.done, self.wanted = step.done, step.wanted
        if self.is_quiet or sys.stderr is None:
            return
        if sys.stderr.isatty():
            self._draw(step)
        elif time.monotonic() - self.last >= LINE_INTERVAL:
            from ballplate.cli.bar import line

            self.last = time.monotonic()
            print(line(step, self.last - self.started), file=sys.stderr, flush=True)

    def _draw(self, step: ProgressStep) -> None:
        # Loaded only where it is seen.
        from ballplate.cli.bar import Bar, width

        if self.bar is None:
            self.bar = Bar(step)
        self.bar.total, self.bar.ncols = step.wanted, width()
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
        """Remove the bar at the end of the step, and print its duration on request."""
        if self.bar is not None:
            self.bar.close()
        if self.is_verbose and self.what:
            elapsed = time.monotonic() - self.started
            print(f"{self.done} of {self.wanted} {self.what}: {elapsed:.3g} s", file=sys.stderr)
        self.what, self.bar = "", None


@contextmanager
def progress(options: Namespace) -> Iterator[ProgressDisplay]:
    """Return the display of a command's steps."""
    shown = ProgressDisplay(options.quiet, options.verbose)
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
