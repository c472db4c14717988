"""Notes, warnings, errors and progress on standard error, and the options for more or fewer."""

from __future__ import annotations

import sys
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ballplate.rank import Verdict
    from ballplate.simulator.computing.steps import ProgressStep
    from ballplate.simulator.inputs.messages import Message


def add_telling(parser: ArgumentParser) -> None:
    """Add the options for fewer or more notes."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "-q",
        "--quiet",
        action="store_true",
        help="print errors and warnings only, no progress and no notes",
    )
    group.add_argument(
        "-v",
        "--verbose",
        action="store_true",
        help="also print versions, the files read, and the time taken",
    )


def note(options: Namespace, text: str) -> None:
    """Print a note."""
    if not options.quiet:
        complain(text)


def complain(text: object) -> None:
    """Print a fault, or a fact about it, in one line."""
    from ballplate.simulator.inputs.messages import in_one_line

    print(in_one_line(str(text)), file=sys.stderr)


def warn(doubts: Iterable[object]) -> None:
    """Print warnings, one line each."""
    for doubt in doubts:
        complain(f"warning: {doubt}")


def tell_notes(notes: Iterable[object]) -> None:
    """Print detected settings, one line each."""
    for note in notes:
        complain(f"note: {note}")


def note_singular_values(options: Namespace, verdict: Verdict) -> None:
    """Print the singular values that decided a rank, if asked to be verbose."""
    if options.verbose and len(verdict.singular_values):
        from ballplate.results.text_blocks import singular_value_words

        note(options, singular_value_words(verdict))


@contextmanager
def told(options: Namespace) -> Iterator[None]:
    """On request, print the inputs of a command before it starts, and its duration afterwards."""
    if not options.verbose:
        yield
        return
    from ballplate.simulator.computing.numerics import versions

    from .outputs import inputs

    for name, version in versions():
        note(options, f"{name} {version}")
    outputs = {output.dest for output in getattr(options, "outputs", ())}
    for path in dict.fromkeys(inputs(options, outputs)):
        if path.is_file():
            note(options, f"reads {path}")
    started = time.monotonic(), time.process_time()
    try:
        yield
    finally:
        elapsed, processor = time.monotonic() - started[0], time.process_time() - started[1]
        note(
            options,
            f"{options.command}: {elapsed:.3g} s, {processor:.3g} s of the processor in this"
            " process",
        )


def print_errors(messages: Iterable[Message], options: Namespace) -> None:
    """Print errors on standard error, a line each; at a terminal, and with --verbose, with the
    lines of the files.
    """
    from ballplate.simulator.inputs.messages import folded, in_one_line

    with_lines = options.verbose or sys.stderr.isatty()
    for message in folded(messages):
        print(message, file=sys.stderr)
        if with_lines and message.line:
            with suppress(OSError, ValueError, IndexError):
                lines = Path(message.file).read_text(encoding="utf-8-sig").splitlines()
                line = lines[message.line - 1].replace("\t", " ")
                mark = " " * len(in_one_line(line[: message.column - 1]))
                print(f"    {in_one_line(line)}\n    {mark}^", file=sys.stderr)


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
