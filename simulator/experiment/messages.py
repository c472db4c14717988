"""Messages about an experiment file: where, what is wrong and what would be right, all of them at once."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

Step = str | int
Steps = tuple[Step, ...]


@dataclass(frozen=True, order=True)
class Message:
    """One error of a file. ``line`` and ``column`` count from 1 and are 0 where the whole file is meant.

    ``path`` is the place in the experiment, such as ``positions[1].probes[0]``; empty where there is none.
    """

    file: str
    line: int
    column: int
    path: str
    text: str

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        return ": ".join(part for part in (place, self.path, self.text) if part)


class ExperimentError(Exception):
    """An experiment file cannot be used; ``messages`` has every reason found, in the order of lines."""

    def __init__(self, messages: Iterable[Message]) -> None:
        self.messages: tuple[Message, ...] = tuple(messages)
        super().__init__("\n".join(str(message) for message in self.messages))

    def __reduce__(self) -> tuple[type[ExperimentError], tuple[tuple[Message, ...]]]:
        return type(self), (self.messages,)


def format_path(steps: Iterable[Step]) -> str:
    """Write a path as in messages and in overrides of variants.

    >>> format_path(("positions", 1, "probes", 0)), format_path(("artefacts", "ball bar"))
    ('positions[1].probes[0]', 'artefacts[ball bar]')
    """
    path = ""
    for step in steps:
        if isinstance(step, str) and re.fullmatch(r"[^\s.\[\]]+", step):
            path += f".{step}" if path else step
        else:
            path += f"[{step}]"
    return path
