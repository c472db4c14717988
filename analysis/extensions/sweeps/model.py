"""A sweep: an experiment, its axes, and the cells, which are combinations of their values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ballplate.simulator.inputs import OPENED, Mark, Node, Trust

# Contents of the base file and its variants, by their names.
Trees = dict[str | None, Node]

Unit = Literal["m", "rad", "1", "h", ""]


# A limit of a plan, by its name in `planning.Budget`.
Limit = tuple[Literal["seconds", "readings", "positions"], float]


@dataclass(frozen=True)
class Planning:
    """How each case chooses from the pool; `limits` are those that all cases have."""

    criterion: str
    seed: int
    limits: tuple[Limit, ...]


@dataclass(frozen=True, eq=False)
class Choice:
    """One value of an axis: `changes` are paths with their new nodes, or `variant` replaces the
    variant.

    `kept` is the path of a list with the names of the entries to keep, `limit` one of a plan,
    `estimator` one that is compared. `value` is a number in metres, radians, hours or without unit
    if the axis has such values, otherwise NaN.
    """

    label: str
    changes: tuple[tuple[str, Node, Mark], ...]
    value: float = float("nan")
    variant: str | None = None
    kept: tuple[str, tuple[str, ...], Mark] | None = None
    limit: Limit | None = None
    estimator: str = ""

    @property
    def paths(self) -> tuple[str, ...]:
        """Changed paths."""
        return (
            *(path for path, _, _ in self.changes),
            *([] if self.kept is None else [self.kept[0]]),
        )


@dataclass(frozen=True, eq=False)
class SweepAxis:
    """Axis of a sweep; `unit` is that of the choices' values, empty unless they are numbers."""

    name: str
    choices: tuple[Choice, ...]
    unit: Unit

    @property
    def column(self) -> str:
        """Name of the axis in a table, with the unit if there is one."""
        return f"{self.name}_{self.unit}" if self.unit in ("m", "rad") else self.name


@dataclass(frozen=True, eq=False)
class Sweep:
    """A sweep. `trees` are the base file's variants by name, or the whole file under None.

    `cells` are indices of choices, one for each axis, in the order of the file with the last axis
    fastest. `digest` is a hash of all files of the sweep, `code` of those that an error model in
    Python may read, empty without one. Named files must be in the sweep's folder, its base's, or
    `folders`; all have the same `trust`. With `planning` each case chooses its positions.
    """

    source: Path
    title: str
    base: Path
    trees: Trees
    variant: str | None
    axes: tuple[SweepAxis, ...]
    cells: tuple[tuple[int, ...], ...]
    trials: int | None
    seed: int
    record: tuple[str, ...]
    digest: str = ""
    code: str = ""
    folders: tuple[Path, ...] = ()
    trust: Trust = OPENED
    planning: Planning | None = None

    def choices(self, number: int) -> tuple[Choice, ...]:
        """Choices of a cell."""
        return tuple(axis.choices[k] for axis, k in zip(self.axes, self.cells[number], strict=True))

    def estimators(self, number: int) -> tuple[str, ...]:
        """The estimator of a cell, and those that may share its data sets with the full one; empty
        where none is compared.
        """
        own = "".join(choice.estimator for choice in self.choices(number))
        if own != "full":
            return (own, own) if own else ()
        names = {choice.estimator for axis in self.axes for choice in axis.choices}
        return (own, *sorted((names | {"distances"}) - {"", own}))

    def label(self, number: int) -> str:
        """Axes of a cell with their values."""
        return ", ".join(
            f"{axis.name} {choice.label}"
            for axis, choice in zip(self.axes, self.choices(number), strict=True)
        )
