"""Set-ups of positions that have been read in part or in full, and how they are named."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ballplate.simulator.experiment import Candidate, Position

# How what completes a position, and what sets it up again, is named.
REST = "rest of "
AGAIN = re.compile(r"(.*) again(?: ([1-9][0-9]*))?", re.DOTALL)


@dataclass(frozen=True)
class SetUp:
    """Readings of one set-up of the candidate `base` of a pool.

    `read` has the readings taken, `whole` the planned ones too, and `rest` the missing ones, if
    any are missing. `is_last` marks the last set-up.
    """

    base: int
    read: Candidate
    whole: Candidate
    rest: Candidate | None
    is_last: bool

    @property
    def name(self) -> str:
        return self.read.name


def renamed(candidate: Candidate, name: str) -> Candidate:
    """A position under another name."""
    if candidate.name == name:
        return candidate
    settings = {**candidate.settings, "name": name}
    return replace(
        candidate,
        name=name,
        item=replace(position_of(candidate), name=name),
        settings=settings,
        drawn=False,
    )


def next_name(name: str, names_taken: Sequence[str]) -> str:
    """Return an unused name for a further set-up of a position.

    >>> next_name("low", ["low"]), next_name("low", ["low", "low again"])
    ('low again', 'low again 2')
    """
    name_found, k = f"{name} again", 1
    while name_found in names_taken:
        k += 1
        name_found = f"{name} again {k}"
    return name_found


def base_name(name: str) -> str:
    """The name of a position that another set-up of it has, too.

    >>> base_name("low again 2"), base_name("low")
    ('low', 'low')
    """
    again = AGAIN.fullmatch(name)
    return name if again is None else again[1]


def position_of(candidate: Candidate) -> Position:
    """The position that a candidate is."""
    assert isinstance(candidate.item, Position)
    return candidate.item
