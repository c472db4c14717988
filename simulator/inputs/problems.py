"""Collection of the errors in an experiment file while it is read, so that all are reported at
once.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from .messages import MORE_ERRORS, MOST_MESSAGES, ExperimentError, Message, Step, Steps, format_path
from .yamltree import Mapping, Mark, Node, Scalar, Sequence, mark_of, to_python, walk, written


@dataclass(eq=False)
class Problems:
    """Messages about the tree below ``root``; ``doubts`` are about what is possible, and unlikely
    to be meant, ``notes`` about what was found by itself.

    Adding one too many raises an ``ExperimentError`` with all of them: each takes time to word, and
    a file may have hundreds of thousands.
    """

    root: Node
    messages: list[Message] = field(default_factory=list)
    doubts: list[Message] = field(default_factory=list)
    notes: list[Message] = field(default_factory=list)
    _known: set[Message] = field(default_factory=set)

    def add(self, steps: Steps, text: str, of_key: bool = False) -> None:
        """Add a message about a path; ``of_key`` places it at the key instead of the value."""
        self.add_at(mark_of(self.root, steps, of_key), steps, text)

    def doubt(self, steps: Steps, text: str) -> None:
        """Add a doubt about a path."""
        self.doubts.append(mark_of(self.root, steps).message(format_path(steps), text))

    def note(self, steps: Steps, text: str) -> None:
        """Add a note about a path."""
        self.notes.append(mark_of(self.root, steps).message(format_path(steps), text))

    def add_at(self, mark: Mark, steps: Steps, text: str) -> None:
        """Add a message about a path, placed elsewhere, such as in a table that the path names."""
        message = mark.message(format_path(steps), text)
        if message in self._known:
            return
        if len(self.messages) >= MOST_MESSAGES:
            raise ExperimentError([*self.messages, mark.message("", MORE_ERRORS)])
        self._known.add(message)
        self.messages.append(message)

    def take(self, error: ExperimentError, steps: Steps) -> None:
        """Add the messages about a table that a path names."""
        for message in error.messages:
            if message.line:
                self.messages.append(message)
            else:
                self.add(steps, f"{message.file}: {message.text}")

    def add_empty(self) -> None:
        """Add a message about everything that is empty."""
        for steps, node in walk(self.root):
            if isinstance(node, Scalar) and node.value is None:
                self.add(steps, "empty; give a value, or leave it out")

    def has_below(self, steps: Steps) -> bool:
        """Tell whether there is a message about a path or something below it."""
        path = format_path(steps)
        return any(
            message.path == path or message.path.startswith((f"{path}.", f"{path}["))
            for message in self.messages
        )


def in_order(
    messages: Iterable[Message], made_up: Iterable[Message], source: Path
) -> list[Message]:
    """Messages by line, those about the source before those about its tables.

    What stands where one of `made_up` is was made up for it, and nobody should be told about it.
    """
    refused = {(one.file, one.line, one.column) for one in made_up}
    found = [one for one in messages if (one.file, one.line, one.column) not in refused]
    return sorted({*found, *made_up}, key=lambda one: (one.file != str(source), one))


def written_keys(root: Node, *steps: Step) -> tuple[str, ...]:
    """Return the keys of the mapping at a path as written, none where there is no mapping."""
    node = written(root, *steps)
    return tuple(node.items) if isinstance(node, Mapping) else ()


def written_count(root: Node, *steps: Step) -> int:
    """Return the number of entries of a list at a path, right or wrong."""
    node = written(root, *steps)
    return len(node.items) if isinstance(node, Sequence) else 0


def written_text(root: Node, *steps: Step) -> str | None:
    """Return a name as written at a path, or None where there is none."""
    node = written(root, *steps)
    value = to_python(node) if node is not None else None
    is_name = isinstance(value, str | int) and not isinstance(value, bool)
    return str(value) if is_name else None
