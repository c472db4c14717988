"""Limits on the cost and the contents of a selection."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from ballplate.simulator.experiment import (
    AtMost,
    Candidate,
    ChangeTimes,
    Experiment,
    Position,
    placed_only,
)
from ballplate.simulator.inputs import Flags, Integers, number_of
from ballplate.simulator.machines import Array

from .changeover import Setup, changeover, kind_of

HOUR = 3600.0

# Rounding of sums of times.
SLACK = 1e-6


@dataclass(frozen=True)
class Budget:
    """Limits: seconds of laboratory time, readings, positions; each optional."""

    seconds: float | None = None
    readings: int | None = None
    positions: int | None = None

    def __str__(self) -> str:
        words = []
        if self.seconds is not None:
            words.append(f"{self.seconds / HOUR:.4g} h")
        for value, word in ((self.readings, "reading"), (self.positions, "position")):
            if value is not None:
                words.append(number_of(value, word))
        return ", ".join(words)


@dataclass(frozen=True)
class Spent:
    """Cost of a selection: seconds with changes between positions, readings and positions."""

    seconds: float
    readings: int
    positions: int

    @property
    def budget(self) -> Budget:
        """The budget that just allows it."""
        return Budget(self.seconds, self.readings, self.positions)

    def is_within(self, budget: Budget) -> bool:
        """True if a limit allows it."""
        return (
            (budget.seconds is None or self.seconds <= budget.seconds + SLACK)
            and (budget.readings is None or self.readings <= budget.readings)
            and (budget.positions is None or self.positions <= budget.positions)
        )


@dataclass(frozen=True)
class Constraints:
    """Costs of candidates and limits on them.

    `seconds`, `readings` and `positions` (n,) are those of each candidate, `kinds` the change-over
    classes (absent for calibration items), `must` the required candidates. `done` candidates cost
    nothing more; the limit applies to the rest. One member of each set of `at_least` is required.
    The candidate `first` completes a position whose artefact is still set up: it precedes all
    others.
    """

    budget: Budget
    seconds: Array
    readings: Integers
    positions: Integers
    kinds: tuple[Setup | None, ...]
    changes: ChangeTimes
    must: frozenset[int]
    at_most: tuple[AtMost, ...]
    done: frozenset[int] = frozenset()
    at_least: tuple[tuple[int, ...], ...] = ()
    first: int | None = None

    @property
    def count(self) -> int:
        return len(self.seconds)

    @cached_property
    def _of_kinds(self) -> dict[Setup | None, Flags]:
        """Flags (n,) of the candidates of each change-over class."""
        return {
            kind: np.array([other == kind for other in self.kinds])
            for kind in dict.fromkeys(self.kinds)
        }

    def spent(self, chosen: Collection[int]) -> Spent:
        """Return the cost of a selection without completed readings."""
        added = sorted(set(chosen) - self.done)
        seconds = float(self.seconds[added].sum()) + changeover(
            self._kinds(added), self.changes, self._first(added)
        )
        return Spent(seconds, int(self.readings[added].sum()), int(self.positions[added].sum()))

    def _kinds(self, members: Iterable[int]) -> list[Setup]:
        return [kind for k in members if k != self.first and (kind := self.kinds[k]) is not None]

    def _first(self, members: Collection[int]) -> Setup | None:
        return None if self.first is None or self.first not in members else self.kinds[self.first]

    def allows(self, chosen: Collection[int]) -> bool:
        """True if a selection, or an extension by missing members of `at_least`, is within all
        limits.
        """
        members = set(chosen)
        return (
            self.must <= members
            and all(
                len(members.intersection(limit.members)) <= limit.count for limit in self.at_most
            )
            and self.spent(members).is_within(self.budget)
        )

    def can_read(self, members: Collection[int]) -> bool:
        """True if one of some candidates is a position that can be read in addition to required
        ones.
        """
        may_be = {*self.must, *self.additions(self.must).tolist()}
        return any(self.kinds[k] is not None for k in may_be.intersection(members))

    def forbids(self, members: Collection[int]) -> bool:
        """True if no limit of time would allow any of some positions."""
        return not replace(self, budget=Budget()).can_read(members)

    def additions(self, chosen: Collection[int]) -> Integers:
        """Candidates that a selection, which keeps to the limits itself, may be extended by, one at
        a time.
        """
        members = set(chosen)
        allowed = np.ones(self.count, bool)
        allowed[list(members)] = False
        for limit in self.at_most:
            if len(members.intersection(limit.members)) >= limit.count:
                allowed[list(limit.members)] = False
        added, budget = sorted(members - self.done), self.budget
        if budget.readings is not None:
            allowed &= self.readings <= budget.readings - int(self.readings[added].sum())
        if budget.positions is not None:
            allowed &= self.positions <= budget.positions - int(self.positions[added].sum())
        if budget.seconds is not None:
            seconds_left = budget.seconds + SLACK - float(self.seconds[added].sum())
            kinds, first = self._kinds(added), self._first(added)
            is_first = np.arange(self.count) == self.first
            for kind, is_of_kind in self._of_kinds.items():
                within = seconds_left - changeover(
                    kinds if kind is None else [*kinds, kind], self.changes, first
                )
                allowed &= ~is_of_kind | (self.seconds <= within) | is_first
            if self.first is not None and first is None:
                within = seconds_left - changeover(kinds, self.changes, self.kinds[self.first])
                allowed[self.first] &= bool(self.seconds[self.first] <= within)
        return np.flatnonzero(allowed)

    def linear(self) -> tuple[Any, Array, Array, Array]:
        """Limits as rows A v <= b with bounds low <= v <= high; every selection that keeps to the
        limits fulfils them.

        Variables are the candidates, then the groups of positions between which the plane or
        artefact changes, each at least as large as any of its members. Changes of probe between
        positions are left out.
        """
        from scipy.sparse import csr_array, vstack

        n = self.count
        groups = sorted({(k.artefact, k.plane) for k in self.kinds if k is not None})
        timed = self.budget.seconds is not None and self.changes.plane > 0 and len(groups) > 1
        size = n + (len(groups) if timed else 0)
        every = np.arange(n)
        is_left = ~np.isin(every, list(self.done))
        bounded: list[tuple[Any, float]] = [
            (cost * is_left, limit)
            for cost, limit in (
                (self.seconds, self.budget.seconds),
                (self.readings, self.budget.readings),
                (self.positions, self.budget.positions),
            )
            if limit is not None
        ]
        bounded += [(np.isin(every, limit.members), limit.count) for limit in self.at_most]
        bounded += [(-1.0 * np.isin(every, members), -1.0) for members in self.at_least]
        rows = np.zeros((len(bounded), size))
        rows[:, :n] = np.reshape([row for row, _ in bounded], (-1, n))
        limits = np.array([limit for _, limit in bounded], float)
        if timed:
            rows[0, n:] = self.changes.plane
            # The first position needs no change.
            limits[0] += self.changes.plane + SLACK
        # Positions that need a change of plane or artefact, and the groups that they are in.
        moved = [
            (k, n + groups.index((kind.artefact, kind.plane)))
            for k, kind in enumerate(self.kinds)
            if timed and kind is not None and k not in self.done
        ]
        columns = np.reshape(moved, (-1, 2)).astype(int)
        entries = np.tile([1.0, -1.0], len(moved))
        places = np.repeat(np.arange(len(moved)), 2), columns.ravel()
        linked = csr_array((entries, places), shape=(len(moved), size))
        matrix = vstack([csr_array(rows), linked], format="csr")
        limits = np.append(limits, np.zeros(len(moved)))
        low = np.zeros(size)
        low[list(self.must)] = 1.0
        return matrix, limits, low, np.ones(size)


def constraints(
    candidates: Sequence[Candidate],
    changes: ChangeTimes,
    budget: Budget,
    must: Collection[int] = (),
    at_most: Sequence[AtMost] = (),
    done_indices: Collection[int] = (),
    at_least: Sequence[tuple[int, ...]] = (),
    first: int | None = None,
) -> Constraints:
    """Return constraints of a pool's candidates; `first` completes a position and is not counted
    as a further one.
    """
    is_position = [
        isinstance(candidate.item, Position) and k != first
        for k, candidate in enumerate(candidates)
    ]
    return Constraints(
        budget,
        np.array([candidate.seconds for candidate in candidates], float),
        np.array([candidate.readings for candidate in candidates], np.int64),
        np.array(is_position, np.int64),
        tuple(
            kind_of(candidate) if isinstance(candidate.item, Position) else None
            for candidate in candidates
        ),
        changes,
        frozenset(must) | frozenset(done_indices),
        tuple(at_most),
        frozenset(done_indices),
        tuple(at_least),
        first,
    )


def with_chosen(experiment: Experiment, chosen: Sequence[Candidate]) -> Experiment:
    """The experiment with chosen candidates, in their order, as its positions, and as further
    calibration.
    """
    items = [candidate.item for candidate in chosen]
    positions = tuple(item for item in items if isinstance(item, Position))
    calibration = tuple(item for item in items if not isinstance(item, Position))
    return placed_only(
        replace(
            experiment, positions=positions, calibration=(*experiment.calibration, *calibration)
        )
    )
