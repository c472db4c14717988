"""A session of the studio: one design at a time, what is shown of it, and what runs beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from threading import RLock
from typing import Any

from ballplate.simulator.inputs.messages import ExperimentError, Message
from ballplate.simulator.inputs.yamltree import to_python

from .actions import ActionError, done, settings_of
from .answers import answer
from .document import (
    ChangedOnDiskError,
    DesignDocument,
    data_of,
    experiment_of,
    opened,
    redone,
    reopened,
    saved,
    undone,
    variants_of,
)
from .jobs import JOBS, MOST_RUNNING, Job, started

ENDINGS = (".yaml", ".yml")


class RefusedError(Exception):
    """What was asked for is not allowed, or not possible now; the text says why."""


class Session:
    """What one person does in the studio; every method may be called from any thread.

    `revision` counts the changes, so that a page which shows an earlier state changes nothing.
    Only files in the folder of the one that was opened first are opened or written, and error
    models in Python run only from files that the command itself has named.
    """

    def __init__(self, path: Path, variant: str | None = None, beginning: str = "") -> None:
        """Open a file; where there is none yet, begin with a text that is not saved.

        :raises ExperimentError: the file cannot be read, or there is none and no text either.
        """
        self._lock = RLock()
        self._first = path.resolve()
        is_new = bool(beginning) and not path.exists()
        self._document = (
            DesignDocument(path, variant, beginning, None) if is_new else opened(path, variant)
        )
        if variant is None:
            names = variants_of(self._document)
            self._document = replace(self._document, variant=names[0] if names else None)
        self._answer: dict[str, Any] | None = None
        self._kept: dict[str, Any] | None = None
        self._messages: tuple[Message, ...] = ()
        self._data: Any = None
        self._variants: tuple[str, ...] = ()
        self._jobs: dict[int, Job] = {}
        self.revision = 0
        self._judge()

    def state(self) -> dict[str, Any]:
        """Everything that the page shows, as plain data."""
        with self._lock:
            document = self._document
            return {
                "revision": self.revision,
                "file": document.path.name,
                "variant": document.variant,
                "variants": list(self._variants),
                "text": document.text,
                "data": self._data,
                "saved": document.is_saved,
                "back": len(document.back),
                "forward": len(document.forward),
                "messages": [_message_data(one) for one in self._messages],
                "design": self._answer,
                "kept": self._kept,
                "files": [one.name for one in self._files()],
                "jobs": list(JOBS),
            }

    def act(self, action: Mapping[str, Any]) -> None:
        """Do something with the design.

        :raises ActionError: it is unknown or incomplete.
        :raises ExperimentError: the file cannot say it.
        :raises RefusedError: it is not allowed.
        """
        with self._lock:
            seen = action.get("revision")
            if seen is not None and seen != self.revision:
                raise RefusedError("the design has changed in another window; look again")
            control = self._controls().get(str(action.get("do")))
            if control is None:
                self._become(done(self._document, action))
            else:
                control(action)

    def preview(self, action: Mapping[str, Any]) -> dict[str, Any]:
        """What the design would be after an action that is not made.

        :raises ActionError, ExperimentError: as for `act`.
        """
        with self._lock:
            document = self._document
        return answer(experiment_of(done(document, action)))

    def settings(self, position: str) -> dict[str, Any]:
        """What a file says of a position, to put it back later."""
        with self._lock:
            return settings_of(self._document, position)

    def start(self, name: str, settings: Mapping[str, Any]) -> int:
        """Start a computation, and return its number.

        :raises RefusedError: there is no such computation, or too many are running.
        """
        with self._lock:
            if name not in JOBS:
                raise RefusedError(f"no computation {name!r}; there are {', '.join(JOBS)}")
            for job in self._jobs.values():
                job.look()
            if sum(job.state == "running" for job in self._jobs.values()) >= MOST_RUNNING:
                raise RefusedError(f"{MOST_RUNNING} computations are running; stop one of them")
            number = max(self._jobs, default=0) + 1
            self._jobs[number] = started(name, self._document, settings, self.revision)
            return number

    def jobs(self) -> list[dict[str, Any]]:
        """All computations and how far they have come."""
        with self._lock:
            for job in self._jobs.values():
                job.look()
            return [job.to_dict(number) for number, job in self._jobs.items()]

    def stop(self, number: int) -> None:
        """Stop a computation and forget it.

        :raises RefusedError: there is none of that number.
        """
        with self._lock:
            if number not in self._jobs:
                raise RefusedError(f"no computation {number}")
            self._jobs.pop(number).stop()

    def close(self) -> None:
        """Stop all computations."""
        with self._lock:
            for number in list(self._jobs):
                self.stop(number)

    def _controls(self) -> dict[str, Callable[[Mapping[str, Any]], None]]:
        """What is done with the file rather than with the design in it."""
        return {
            "undo": lambda action: self._become(undone(self._document)),
            "redo": lambda action: self._become(redone(self._document)),
            "variant": self._choose,
            "keep": self._keep,
            "save": self._save,
            "open": self._open,
            "reopen": lambda action: self._become(reopened(self._document)),
        }

    def _become(self, document: DesignDocument) -> None:
        self._document = document
        self.revision += 1
        self._judge()

    def _judge(self) -> None:
        """Answer anew; where the text is wrong the last answer stays, with what is wrong."""
        self._variants = variants_of(self._document) if self._document.variant else ()
        try:
            experiment = experiment_of(self._document)
            self._data = to_python(experiment.tree)
            self._answer = answer(experiment)
            self._messages = ()
        except ExperimentError as error:
            self._data = data_of(self._document)
            self._messages = error.messages

    def _choose(self, action: Mapping[str, Any]) -> None:
        names = variants_of(self._document)
        if action.get("name") not in names:
            raise RefusedError(f"no variant {action.get('name')!r}; there are {', '.join(names)}")
        self._answer = None
        self._become(replace(self._document, variant=action["name"]))

    def _keep(self, action: Mapping[str, Any]) -> None:
        if self._messages:
            raise RefusedError("the text is wrong; mend it before the design is kept")
        self._kept = None if action.get("off") else self._answer
        self.revision += 1

    def _save(self, action: Mapping[str, Any]) -> None:
        name = action.get("name")
        path = None if name is None else self._inside(str(name))
        try:
            self._document = saved(self._document, path)
        except ChangedOnDiskError as error:
            raise RefusedError(str(error)) from None
        except OSError as error:
            reason = error.strerror or str(error)
            raise RefusedError(f"{self._document.path.name} cannot be written: {reason}") from None
        self.revision += 1

    def _open(self, action: Mapping[str, Any]) -> None:
        path = self._inside(str(action.get("name", "")))
        if not self._document.is_saved and not action.get("discard"):
            raise RefusedError(f"{self._document.path.name} has changes that are not saved")
        trusted = path.resolve() == self._first
        document = opened(path, None, trusted)
        names = variants_of(document)
        self._kept = self._answer = None
        self._become(replace(document, variant=names[0] if names else None))

    def _inside(self, name: str) -> Path:
        """The path of a design in the folder.

        :raises RefusedError: it would be elsewhere, or is no design's name.
        """
        folder = self._first.parent
        path = folder / name
        is_plain = name == Path(name).name and name.isprintable()
        is_plain &= name.lower().endswith(ENDINGS) and not name.startswith(".")
        if not is_plain or path.resolve().parent != folder:
            raise RefusedError(f'"{name}" is not the name of a design in the folder {folder.name}')
        return path

    def _files(self) -> list[Path]:
        return sorted(
            one
            for one in self._first.parent.iterdir()
            if one.suffix.lower() in ENDINGS and one.is_file()
        )


def _message_data(message: Message) -> dict[str, Any]:
    return {
        "line": message.line,
        "column": message.column,
        "path": message.path,
        "text": message.text,
    }


__all__ = ["ActionError", "RefusedError", "Session"]
