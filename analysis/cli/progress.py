"""How far a long run has come, on standard error: a bar on a terminal, plain lines now and then elsewhere."""

from __future__ import annotations

import shutil
import sys
import time
from dataclasses import dataclass, field

# Seconds between two reports.
OFTEN, SELDOM = 0.1, 5.0


@dataclass
class ProgressBar:
    """Reports work done of work wanted, with rate and time left. `what` is counted."""

    what: str
    started: float = field(default_factory=time.monotonic)
    last: float = field(default_factory=time.monotonic)
    drawn: bool = False

    def show(self, done: int, wanted: int, remark: str = "", before: int = 0) -> None:
        """Report, unless the last report is recent; the rate leaves out what was done `before`."""
        if sys.stderr is None:
            return
        now = time.monotonic()
        is_terminal = sys.stderr.isatty()
        due = now - self.last >= (OFTEN if is_terminal else SELDOM)
        if not due:
            return
        self.last = now
        rate = (done - before) / max(now - self.started, 1e-9)
        left = duration((wanted - done) / rate) if done > before else "?"
        text = f"{done}/{wanted} {self.what}, {rate:.3g}/s, {left} left{f', {remark}' if remark else ''}"
        if not is_terminal:
            print(text, file=sys.stderr, flush=True)
            return
        room = shutil.get_terminal_size().columns - len(text) - 4
        if room >= 5:
            filled = round(room * min(done / max(wanted, 1), 1.0))
            text = f"[{'#' * filled}{'.' * (room - filled)}] {text}"
        width = shutil.get_terminal_size().columns - 1
        # Blanks over what was there: not every console of Windows knows a sequence that clears the line.
        print(f"\r{text[:width]:<{width}}", end="", file=sys.stderr, flush=True)
        self.drawn = True

    def close(self) -> None:
        """Take the bar away."""
        if self.drawn:
            print(f"\r{'':<{shutil.get_terminal_size().columns - 1}}\r", end="", file=sys.stderr, flush=True)


def duration(seconds: float) -> str:
    """A time to wait in words.

    >>> duration(3.2), duration(200), duration(9000)
    ('3 s', '3 min 20 s', '2 h 30 min')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
