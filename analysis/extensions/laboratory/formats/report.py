"""Content of a report of a measuring program in a common form: features with their centres."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Literal

from ballplate.simulator.inputs import (
    MORE_ERRORS,
    MOST_MESSAGES,
    ExperimentError,
    Mark,
    Message,
    QuantityError,
    metres_or_radians,
)
from ballplate.simulator.machines import Array

Place = tuple[float, float, float]
System = Literal["machine", "part", "unstated"]

AXES = "XYZ"
SPHERE, CIRCLE, POINT = "sphere", "circle", "point"
# Features of which the centre may be a reading, or a point on a ball.
LOCATED = (SPHERE, CIRCLE, POINT)
# Of a feature whose report tells no kind, but three co-ordinates.
UNSTATED = "feature"


@dataclass(frozen=True, eq=False)
class Feature:
    """A measured feature: its centre, or points (n, 3) on its surface, in metres.

    `lacks` states why there is neither. `probe` is the label of the active sensor, possibly empty,
    `system` the type of its co-ordinate system, and `of` the system's name. `dimension` is the
    report's name of the characteristic, if it has one. `marks` are texts beside it, by name, that
    may tell in which run of the program it was measured, and `run` is that run.
    """

    mark: Mark
    name: str
    kind: str
    centre: Place | None = None
    points: Array | None = None
    probe: str = ""
    system: System = "unstated"
    of: str = ""
    lacks: str = ""
    dimension: str = ""
    marks: Mapping[str, str] = field(default_factory=dict)
    run: str = ""


@dataclass(frozen=True)
class Report:
    """Features of a file in their order; `others` counts skipped entries that are not measured
    features.

    `remarks` are notes for the user of the features.
    """

    file: str
    title: str
    features: tuple[Feature, ...]
    others: Mapping[str, int] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Format:
    """A format by its option; `title` is its name in sentences.

    `recognises` is true for the beginning of a file of the format, and `read` returns its report,
    with a factor of metres per unit for files without a unit.
    """

    name: str
    title: str
    recognises: Callable[[str], bool]
    read: Callable[[bytes, str, Fraction | None], Report]


@dataclass
class Located:
    """A feature whose co-ordinates by axis are collected from rows of a table."""

    feature: Feature
    axes: dict[str, float] = field(default_factory=dict)

    def complete(self) -> Feature:
        """Return the feature, without a centre if an axis is missing."""
        missing = [axis for axis in AXES if axis not in self.axes]
        if missing:
            return replace(self.feature, lacks=f"no row {' or '.join(missing)}")
        return replace(self.feature, centre=(self.axes["X"], self.axes["Y"], self.axes["Z"]))


@dataclass
class ReportProblems:
    """Messages about a file, raised together."""

    file: str
    messages: list[Message] = field(default_factory=list)

    def add(self, mark: Mark, text: str) -> None:
        """Add a message about a location.

        :raises ExperimentError: there are too many.
        """
        if len(self.messages) >= MOST_MESSAGES:
            raise ExperimentError([*self.messages, mark.message("", MORE_ERRORS)])
        self.messages.append(mark.message("", text))

    def finish(self) -> None:
        """:raises ExperimentError: there is a message."""
        if self.messages:
            raise ExperimentError(self.messages)

    def length(self, text: str, factor: Fraction, mark: Mark) -> float:
        """A number of a unit in metres, NaN after a message."""
        try:
            return metres_or_radians(text, factor)
        except QuantityError as error:
            self.add(mark, str(error))
            return math.nan

    def place(self, texts: list[str], factor: Fraction, mark: Mark) -> Place:
        """Three co-ordinates in metres, NaN after a message."""
        x, y, z = (self.length(text, factor, mark) for text in texts)
        return x, y, z
