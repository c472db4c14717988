"""Collection of all errors in an experiment file while it is read."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

from .messages import MORE_ERRORS, MOST_MESSAGES, ExperimentError, Message, Step, Steps, format_path
from .yamltree import Mapping, Mark, Node, Scalar, Sequence, mark_of, to_python, walk, written


@dataclass(eq=False)
class Problems:
    """Messages about the tree below ``root``: errors, ``doubts`` about possible but improbable
    input, and ``notes`` of automatic choices.

    Adding one too many raises all as an ``ExperimentError``, since wording hundreds of thousands
    takes long.
    """

    root: Node
    messages: list[Message] = field(default_factory=list)
    doubts: list[Message] = field(default_factory=list)
    notes: list[Message] = field(default_factory=list)
    _reported: set[Message] = field(default_factory=set)

    def add(self, steps: Steps, text: str, of_key: bool = False) -> None:
        """Add a message about a path; ``of_key`` locates it at the key instead of the value."""
        self.add_at(mark_of(self.root, steps, of_key), steps, text)

    def doubt(self, steps: Steps, text: str) -> None:
        """Add a doubt about a path."""
        self.doubts.append(mark_of(self.root, steps).message(format_path(steps), text))

    def note(self, steps: Steps, text: str) -> None:
        """Add a note about a path."""
        self.notes.append(mark_of(self.root, steps).message(format_path(steps), text))

    def add_at(self, mark: Mark, steps: Steps, text: str) -> None:
        """Add a message about a path at another location, such as in a table."""
        message = replace(mark.message(format_path(steps), text), steps=steps)
        if message in self._reported:
            return
        if len(self.messages) >= MOST_MESSAGES:
            raise ExperimentError([*self.messages, mark.message("", MORE_ERRORS)])
        self._reported.add(message)
        self.messages.append(message)

    def take(self, error: ExperimentError, steps: Steps) -> None:
        """Add the messages about a table that a path names."""
        for message in error.messages:
            if message.line:
                self.messages.append(message)
            else:
                self.add(steps, f"{message.file}: {message.text}")

    def add_empty(self) -> None:
        """Add messages about all empty values."""
        for steps, node in walk(self.root):
            if isinstance(node, Scalar) and node.value is None:
                self.add(steps, "empty; give a value, or leave it out")

    def has_below(self, steps: Steps) -> bool:
        """Return whether a message concerns a path or a path below it."""
        path = format_path(steps)
        return any(
            message.path == path or message.path.startswith((f"{path}.", f"{path}["))
            for message in self.messages
        )


def in_order(
    messages: Iterable[Message], substituted: Iterable[Message], source: Path
) -> list[Message]:
    """Return messages by line, those about the source before those about its tables.

    `substituted` concern values that were substituted for refused ones: other messages at their
    locations are dropped.
    """
    places = {(error.file, error.line, error.column) for error in substituted}
    genuine = [
        message
        for message in messages
        if (message.file, message.line, message.column) not in places
    ]
    return sorted({*genuine, *substituted}, key=lambda error: (error.file != str(source), error))


def written_keys(root: Node, *steps: Step) -> tuple[str, ...]:
    """Return the keys of the mapping at a path as written; empty without a mapping."""
    node = written(root, *steps)
    return tuple(node.items) if isinstance(node, Mapping) else ()


def written_count(root: Node, *steps: Step) -> int:
    """Return the number of entries, valid or not, of a list at a path."""
    node = written(root, *steps)
    return len(node.items) if isinstance(node, Sequence) else 0


def written_texts(root: Node, section: str, key: str) -> list[str | None]:
    """Return the names under a key as written, of all entries of a list, valid or not."""
    return [written_text(root, section, i, key) for i in range(written_count(root, section))]


def written_text(root: Node, *steps: Step) -> str | None:
    """Return a name as written at a path, or None."""
    node = written(root, *steps)
    value = to_python(node) if node is not None else None
    is_name = isinstance(value, str | int) and not isinstance(value, bool)
    return str(value) if is_name else None
