"""A design file while it is changed: its text, the steps back and forward, and saving it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ballplate.presentation import write_files
from ballplate.simulator.experiment import Experiment, load, trees_of
from ballplate.simulator.inputs import (
    OPENED,
    ExperimentError,
    Trust,
    parse_tree,
    read_bytes,
    refused,
    to_python,
    utf8_text,
)

# Texts before the present one that are kept.
MOST_STEPS = 200

BYTE_ORDER_MARK = "\ufeff"


class ChangedOnDiskError(Exception):
    """The file differs from its last reading or writing."""


@dataclass(frozen=True)
class DesignDocument:
    """A design file and its text, possibly unsaved.

    `content` is the file's content at the last reading or writing, None before the first. `back`
    and `forward` are the texts of undoing and redoing, the next one last. `trust` is that in a
    file that the user has opened by name.
    """

    path: Path
    variant: str | None
    text: str
    content: bytes | None
    trust: Trust = OPENED
    back: tuple[str, ...] = ()
    forward: tuple[str, ...] = ()

    @property
    def fingerprint(self) -> str:
        """Key that identifies this design and its present text."""
        state = f"{self.path}\0{self.variant}\0{self.text}"
        return hashlib.blake2b(state.encode("utf-8", "surrogatepass"), digest_size=12).hexdigest()

    @property
    def is_saved(self) -> bool:
        return self.content is not None and self.content == encoded(self)

    @property
    def is_untouched(self) -> bool:
        """True for a new file with the text that it has begun with."""
        return self.content is None and not self.back

    @property
    def has_changes(self) -> bool:
        """True if something was done to the text that the file does not hold."""
        return bool(self.back) and not self.is_saved


def opened(path: Path, variant: str | None = None, trust: Trust = OPENED) -> DesignDocument:
    """The document of a file.

    :raises ExperimentError: the file cannot be read as text.
    """
    content = read_bytes(path)
    return DesignDocument(path, variant, utf8_text(content, str(path)), content, trust)


def experiment_of(
    document: DesignDocument, planning: bool = False, tolerant: bool = False
) -> Experiment:
    """Return the experiment of the text, for `tolerant` with its faults, to be changed and drawn.

    :raises ExperimentError: the text is invalid, or has no such variant.
    """
    experiments = load(document.path, planning, document.trust, document.text, tolerant)
    for experiment in experiments:
        if experiment.name == document.variant or len(experiments) == 1:
            return experiment
    names = ", ".join(str(experiment.name) for experiment in experiments)
    raise refused(document.path, f"choose one of the variants: {names}", "variants")


def data_of(document: DesignDocument) -> Any:
    """Return the text as plain data, if it is YAML."""
    try:
        return to_python(parse_tree(document.text, str(document.path)))
    except ExperimentError:
        return None


def variants_of(document: DesignDocument) -> tuple[str, ...]:
    """Return the names of the text's variants; empty for a text that cannot be understood."""
    try:
        return tuple(trees_of(document.text, document.path, [])[1])
    except ExperimentError:
        return ()


def changed(document: DesignDocument, text: str) -> DesignDocument:
    """The document with another text, and the present one a step back."""
    if text == document.text:
        return document
    back = (*document.back, document.text)[-MOST_STEPS:]
    return replace(document, text=text, back=back, forward=())


def undone(document: DesignDocument) -> DesignDocument:
    """Return the document one step back; unchanged at the first step."""
    if not document.back:
        return document
    forward = (*document.forward, document.text)
    return replace(document, text=document.back[-1], back=document.back[:-1], forward=forward)


def redone(document: DesignDocument) -> DesignDocument:
    """Return the document one step forward; unchanged at the last step."""
    if not document.forward:
        return document
    back = (*document.back, document.text)
    return replace(document, text=document.forward[-1], back=back, forward=document.forward[:-1])


def encoded(document: DesignDocument) -> bytes:
    """Return the new content of the file, with its byte order mark."""
    mark = BYTE_ORDER_MARK.encode()
    starts = document.content is not None and document.content.startswith(mark)
    return (mark if starts else b"") + document.text.encode()


def ensure_as_read(document: DesignDocument) -> None:
    """Ensure that saving overwrites no change by others.

    :raises ChangedOnDiskError: the file differs from its last reading or writing.
    """
    try:
        content = document.path.read_bytes()
    except FileNotFoundError:
        content = None
    if content != document.content:
        name = document.path.name
        how = "has been removed" if content is None else "has changed"
        raise ChangedOnDiskError(
            f"{name} {how} on disk since it was opened here and was not overwritten: save under"
            " another name, or open the file again"
        )


def reopened(document: DesignDocument) -> DesignDocument:
    """Return the document with the file's present content, and the present text one step back."""
    reopened_document = opened(document.path, document.variant, document.trust)
    return replace(changed(document, reopened_document.text), content=reopened_document.content)


def saved(document: DesignDocument, path: Path | None = None) -> DesignDocument:
    """Write the text into its file, or into a new one, unless others have changed it.

    :raises ChangedOnDiskError: the file differs from its last reading or writing, or a file of that
        name exists.
    :raises OSError: it cannot be written.
    """
    if path is not None:
        document = replace(document, path=path, content=None)
        if path.exists():
            raise ChangedOnDiskError(f"{path.name} is there already; choose another name")
    ensure_as_read(document)
    content = encoded(document)

    def write(place: Path) -> None:
        place.write_bytes(content)
        ensure_as_read(document)

    write_files({document.path: write}, force=True)
    return replace(document, content=content)
