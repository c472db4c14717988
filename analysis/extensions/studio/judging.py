"""Computations during changes of a design, in a process that later ones stop."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from ballplate.results import check
from ballplate.simulator.computing import begin_worker, interruptions_blocked
from ballplate.simulator.inputs import (
    ExperimentError,
    Message,
    optional_service,
    refused,
    to_python,
)

from .answers import answer, drawn_answer, later_answer, scene
from .document import DesignDocument, data_of, variants_of
from .drafts import draft_of, evaluable, evaluable_of, problems
from .filling import pool_of


@dataclass(frozen=True)
class DesignJudgement:
    """View of a document's text: its `scene`, None for a text that cannot be understood, and the
    `answer` to what of it can be evaluated, if anything.
    """

    scene: dict[str, Any] | None
    answer: dict[str, Any] | None
    messages: tuple[Message, ...]
    data: Any
    variants: tuple[str, ...]


def judgement(document: DesignDocument, moving: bool = False) -> DesignJudgement:
    """Return the view of a document, and faults of its text; `moving`: see `answer`."""
    variants = variants_of(document) if document.variant else ()
    try:
        draft = draft_of(document)
    except ExperimentError as error:
        return DesignJudgement(None, None, error.messages, data_of(document), variants)
    messages, data = draft.faults or (), to_python(draft.tree)
    found = None
    try:
        found = answer(evaluable(draft), moving)
    except ExperimentError as error:
        messages = tuple(dict.fromkeys((*messages, *error.messages)))
    seen = scene(draft, problems(draft))
    return DesignJudgement(seen, found, messages, data, variants)


def figures(document: DesignDocument) -> dict[str, Any]:
    """Return the answer to what of a document can be evaluated while it is moved, and what is
    wrong with its positions.

    :raises ExperimentError: nothing can.
    """
    judged = judgement(document, moving=True)
    if judged.answer is None or judged.scene is None:
        raise ExperimentError(judged.messages)
    places = judged.scene["positions"]
    wrong = [{"name": place["name"], "problem": place["problem"]} for place in places]
    return {**judged.answer, "scene": {"positions": wrong}}


def drawn(document: DesignDocument, kind: str, motion: int | None) -> dict[str, Any]:
    """Return the map of a document's design, a motion and all quantities; see `drawn_answer`.

    :raises ExperimentError: nothing of it can be evaluated.
    """
    return drawn_answer(evaluable_of(document), kind, motion)


def later(document: DesignDocument) -> dict[str, Any]:
    """Return the source of scale of a document's design, and its assumptions.

    :raises ExperimentError: nothing of it can be evaluated.
    """
    return later_answer(evaluable_of(document))


def matrix(document: DesignDocument, added: Sequence[DesignDocument]) -> dict[str, Any]:
    """Return how much of each error's information goes with each position of a document's design,
    and with the last position of each one `added`; empty without the extension that computes it.

    :raises ExperimentError: nothing of them can be evaluated.
    """
    information = optional_service("position_information")
    if information is None:
        return {}
    experiment, *more = (evaluable_of(each) for each in (document, *added))
    candidates = [each for each in more if len(each.positions) > len(experiment.positions)]
    data: dict[str, Any] = information(check(experiment), candidates).to_dict()
    return data


def pooled(document: DesignDocument) -> dict[str, Any]:
    """Return the candidates of a document's pool, as plain data; see `pool_of`.

    :raises ExperimentError: nothing of it can be evaluated.
    """
    return pool_of(evaluable_of(document, planning=True))


class Judge:
    """A process that computes one thing of one document at a time: what comes after it stops what
    is under way, so that a result is always of the document that came last.

    It serves one caller at a time; `asked` counts the requests.
    """

    def __init__(self) -> None:
        self.is_busy = False
        self.asked = 0
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
