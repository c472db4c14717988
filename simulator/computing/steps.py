"""What a computation reports: steps of its progress, and failures that are not of the input."""

from __future__ import annotations

import errno
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

Item = TypeVar("Item")


@dataclass(frozen=True)
class ProgressStep:
    """Progress of a step: its name, the number done, and the total.

    `before` were done in an earlier run; `remark` is an additional text. Where it `can_end`, the
    report may raise `EnoughError`.

    >>> print(ProgressStep("data sets", 512, 2048, "accurate to 1.5 %"))
    512 of 2048 data sets, accurate to 1.5 %
    """

    what: str
    done: int
    wanted: int
    remark: str = ""
    before: int = 0
    can_end: bool = False

    def __str__(self) -> str:
        remark = f", {self.remark}" if self.remark else ""
        return f"{self.done} of {self.wanted} {self.what}{remark}"


Report = Callable[[ProgressStep], object]
"""Receives each step of the progress; see `EnoughError`."""


class EnoughError(Exception):
    """Raised by a report to end a search with the best result so far."""


def unreported(step: ProgressStep) -> None:
    """Ignore progress."""


def counted(items: Iterable[Item], unit_name: str, wanted: int, report: Report) -> Iterator[Item]:
    """Yield the items, each reported as done when the next is requested.

    >>> list(counted("ab", "letters", 2, print))
    0 of 2 letters
    1 of 2 letters
    2 of 2 letters
    ['a', 'b']
    """
    report(ProgressStep(unit_name, 0, wanted))
    for count_done, item in enumerate(items, start=1):
        yield item
        report(ProgressStep(unit_name, count_done, wanted))


class InternalError(Exception):
    """The program has found an error in itself; the message states the contradiction."""


WITH_SIZE = re.compile(r"Unable to allocate ([0-9.]+ [KMGTPE]?i?B|[0-9]+ bytes)")


def want_of_memory(error: BaseException) -> str | None:
    """Return the end of a message about lack of memory, if the error is one."""
    if not isinstance(error, MemoryError) and getattr(error, "errno", None) != errno.ENOMEM:
        return None
    match = WITH_SIZE.search(str(error))
    size = f": there is no room for another {match[1]}" if match else ""
    return f"needs more memory than is available{size}"
