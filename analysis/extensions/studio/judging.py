"""Computations during changes of a design, in a process that later ones stop."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from ballplate.simulator.computing import begin_worker, interruptions_blocked
from ballplate.simulator.inputs import ExperimentError, Message, refused, to_python

from .answers import answer, later_answer
from .document import DesignDocument, data_of, experiment_of, variants_of


@dataclass(frozen=True)
class DesignJudgement:
    """View of a document's text; without an `answer` for an invalid one."""

    answer: dict[str, Any] | None
    messages: tuple[Message, ...]
    data: Any
    variants: tuple[str, ...]


def judgement(document: DesignDocument) -> DesignJudgement:
    """Return the view of a document, or faults of its text."""
    variants = variants_of(document) if document.variant else ()
    try:
        experiment = experiment_of(document)
        data = answer(experiment)
    except ExperimentError as error:
        return DesignJudgement(None, error.messages, data_of(document), variants)
    return DesignJudgement(data, (), to_python(experiment.tree), variants)


def figures(document: DesignDocument) -> dict[str, Any]:
    """Return the answer to a document.

    :raises ExperimentError: its text is invalid.
    """
    return answer(experiment_of(document))


def later(document: DesignDocument) -> dict[str, Any]:
    """Return the source of scale of a document's design, and its assumptions.

    :raises ExperimentError: its text is invalid.
    """
    return later_answer(experiment_of(document))


class Judge:
    """A process that computes one thing of one document at a time: what comes after it stops what
    is under way, so that a result is always of the document that came last.

    It serves one caller at a time.
    """

    def __init__(self) -> None:
        self.is_busy = False
        self._process: BaseProcess | None = None
        self._connection: Connection | None = None

    def begin(self, work: Callable[[DesignDocument], Any], document: DesignDocument) -> None:
        """Begin a computation, and stop the running one."""
        if self.is_busy or self._process is None or not self._process.is_alive():
            self.stop()
            self._start()
        assert self._connection is not None
        self._document, self.is_busy = document, True
        # That a process has ended is found when its result is looked for.
        with suppress(OSError):
            self._connection.send((work, replace(document, back=(), forward=())))

    def look(self) -> Any:
        """Return the outcome of the computation, if complete.

        :raises ExperimentError: the text is invalid, or the work failed for another reason.
        """
        if not self.is_busy or self._connection is None or not self._connection.poll():
            return None
        try:
            received = self._connection.recv()
        except (EOFError, OSError):
            self.stop()
            received = "the computation ended without a result"
        self.is_busy = False
        if isinstance(received, ExperimentError):
            raise received
        if isinstance(received, str):
            raise refused(self._document.path, f"no figures: {received}")
        return received[0]

    def stop(self) -> None:
        """Stop the running computation."""
        if self._process is not None and self._connection is not None:
            self._process.kill()
            self._process.join()
            self._connection.close()
        self._process, self.is_busy = None, False

    def _start(self) -> None:
        # Not a copy of this process, which would have its threads' locks without the threads, but
        # where the system can, of one that has nothing but the modules.
        can_fork = "forkserver" in multiprocessing.get_all_start_methods()
        context: Any = multiprocessing.get_context("forkserver" if can_fork else "spawn")
        if can_fork:
            context.set_forkserver_preload(["__main__", f"{__package__}.prepared"])
        self._connection, child_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(child_end,), daemon=True)
        with interruptions_blocked():
            self._process.start()
        child_end.close()


def _serve(connection: Connection) -> None:
    begin_worker(os.getppid())
    # The studio may end at any moment.
    with suppress(EOFError, OSError):
        while True:
            work, document = connection.recv()
            outcome: Any
            try:
                outcome = (work(document),)
            except ExperimentError as error:
                outcome = error
            except Exception as error:
                # Whatever it is, a person who waits is told of it.
                outcome = f"{type(error).__name__}: {error}"
            connection.send(outcome)
