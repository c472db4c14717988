"""The command `ballplate`, from its arguments to its exit status."""

from __future__ import annotations

import argparse
import errno
import io
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from types import FrameType
from typing import Any

from ballplate.simulator.computing.signals import ANSWERS
from ballplate.simulator.inputs.extensions import UnusableError, fault_of, missing, registered

from ._parsers import grammar, parser, tell_of_extensions, with_command
from .notes import print_errors, told
from .outputs import UsageError, check_outputs


class StandardOutputError(Exception):
    """Standard output cannot be written; the text is the system's reason.

    It is not an OSError, which would be reported as one of a file.
    """


class _Lasting(io.FileIO):
    """Writes until the reader has left or the disk is full, and then to the null device."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError as error:
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            # Windows reports a reader that has left as EINVAL.
            if error.errno not in (errno.EPIPE, errno.EINVAL):
                raise StandardOutputError(error.strerror) from None
            return len(data)


@contextmanager
def lasting_streams() -> Iterator[None]:
    """Let a command finish regardless of the reader of its output, so that its files and its
    status are its own, and print every character.

    The null device replaces closed streams, whose numbers files opened later would take. Pipes and
    files are UTF-8; a terminal of another encoding shows the numbers of characters that it lacks.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            replacement = open(os.devnull, mode, encoding="utf-8")  # noqa: SIM115
            # Workers inherit it.
            os.set_inheritable(replacement.fileno(), True)
            setattr(sys, name, replacement)
    before = sys.stdout
    with suppress(OSError):
        # Fails for a stream that is no file.
        raw = _Lasting(sys.stdout.fileno(), "w", closefd=False)
        sys.stdout.flush()
        sys.stdout = io.TextIOWrapper(io.BufferedWriter(raw), line_buffering=raw.isatty())
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            if stream.isatty():
                stream.reconfigure(errors="backslashreplace")
            else:
                stream.reconfigure(encoding="utf-8", errors="backslashreplace", newline="\n")
    try:
        yield
    finally:
        sys.stdout, written = before, sys.stdout
        with suppress(StandardOutputError):
            written.flush()


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


USAGE, BAD_FILE, INTERNAL = 2, 3, 70


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status; without arguments, that of the process itself."""
    interruption = Interruption()
    before = {}
    if threading.current_thread() is threading.main_thread():
        numbers = [getattr(signal, name) for name in ANSWERS if hasattr(signal, name)]
        # Shells start processes in the background with signals ignored.
        heard = [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]
        before = {number: signal.signal(number, interruption.handle) for number in heard}
    try:
        status = _main(arguments, interruption)
    except (KeyboardInterrupt, Exception) as error:
        # What fails after a signal does so because of it.
        if not interruption.came and isinstance(error, Exception):
            raise
        interruption.tell()
        status = interruption.status
    if arguments is None and interruption.came:
        # The interpreter's own end would wait for running work. Workers end with their parent.
        os._exit(status)
    for number, handler in before.items():
        signal.signal(number, handler)
    return status


def _main(arguments: Sequence[str] | None, interruption: Interruption) -> int:
    with lasting_streams():
        try:
            words = sys.argv[1:] if arguments is None else arguments
            # The grammar of all commands is needed only where none is named.
            if not words:
                parser(with_options=False).print_help(sys.stderr)
                return USAGE
            words = with_command(words)
            try:
                options = grammar(words[0]).parse_args(words)
            except UnusableError as error:
                print(f"ballplate {words[0]}: {error}", file=sys.stderr)
                return USAGE
            except SystemExit:
                # Help is data, too.
                sys.stdout.flush()
                raise
            options.interruption = interruption
            status = _run(options)
            if registered.cache_info().currsize:
                tell_of_extensions()
            sys.stdout.flush()
            return status
        except StandardOutputError as error:
            print(f"standard output: cannot be written ({error}); give it room", file=sys.stderr)
            return BAD_FILE


def _run(options: argparse.Namespace) -> int:
    # Loaded only now, so that --help and wrong usage answer at once.
    from concurrent.futures import BrokenExecutor

    from ballplate.simulator.computing.steps import InternalError, want_of_memory
    from ballplate.simulator.inputs.messages import ExperimentError, in_one_line

    try:
        # What a user can mend is answered in a line, with the status of a file that cannot be used,
        # and without a traceback. From the specific to the general: an error that one of these
        # names is not judged by its class below. What remains is a fault of the program, and is
        # raised.
        check_outputs(options)
        options.is_written = True
        with told(options):
            status = int(options.run(options))
        return status if options.is_written else BAD_FILE
    except UsageError as error:
        print(in_one_line(f"ballplate {options.command}: {error}"), file=sys.stderr)
        return USAGE
    except ExperimentError as error:
        print_errors(error.messages, options)
        return BAD_FILE
    except UnusableError as error:
        print(error, file=sys.stderr)
        return BAD_FILE
    except InternalError as error:
        return internal_error(error)
    except Exception as error:
        if (gone := missing(error)) is not None:
            print(f"ballplate {options.command}: {gone}", file=sys.stderr)
            return BAD_FILE
        if isinstance(error, BrokenExecutor):
            text = "a worker process was ended from outside, as a rule because memory ran short"
            print(f"ballplate {options.command}: {text}; use fewer --workers", file=sys.stderr)
            return BAD_FILE
        if (want := want_of_memory(error)) is not None:
            text = f"ballplate {options.command} {want}; make the design smaller, or use fewer"
            print(f"{text} --workers", file=sys.stderr)
            return BAD_FILE
        if isinstance(error, RuntimeError) and "Symlink loop" in str(error):
            print(f"{in_one_line(str(error))}; name a file", file=sys.stderr)
            return BAD_FILE
        if isinstance(error, OSError):
            print(in_one_line(_told(error, options)), file=sys.stderr)
            return BAD_FILE
        if (fault := fault_of(error)) is not None:
            print(in_one_line(fault), file=sys.stderr)
            return BAD_FILE
        raise


def internal_error(error: object) -> int:
    """Report an error of the program itself; return the exit status."""
    text = f"internal error: {error}. Please report it with the file and the command."
    print(text, file=sys.stderr)
    return INTERNAL


def _told(error: OSError, options: argparse.Namespace) -> str:
    """Return the system's refusal, with its file if known."""
    try:
        os.getcwd()
    except FileNotFoundError:
        return (
            f"ballplate {options.command}: the current folder no longer exists; change to another"
        )
    where = error.filename or f"ballplate {options.command}"
    return (
        f"{where}: cannot be used ({error.strerror or error}); check the name, the permissions and"
        " the room there"
    )
