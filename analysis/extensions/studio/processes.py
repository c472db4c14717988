"""Processes beside the studio's that compute one thing of a design at a time and can be stopped."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from ballplate.presentation import as_data
from ballplate.simulator.computing import (
    EnoughError,
    ProgressStep,
    Report,
    begin_worker,
    interruptions_blocked,
    safe_path,
)
from ballplate.simulator.inputs import ExperimentError, refused

from .actions import ActionError
from .document import DesignDocument

Work = Callable[[DesignDocument, Mapping[str, Any], Report], Any]


class Worker:
    """A process that computes one thing of one document at a time: what begins stops what is under
    way, so that a result is always of the document that came last.

    It serves one caller at a time; `asked` counts the computations, and `step` is how far the
    present one has come. Its temporary files are in a folder that is removed with it, since a
    stopped process removes no file.
    """

    def __init__(self) -> None:
        self.asked = 0
        self.is_busy = False
        self.step = ""
        self._process: BaseProcess | None = None

    def begin(self, work: Work, document: DesignDocument, settings: Mapping[str, Any]) -> int:
        """Begin a computation, stop the running one, and return the number of this one."""
        if self.is_busy or self._process is None or not self._process.is_alive():
            self.stop()
            self._start()
        self.asked += 1
        self._document, self.is_busy, self.step = document, True, ""
        # That a process has ended is found when its result is looked for.
        with suppress(OSError):
            self._connection.send((work, replace(document, back=(), forward=()), settings))
        return self.asked

    def look(self) -> Any:
        """Return the result of a computation that is no longer `is_busy`.

        :raises ActionError, ExperimentError: its settings or its text are invalid, or it failed for
            another reason.
        """
        try:
            while self.is_busy and self._connection.poll():
                received = self._connection.recv()
                self.is_busy = isinstance(received, ProgressStep)
                if isinstance(received, Exception):
                    raise received
                if not self.is_busy:
                    return received[0]
                self.step = str(received)
        except (EOFError, OSError):
            self.stop()
            text = "the computation ended without a result"
            raise refused(self._document.path, text) from None

    def end(self) -> None:
        """Ask the running computation to end with the best result so far."""
        with suppress(OSError):
            self._connection.send(None)

    def stop(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._connection.close()
            shutil.rmtree(self._folder, ignore_errors=True)
        self._process, self.is_busy = None, False

    def _start(self) -> None:
        # Not a copy of this process, which would have its threads' locks without the threads, but
        # where the system can, of one that has nothing but the modules.
        can_fork = "forkserver" in multiprocessing.get_all_start_methods()
        context: Any = multiprocessing.get_context("forkserver" if can_fork else "spawn")
        if can_fork:
            context.set_forkserver_preload(["__main__", f"{__package__}.prepared"])
        self._folder = tempfile.mkdtemp(prefix="ballplate-studio-")
        self._connection, child_end = context.Pipe()
        arguments = (child_end, self._folder)
        self._process = process = context.Process(target=_serve, args=arguments, daemon=True)
        with interruptions_blocked(), safe_path():
            process.start()
        child_end.close()


def _serve(connection: Connection, folder: str) -> None:
    begin_worker(os.getppid())
    tempfile.tempdir = folder
    # The studio may end at any moment.
    with suppress(EOFError, OSError):
        while True:
            task = connection.recv()
            # A wish to end may come when the result is there.
            if task is not None:
                connection.send(_outcome(connection, *task))


def _outcome(
    connection: Connection, work: Work, document: DesignDocument, settings: Mapping[str, Any]
) -> tuple[Any] | Exception:
    """Return the result as plain data, or the error that a person who waits is told."""

    def report(step: ProgressStep) -> None:
        connection.send(step)
        if step.can_end and connection.poll():
            raise EnoughError

    try:
        return (as_data(work(document, settings, report)),)
    except (ActionError, ExperimentError) as error:
        return error
    except Exception as error:
        return refused(document.path, f"{type(error).__name__}: {error}")
