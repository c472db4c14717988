"""Messages about an experiment file: location, error and remedy."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

Step = str | int
Steps = tuple[Step, ...]
# Errors reported of a file; more are repetitions of one error.
MOST_MESSAGES = 1000
MORE_ERRORS = f"more than {MOST_MESSAGES} errors; mend these first"
# Messages that only differ in the line are told one by one if there are no more than these.
FEW_ALIKE = 3
# Characters that would break a line or reach the terminal as a command.
# Beginning of a line that a workflow of GitHub takes as a command.
COMMAND = re.compile(r"^(\s*)::")
UNPRINTABLE = re.compile(
    "[\x00-\x1f\x7f-\x9f\u2028\u2029\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)


@dataclass(frozen=True, order=True)
class Message:
    """One error of a file; ``line`` and ``column`` count from 1 and are 0 for the whole file.

    ``path`` is the path in the experiment, such as ``positions[1].probes[0]``, or empty, and
    ``steps`` are its keys and indices, if the message is about a value of the file.
    """

    file: str
    line: int
    column: int
    path: str
    text: str
    steps: Steps = field(default=(), compare=False, repr=False)

    def __str__(self) -> str:
        location = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        return in_one_line(": ".join(filter(None, (location, self.text_with_path))))

    @property
    def text_with_path(self) -> str:
        """The text behind the path, without the place in the file."""
        return ": ".join(filter(None, (self.path, self.text)))


class ExperimentError(Exception):
    """An experiment file cannot be used; ``messages`` has all reasons in the order of lines, its
    text the first of those that are alike.
    """

    def __init__(self, messages: Iterable[Message]) -> None:
        self.messages: tuple[Message, ...] = tuple(messages)
        super().__init__("\n".join(map(str, folded(self.messages))))

    def __reduce__(self) -> tuple[type[ExperimentError], tuple[tuple[Message, ...]]]:
        return type(self), (self.messages,)


def folded(messages: Iterable[Message]) -> Iterator[Message]:
    """Yield messages, and only the first of many that differ in the line alone.

    >>> for message in folded([Message("a.csv", n, 1, "", "no x") for n in range(2, 7)]):
    ...     print(message)
    a.csv:2:1: no x (and so in 4 more places, to line 6)
    """
    alike: dict[tuple[str, str, str], list[Message]] = {}
    for message in messages:
        alike.setdefault((message.file, message.path, message.text), []).append(message)
    for first, *others in alike.values():
        if len(others) < FEW_ALIKE:
            yield from (first, *others)
        else:
            where = f"(and so in {len(others)} more places, to line {others[-1].line})"
            yield replace(first, text=f"{first.text} {where}")


def refused(
    file: object, text: str, path: str = "", line: int = 0, column: int | None = None
) -> ExperimentError:
    """Return the error of a file, of a path without a line, or of a line, by default from its
    beginning.
    """
    column = min(line, 1) if column is None else column
    return ExperimentError([Message(str(file), line, column, path, text)])


def _by_number(character: re.Match[str]) -> str:
    number = ord(character[0])
    return f"\\x{number:02x}" if number < 256 else f"\\u{number:04x}"


def in_one_line(text: str) -> str:
    r"""Escape characters that would break or corrupt a line, or make it a command of GitHub.

    >>> in_one_line("a\nb"), in_one_line(" ::error::c")
    ('a\\x0ab', ' \\x3a:error::c')
    """
    return COMMAND.sub(r"\1\\x3a:", UNPRINTABLE.sub(_by_number, text))


def in_lines(text: str) -> str:
    r"""Escape characters that would corrupt a text of several lines.

    >>> in_lines("one\n\x1b[31mtwo")
    'one\n\\x1b[31mtwo'
    """
    return text if text.isprintable() else "\n".join(map(in_one_line, text.split("\n")))


def format_path(steps: Iterable[Step]) -> str:
    """Return a path as written in messages and overrides of variants.

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
