"""Tries files in a process of its own, with bounds on time and memory, which a process that hangs
cannot overstep.
"""

from __future__ import annotations

import io
import multiprocessing
import re
import resource
import signal
import sys
import traceback
import warnings
from collections.abc import Callable, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

Trial = Callable[[Any], str | None]
"""Tries a file, or a command, and says what is wrong with what came of it, None where nothing
is.
"""

GIGABYTE = 2**30
WAIT = 6.0

# Control characters, half characters, and ends of lines and paragraphs.
CONTROL = ("Cc", "Cs", "Zl", "Zp")

# Of an error in a file after its name: where, what, and what would be right, which what was
# expected is.
FORM = r".*?(:[1-9][0-9]*:[1-9][0-9]*)?: .*(\S; \S|expected .*[^:] found \S|: expected one of: ).*"


class OutOfTimeError(BaseException):
    """A trial takes too long; derived so that nothing under test takes it for an error of its
    own.
    """


def outcome(arguments: Sequence[str], folder: Path = Path()) -> tuple[int, str, str]:
    """Status, standard output and standard error of a command that is given in a folder."""
    from ballplate.cli import main

    # Encoded as a terminal's, so that what cannot be encoded shows.
    out = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="backslashreplace")
    with chdir(folder), redirect_stdout(out), redirect_stderr(err):
        try:
            status = main(arguments)
        except SystemExit as left:
            status = -1 if left.code is None else int(left.code)
    out.flush()
    err.flush()
    return status, *(stream.buffer.getvalue().decode() for stream in (out, err))  # type: ignore[attr-defined,return-value]


def _serve(connection: Connection, trial: Trial, memory: int) -> None:
    """Try files until told to end. What was imported before is not counted, what is used together
    is.
    """
    import ballplate.extensions.estimators.distances
    import ballplate.montecarlo.experiments
    import ballplate.results.checked_files  # noqa: F401

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGPROF, _out_of_time)
    warnings.simplefilter("error")
    # As in pyproject.toml: older releases of matplotlib use names that newer ones of pyparsing are
    # giving up.
    deprecated = r"'\w+' (argument is )?deprecated(,| -) use '\w+'"
    warnings.filterwarnings("ignore", deprecated, DeprecationWarning, "matplotlib")
    for request in connection.recv():
        trial(request)
    if sys.platform == "linux":
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        resident = _peak()
        # Address space that is only reserved is no memory used.
        limit = pages * resource.getpagesize() - resident + memory
        resource.setrlimit(resource.RLIMIT_AS, (limit, resource.getrlimit(resource.RLIMIT_AS)[1]))
    connection.send(None)
    while True:
        request, seconds = connection.recv()
        signal.setitimer(signal.ITIMER_PROF, seconds)
        try:
            found = trial(request)
        except OutOfTimeError:
            found = f"more than {seconds} s of processor time:\n{traceback.format_exc()[-3000:]}"
        except BaseException:
            found = traceback.format_exc()
            found = found if len(found) < 5000 else f"{found[:1000]}\n…\n{found[-3500:]}"
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
        connection.send((found, _peak()))


def _peak() -> int:
    """Most memory that the process has had, in bytes; what getrusage tells is also of the process
    that started it.
    """
    if sys.platform != "linux":
        return 0
    found = re.search(r"VmHWM:\s*([0-9]+) kB", Path("/proc/self/status").read_text())
    return int(found[1]) * 1024 if found else 0


def _out_of_time(*_: Any) -> None:
    raise OutOfTimeError


class Worker:
    """A process that tries one request after the other; those of `warm_up` are good, and tried
    before bounds are set.

    `seconds` are of processor time, which does not depend on what else the computer does; the
    process is waited for six times as long.
    """

    def __init__(
        self, trial: Trial, warm_up: Sequence[Any], seconds: float = 10.0, memory: int = GIGABYTE
    ) -> None:
        self.trial, self.warm_up, self.seconds, self.memory = trial, warm_up, seconds, memory
        self.peak = 0
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, other = context.Pipe()
        arguments = (other, self.trial, self.memory)
        self.process = context.Process(target=_serve, args=arguments, daemon=True)
        self.process.start()
        other.close()
        self.connection.send(list(self.warm_up))
        self.connection.recv()

    def __call__(self, request: Any, seconds: float | None = None) -> str | None:
        """What is wrong with what comes of a request, for which there may be more time than for
        others.

        A process that does not answer any more is replaced.
        """
        seconds = seconds or self.seconds
        self.connection.send((request, seconds))
        found: str | None
        try:
            if self.connection.poll(WAIT * seconds):
                found, peak = self.connection.recv()
                self.peak = max(self.peak, peak)
                if peak > self.memory:
                    # The next file is not to answer for it.
                    self._stop()
                    self._start()
                    found = found or f"{peak / GIGABYTE:.2f} GB of memory"
                return found
            found = f"no answer after {WAIT * seconds} s"
        except EOFError:
            found = "the process has died"
        self._stop()
        self._start()
        return found

    def _stop(self) -> None:
        self.process.kill()
        self.process.join()
        self.connection.close()

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()
