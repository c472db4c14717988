"""Steps of a long computation, for whoever wants to show how far it has come."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

Item = TypeVar("Item")

Report = Callable[[str, int, int], None]
"""Is told what is counted in a step, how many of them are done, and of how many."""


def unreported(what: str, done: int, wanted: int) -> None:
    """Show nothing."""


def counted(items: Iterable[Item], what: str, wanted: int, report: Report) -> Iterator[Item]:
    """The items as they come, each reported as done when the next is asked for.

    >>> list(counted("ab", "letters", 2, print))
    letters 0 2
    letters 1 2
    letters 2 2
    ['a', 'b']
    """
    report(what, 0, wanted)
    for done, item in enumerate(items, start=1):
        yield item
        report(what, done, wanted)
