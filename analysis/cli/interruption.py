"""Signals that ask a command to end: SIGINT, as of Ctrl-C, and SIGTERM."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import FrameType

from ballplate.simulator.computing.signals import ANSWERS

# Seconds within which signals count as one.
SAME_SIGNAL = 0.5


@dataclass
class Interruption:
    """The signal that came, and a function that returns what is kept if the command ends now."""

    came: str = ""
    at: float = 0.0
    kept: Callable[[], str] = str

    def handle(self, number: int, _: FrameType | None) -> None:
        """Raise KeyboardInterrupt at the first signal, and end the process at a later one."""
        if not self.came:
            self.came, self.at = signal.Signals(number).name, time.monotonic()
            raise KeyboardInterrupt
        # Programs in between, such as `timeout`, send what the terminal sends too.
        if time.monotonic() > self.at + SAME_SIGNAL:
            self.tell()
            os._exit(self.status)

    def answer(self) -> None:
        """Raise KeyboardInterrupt after a signal whose exception a library has caught."""
        if self.came:
            raise KeyboardInterrupt

    def tell(self) -> None:
        """Report on standard error that the command has ended, and what it keeps."""
        kept = self.kept()
        print(f"{self.word}; {kept}" if kept else self.word, file=sys.stderr, flush=True)

    @property
    def status(self) -> int:
        return ANSWERS[self.came or "SIGINT"][0]

    @property
    def word(self) -> str:
        return ANSWERS[self.came or "SIGINT"][1]
