"""Signals that ask a command to end: SIGINT, as of Ctrl-C, and SIGTERM. They are answered wherever
they come.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from types import FrameType
from typing import TYPE_CHECKING, NoReturn

from ballplate.simulator.computing.signals import ANSWERS

if TYPE_CHECKING:
    from argparse import Namespace
    from pathlib import Path
    from socket import socket

# Seconds that a command has for an orderly end.
ORDERLY_LIMIT = 0.5
# Seconds within which signals count as one: programs in between, such as `timeout`, send what the
# terminal sends too.
SAME_SIGNAL_LIMIT = 0.1
# Seconds that the last words may take, where nobody reads standard error.
WORDS_LIMIT = 0.15


# What tells that a file was written to: when, and how large it is, and its number on the disk.
Signature = tuple[int, int, int]


def files_named(options: Namespace) -> dict[Path, Signature | None]:
    """The files that the options of a command name, and whether they are there."""
    return signatures(path for _, path in named_paths(options))


def named_paths(options: Namespace) -> Iterator[tuple[str, Path]]:
    """Paths among the options of a command, with the options' names."""
    from pathlib import Path

    for name, value in vars(options).items():
        for item in value if isinstance(value, list) else [value]:
            if isinstance(item, Path):
                yield name, item


def signatures(paths: Iterable[Path]) -> dict[Path, Signature | None]:
    """Return the presence and write times of files."""
    return {path: _signature(path) for path in paths}


def _signature(path: Path) -> Signature | None:
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return None
    return (status.st_mtime_ns, status.st_size, status.st_ino)


def written(before: Mapping[Path, Signature | None]) -> str:
    """Return the files that are new or changed."""
    names = [
        str(path) for path, signature in before.items() if _signature(path) not in (None, signature)
    ]
    return f"written: {', '.join(names)}" if names else "no file was written"


@dataclass
class Interruption:
    """The first signal received, and a function that returns the files kept if the command ends
    now.
    """

    came: int | None = None
    kept: Callable[[], str] = partial(written, {})
    is_raising: bool = False
    told: threading.Lock = field(default_factory=threading.Lock)
    placing: threading.Lock = field(default_factory=threading.Lock)

    @contextmanager
    def raising(self) -> Iterator[None]:
        """Let signals raise KeyboardInterrupt from now on, and those that have come already, until
        the end.
        """
        self.is_raising = True
        try:
            self.answer()
            yield
        finally:
            self.is_raising = False

    @contextmanager
    def held(self) -> Iterator[None]:
        """Let no signal end the process until the end, and answer those that have come then."""
        is_raising, self.is_raising = self.is_raising, False
        try:
            # The thread that ends the process waits for it.
            with self.placing:
                yield
        finally:
            self.is_raising = is_raising
        if is_raising:
            self.answer()

    def answer(self) -> None:
        """Raise KeyboardInterrupt after a signal.

        Long work calls it now and then: an interruption inside a finaliser or a library's
        callback, which lets no exception out, would be lost.
        """
        if self.came is not None:
            raise KeyboardInterrupt

    @property
    def status(self) -> int:
        return ANSWERS[self._name][0]

    @property
    def word(self) -> str:
        return ANSWERS[self._name][1]

    @property
    def _name(self) -> str:
        return "SIGINT" if self.came is None else signal.Signals(self.came).name


@contextmanager
def interruptions(is_own_process: bool = False) -> Iterator[Interruption]:
    """Remember the first signal, which raises KeyboardInterrupt within `Interruption.raising`.

    In a process of its own the command then has `ORDERLY_LIMIT` to end; afterwards, or at a second
    signal, another thread ends the process, also during a long call of linear algebra, or if a
    library has caught the exception. Signals after the command's end have no effect, unless the
    interpreter's end takes too long.

    A process started with a signal ignored, as shells start those in the background, continues to
    ignore it.
    """
    interruption = Interruption()
    if threading.current_thread() is not threading.main_thread():
        yield interruption
        return

    def interrupt(number: int, _: FrameType | None) -> None:
        # A second exception would disturb the end that the first has begun.
        if interruption.came is None:
            interruption.came = number
            if interruption.is_raising:
                raise KeyboardInterrupt

    before = {}
    for name in ANSWERS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            before[number] = signal.signal(number, interrupt)
    try:
        if is_own_process and before:
            _watch(interruption, frozenset(before))
            # What is registered first comes last, when nothing is left to end but the interpreter,
            # which would give signals back their usual effect.
            atexit.register(_ignore, tuple(before))
        yield interruption
    finally:
        if not is_own_process:
            for number, handler in before.items():
                signal.signal(number, handler)


def _ignore(numbers: tuple[int, ...]) -> None:
    for number in numbers:
        signal.signal(number, signal.SIG_IGN)


def _watch(interruption: Interruption, numbers: frozenset[int]) -> None:
    """Let a thread end the process if it has not ended some time after a signal."""
    from socket import socketpair

    # What wakes a thread up has to be a socket on Windows.
    reader, writer = socketpair()
    writer.setblocking(False)
    # Written to by the signal itself, while the main thread is in a long call of a library.
    signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)

    def watch() -> None:
        try:
            number = _wait(reader, numbers)
            first = time.monotonic()
            while (seconds_left := first + ORDERLY_LIMIT - time.monotonic()) > 0.0:
                reader.settimeout(seconds_left)
                with suppress(TimeoutError):
                    _wait(reader, numbers)
                    if time.monotonic() - first > SAME_SIGNAL_LIMIT:
                        break
            # Files of which some are in their places are not left so.
            interruption.placing.acquire()
            # Not earlier, since the exception is raised at what is told as the first signal.
            interruption.came = number if interruption.came is None else interruption.came
            words = threading.Thread(target=tell, args=(interruption,), daemon=True)
            words.start()
            words.join(WORDS_LIMIT)
        finally:
            # The socket stays open as long as the thread lives.
            writer.detach()
            leave(interruption.status)

    threading.Thread(target=watch, name="interruption", daemon=True).start()


def _wait(reader: socket, numbers: frozenset[int]) -> int:
    """Return the number of the next of these signals."""
    while True:
        number = reader.recv(1)[0]
        if number in numbers:
            return number


def leave(status: int) -> NoReturn:
    """End the process and its workers at once.

    The interpreter's own end would wait for running work, and may report an interruption that
    passed through generated code as unanswered.
    """
    try:
        # Not imported: the main thread may be about to, and would be waited for.
        multiprocessing = sys.modules.get("multiprocessing")
        # What cannot be stopped here ends by itself, as its parent has ended.
        with suppress(Exception):
            for process in multiprocessing.active_children() if multiprocessing else ():
                process.kill()
    finally:
        os._exit(status)


def tell(interruption: Interruption) -> None:
    """Report once, on standard error, that the command has ended, and the files it keeps."""
    if sys.stderr is not None and interruption.told.acquire(blocking=False):
        clear = "\r\x1b[K" if sys.stderr.isatty() else ""
        print(f"{clear}{interruption.word}; {interruption.kept()}", file=sys.stderr, flush=True)
