"""A session of the studio: one design at a time, its view, and its computations."""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from threading import RLock
from typing import Any

from ballplate.presentation import Data, as_data
from ballplate.simulator.inputs import ExperimentError, format_path, service

from .actions import ActionError, done
from .document import (
    ChangedOnDiskError,
    DesignDocument,
    changed,
    data_of,
    redone,
    reopened,
    saved,
    undone,
    variants_of,
)
from .folder import DesignFolder, RefusedError
from .jobs import JOBS, MOST_RUNNING, Job, started
from .judging import VIEWS, DesignJudgement, judgement
from .processes import Worker
from .recovery import give_up, keep, kept_in, recovered

# Seconds that a page waits for figures before it is answered without them, and between looks.
PATIENCE, INTERVAL = 2.0, 0.005


class OutdatedError(RefusedError):
    """The page shows a design that has been replaced."""


class Session:
    """Session of one user in the studio; every method may be called from any thread.

    A change is kept before it is evaluated, in a process of its own, which a further change stops.

    `revision` counts the changes, so that a page with an earlier state cannot change the design,
    and `name` identifies the session. Only files in the folder of the first file are opened or
    written, and error models in Python run only from files that the command itself has named.
    """

    def __init__(self, path: Path, variant: str | None = None, beginning: str = "") -> None:
        """Open a file, or begin an unsaved one.

        :raises ExperimentError: the file cannot be read, does not exist although no text is given,
            or its folder cannot be read.
        """
        self._lock = RLock()
        self._folder = DesignFolder(path, beginning)
        self.name = secrets.token_hex(4)
        document = self._folder.document(path, variant, new=bool(beginning))
        document, self.note = recovered(document, self.name)
        if document.is_untouched and not self.note:
            self.note = f"{path.name} is new, and begins with an example; Save writes it"
        self._document = document if variant else _with_first_variant(document)
        self.revision = 0
        self._kept: dict[str, Any] | None = None
        self._jobs: dict[int, Job] = {}
        self._judge, moving = Worker(), Worker()
        # What is asked for once nothing moves gives way to what moves.
        self._workers = {"preview": moving, "drawn": moving, "later": moving}
        self._workers |= {"matrix": Worker(), "pool": Worker()}
        self._design: Data | None = None
        self._burst: tuple[Any, ...] = ()
        self._judgement: Data = as_data(DesignJudgement(None, None, (), None, ()))
        self._begin()

    def state(self) -> dict[str, Any]:
        """Return the whole view, as plain data.

        While values are `pending`, those of the `design` are of an earlier text of the file.
        """
        self._await()
        with self._lock:
            document, judged, pending = self._document, self._judgement, self._judge.is_busy
            messages = () if pending else judged["messages"]
            return {
                "session": self.name,
                "revision": self.revision,
                "fingerprint": document.fingerprint,
                "file": document.path.name,
                "variant": document.variant,
                "variants": judged["variants"],
                "text": document.text,
                "data": data_of(document) if pending else judged["data"],
                "saved": document.is_saved,
                "untouched": document.is_untouched,
                "back": len(document.back),
                "forward": len(document.forward),
                "messages": [_named(message, judged["data"]) for message in messages],
                "pending": pending,
                "design": self._design,
                "stale": judged["answer"] is None,
                "kept": self._kept,
                "files": self._folder.names(),
                "recoverable": self.is_recoverable,
                "note": self.note,
            }

    @property
    def path(self) -> Path:
        """The file of the design."""
        return self._document.path

    @property
    def is_saved(self) -> bool:
        return not self._document.has_changes

    @property
    def is_recoverable(self) -> bool:
        """True if an end of the studio now would lose no change."""
        with self._lock:
            return self.is_saved or self.kept() is not None

    def kept(self) -> Path | None:
        """Return the path of unsaved changes, if they are kept."""
        with self._lock:
            return keep(self._document, self.name)

    def act(self, action: Mapping[str, Any]) -> None:
        """Change the design; a failure leaves it unchanged.

        :raises ActionError: the action is unknown or incomplete.
        :raises ExperimentError: a file cannot express it.
        :raises RefusedError: it is not permitted.
        """
        if action.get("do") == "keep":
            self._keep(action)
            return
        with self._lock:
            self._ensure_seen(action)
            control = self._controls().get(str(action.get("do")))
            burst = (action.get("do"), action.get("position"), bool(action.get("burst")))
            if control is None:
                document = done(self._document, action)
                if burst[-1] and burst[:2] == self._burst[:2]:
                    # Moves by one key after another are one step back.
                    document = replace(document, back=self._document.back)
                self._become(document)
            else:
                control(action)
            self._burst = burst

    def view(self, name: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Return a view of the design by its name in `VIEWS`, with the design's fingerprint.

        :raises ActionError, ExperimentError: the arguments, or the text, are invalid.
        :raises RefusedError: a later request came meanwhile, or the page shows another state.
        """
        with self._lock:
            self._ensure_seen(arguments)
            document, worker = self._document, self._workers[name]
            settings = {**arguments, "revision": self.revision}
            number = worker.begin(VIEWS[name], document, settings)
        while True:
            with self._lock:
                if worker.asked != number:
                    raise RefusedError("a later request replaced this one")
                result = worker.look()
                if not worker.is_busy:
                    return {"fingerprint": document.fingerprint, **result}
            time.sleep(INTERVAL)

    def draft(self, answers: Mapping[str, Any]) -> dict[str, Any]:
        """Return the draft of answers to the questions of a data sheet, with a message for the
        `name` of the file that cannot be begun.

        :raises UnusableError: the extension that drafts is not installed.
        """
        path, message = Path("design.yaml"), {}
        try:
            path = Path(self._free(answers).name)
        except RefusedError as error:
            message = {"name": str(error)}
        draft: dict[str, Any] = service("sheet_draft")(path, answers)
        return draft | {"messages": draft["messages"] | message}

    def start(self, name: str, settings: Mapping[str, Any]) -> int:
        """Start a computation, and return its number.

        :raises RefusedError: there is no such computation, or too many are running.
        :raises ActionError, ExperimentError: its settings, or the text, are invalid.
        """
        with self._lock:
            if name not in JOBS:
                raise RefusedError(f"no computation {name!r}; there are {', '.join(JOBS)}")
            if [job["state"] for job in self.jobs()].count("running") >= MOST_RUNNING:
                raise RefusedError(f"{MOST_RUNNING} computations are running; stop one")
            number = max(self._jobs, default=0) + 1
            self._jobs[number] = started(name, self._document, settings)
            return number

    def jobs(self) -> list[dict[str, Any]]:
        """All computations and how far they have come."""
        with self._lock:
            for job in self._jobs.values():
                job.look()
            return [job.to_dict(number) for number, job in self._jobs.items()]

    def page(self, number: int) -> str:
        """Return the page of a computation.

        :raises RefusedError: it has no page.
        """
        with self._lock:
            job = self._jobs.get(number)
            if job is None or not job.page:
                raise RefusedError(f"computation {number} has no page")
            return job.page

    def stop(self, number: int) -> None:
        """Stop a computation and remove it; a plan ends with its best choice first.

        :raises RefusedError: its number is unknown.
        """
        with self._lock:
            if number not in self._jobs:
                raise RefusedError(f"no computation {number}")
            if not self._jobs[number].end_with_best():
                self._jobs.pop(number).worker.stop()

    def close(self) -> None:
        """Stop all computations."""
        with self._lock:
            for worker in (self._judge, *self._workers.values()):
                worker.asked += 1
                worker.stop()
            while self._jobs:
                self._jobs.popitem()[1].worker.stop()

    def _controls(self) -> dict[str, Callable[[Mapping[str, Any]], None]]:
        """Actions on the file instead of the design."""
        return {
            "undo": lambda action: self._become(undone(self._document)),
            "redo": lambda action: self._become(redone(self._document)),
            "reopen": lambda action: self._become(reopened(self._document)),
            "variant": self._choose,
            "save": self._save,
            "open": self._open,
            "begin": self._begin_new,
        }

    def _ensure_seen(self, action: Mapping[str, Any]) -> None:
        """Ensure that the page shows the state it is about to change.

        :raises OutdatedError: it shows another one.
        """
        if action.get("session", self.name) != self.name:
            raise OutdatedError("the studio was restarted; this page shows an earlier design")
        if action.get("revision", self.revision) != self.revision:
            raise OutdatedError("the design has changed in another window; look again")

    def _become(self, document: DesignDocument) -> None:
        """Continue with another document, which is kept at once, and begin its evaluation; until
        it is complete, or if its text is invalid, the last answer of the same design is shown.
        """
        last, self._document = self._document, document
        if (document.path, document.variant) != (last.path, last.variant):
            self._design = None
        self.revision += 1
        self.note = ""
        keep(document, self.name)
        self._begin()

    def _begin(self) -> None:
        self._begun = time.monotonic()
        self._judge.begin(judgement, self._document, {})

    def _await(self) -> None:
        """Wait for the judgement of the present document, as long as a page waits."""
        while True:
            with self._lock:
                self._look()
                if not self._judge.is_busy or time.monotonic() > self._begun + PATIENCE:
                    return
            time.sleep(INTERVAL)

    def _look(self) -> None:
        """Take the judgement if there is one now; what it lacks is shown of the last one."""
        try:
            judged: Data | None = self._judge.look()
        except ExperimentError as error:
            self._judgement |= {"messages": as_data(error.messages)}
            self._judgement |= {"data": data_of(self._document)}
            return
        if judged is None:
            return
        self._judgement = judged
        if judged["scene"]:
            answers = (self._design or {}) | (judged["answer"] or {})
            self._design = {**answers, "scene": judged["scene"]}

    def _choose(self, action: Mapping[str, Any]) -> None:
        names = variants_of(self._document)
        if action.get("name") not in names:
            raise RefusedError(f"no variant {action.get('name')!r}; there are {', '.join(names)}")
        self._become(replace(self._document, variant=action["name"]))

    def _keep(self, action: Mapping[str, Any]) -> None:
        """Keep the quantities for comparison, or give them up; without the lock while they are
        computed.
        """
        self._await()
        with self._lock:
            self._ensure_seen(action)
            if self._judge.is_busy:
                raise RefusedError("the results are being computed; wait for them")
            if self._judgement["answer"] is None:
                raise RefusedError(
                    "there are no figures of this design; correct it before keeping it"
                )
        kept = None if action.get("off") else self.view("drawn", {})
        with self._lock:
            self._kept = kept
            self.revision += 1

    def _save(self, action: Mapping[str, Any]) -> None:
        before, name = self._document, action.get("name")
        path = None if name is None else self._folder.inside(str(name))
        try:
            self._document = saved(before, path)
        except ChangedOnDiskError as error:
            raise RefusedError(str(error)) from None
        except OSError as error:
            file, reason = path or before.path, error.strerror or str(error)
            raise RefusedError(f"{file.name} cannot be written: {reason}") from None
        self.revision += 1
        give_up(before, self.name)

    def _open(self, action: Mapping[str, Any]) -> None:
        path = self._folder.inside(str(action.get("name", "")))
        self._ensure_left(action)
        document, note = self._folder.document(path, new=kept_in(path).exists()), ""
        # What is left on purpose is not taken up again.
        if path.name != self._document.path.name:
            document, note = recovered(document, self.name)
        self._leave_for(_with_first_variant(document), note)

    def _begin_new(self, action: Mapping[str, Any]) -> None:
        """Begin a file that does not exist with a text, a step after the example."""
        path, document = self._free(action), self._document
        if path.name == document.path.name:
            self._become(changed(document, str(action["text"])))
            return
        self._ensure_left(action)
        self._leave_for(changed(self._folder.document(path), str(action["text"])))

    def _free(self, action: Mapping[str, Any]) -> Path:
        return self._folder.free(str(action.get("name", "")), self._document.path.name)

    def _ensure_left(self, action: Mapping[str, Any]) -> None:
        """Ensure that changes are discarded only on request."""
        if self._document.has_changes and not action.get("discard"):
            raise RefusedError(f"{self._document.path.name} has changes that are not saved")

    def _leave_for(self, document: DesignDocument, note: str = "") -> None:
        before = self._document
        self._become(document)
        self._kept, self.note = None, note
        if document.path.name != before.path.name:
            give_up(before, self.name)


def _with_first_variant(document: DesignDocument) -> DesignDocument:
    names = variants_of(document)
    return replace(document, variant=names[0] if names else None)


def _named(message: Data, data: Any) -> Data:
    """Return a message with `what` it is about, a position by its name."""
    what, steps = message["path"], message["steps"]
    if steps[:1] == ["positions"]:
        with suppress(LookupError, TypeError):
            below = format_path(steps[2:])
            what = f'position "{data["positions"][steps[1]]["name"]}"{below and f", {below}"}'
    return {**message, "what": what}


__all__ = ["ActionError", "OutdatedError", "RefusedError", "Session"]
