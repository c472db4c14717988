"""Calibrated co-ordinates of balls in the frame of their plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ...geometry.ball_layouts import BallLayout, BallNames, Name, frozen
from ...geometry.motions import AXIS_NAMES
from ...inputs.messages import ExperimentError, Steps
from ...inputs.quantities import PositiveLength
from ...inputs.settings import Forms, Settings, Text, hint, listing
from ...inputs.tables import read_table
from ...machines.protocol import Array, Integers
from ..arrays import Design
from ..lookup import References
from .balls import BallObservations
from .calibration import FAR_FROM_DRAWING, Calibration

# What balls may be off a plane that they are drawn in, in metres.
HARDLY_FLAT = 1e-3


@dataclass(frozen=True)
class CalibratedCoordinates(BallObservations):
    """Calibrated ball co-ordinates in the artefact's frame; arrays (m,), metres."""

    word: ClassVar[str] = "coordinate"
    scales: ClassVar[bool] = True

    ball: Integers
    axis: Integers
    value: Array
    uncertainty: Array

    @property
    def balls(self) -> Integers:
        return self.ball[:, None]

    @property
    def along(self) -> Integers:
        return self.axis

    def values(self, balls: Array) -> tuple[Array, Array]:
        return balls[..., self.ball, self.axis], np.eye(balls.shape[-1])[self.axis][:, None]

    def name(self, design: Design, k: int) -> str:
        return f"{AXIS_NAMES[self.axis[k]]} of ball {design.ball_label(int(self.ball[k]))}"

    def fixing(self) -> tuple[Integers, Integers]:
        return self.ball, self.axis


def no_coordinates() -> CalibratedCoordinates:
    """No calibrated co-ordinates."""
    none, empty = np.zeros(0, np.int64), np.zeros(0)
    return CalibratedCoordinates(none, none, empty, empty)


def flat(layout: BallLayout, first: int, uncertainty: float) -> CalibratedCoordinates:
    """Co-ordinates out of the plane as drawn, of an artefact whose balls begin at `first` and of
    which nothing else tells them.
    """
    count = len(layout.names)
    drawn = layout.coordinates[:, 2]
    balls = first + np.arange(count, dtype=np.int64)
    return CalibratedCoordinates(balls, np.full(count, 2), drawn, np.full(count, uncertainty))


@dataclass(frozen=True, eq=False)
class CoordinateCalibration(Calibration):
    """Calibrated ball co-ordinates in the artefact's frame.

    ``balls``: (k,) indices. ``axes``: the a calibrated axes, 0 to 2. ``values``: (k, a) metres,
    nominal unless ``certified``. ``standard_uncertainties``: (a,) metres.
    """

    artefact: str
    balls: NDArray[np.intp]
    axes: tuple[int, ...]
    values: Array
    certified: bool
    standard_uncertainties: Array
    kind: Literal["coordinates"] = "coordinates"

    def observed(self, first: int) -> CalibratedCoordinates:
        count = len(self.axes)
        return CalibratedCoordinates(
            np.repeat(first + self.balls, count),
            np.tile(np.array(self.axes, np.int64), len(self.balls)),
            self.values.ravel(),
            np.tile(self.standard_uncertainties, len(self.balls)),
        )

    def names(self, layout: BallLayout) -> list[tuple[str, str]]:
        return [(layout.names[ball], AXIS_NAMES[axis]) for ball in self.balls for axis in self.axes]

    def doubt(self, layout: BallLayout) -> str:
        return far_spread(self.values, layout.coordinates[self.balls][:, list(self.axes)])


CalibratedBalls = Forms[Literal["all", "corners"], BallNames, BallNames]


class SomeAxisLengthsSettings(Settings):
    """A length above zero for some axes."""

    x: PositiveLength | None = Field(None, description="along x; omitted: x is not calibrated")
    y: PositiveLength | None = Field(None, description="along y; omitted: y is not calibrated")
    z: PositiveLength | None = Field(None, description="along z; omitted: z is not calibrated")


class CoordinatesSettings(Settings):
    """Calibrated co-ordinates of balls in their artefact's frame."""

    kind: Literal["coordinates"] = Field(description="calibrated co-ordinates of balls")
    artefact: Name | None = Field(
        None, description="name of the artefact; optional if there is exactly one"
    )
    balls: CalibratedBalls = Field("all", description="all (default), corners, or a list of balls")
    standard_uncertainty: Forms[PositiveLength, PositiveLength, SomeAxisLengthsSettings] = Field(
        description="of every co-ordinate, or per axis of the artefact: {x: …, y: …}"
    )
    values: Text | None = Field(
        None,
        description="CSV file with columns ball, x_mm, y_mm, z_mm; default: nominal co-ordinates",
    )


def read_coordinates(
    settings: CoordinatesSettings, artefact: str, steps: Steps, references: References
) -> CoordinateCalibration | None:
    layout, dimension = references.layouts[artefact], references.dimension
    uncertainty = settings.standard_uncertainty
    by_axis: dict[str, float] = (
        dict.fromkeys(AXIS_NAMES[:dimension], uncertainty)
        if isinstance(uncertainty, float)
        else uncertainty.stated
    )
    place = (*steps, "standard_uncertainty")
    is_right = references.require(
        bool(by_axis), place, "calibrates no axis; give at least one, such as {x: 0.2 um}"
    )
    text = "has no meaning in two dimensions; remove it"
    is_right &= references.require(dimension != 2 or "z" not in by_axis, (*place, "z"), text)
    balls = references.balls(settings.balls, layout, (*steps, "balls"))
    if balls is None or not is_right or dimension is None:
        return None
    values = _certified_coordinates(
        settings, balls, list(by_axis), layout, (*steps, "values"), references
    )
    if values is None:
        return None
    axes = tuple(AXIS_NAMES.index(axis) for axis in by_axis)
    return CoordinateCalibration(
        artefact,
        balls,
        axes,
        frozen(values),
        settings.values is not None,
        frozen(list(by_axis.values())),
    )


def _certified_coordinates(
    settings: CoordinatesSettings,
    balls: NDArray[np.intp],
    axes: list[str],
    layout: BallLayout,
    steps: Steps,
    references: References,
) -> Array | None:
    problems = references.problems
    if settings.values is None:
        return layout.coordinates[balls][:, [AXIS_NAMES.index(axis) for axis in axes]]
    try:
        others = [axis for axis in AXIS_NAMES if axis not in axes]
        rows = read_table(references.folder / settings.values, ["ball"], axes, others)
    except ExperimentError as error:
        problems.take(error, steps)
        return None
    before, known = len(problems.messages), set(layout.names)
    by_ball: dict[str, tuple[float, ...]] = {}
    for row in rows:
        name = row.texts[0]
        if name not in known:
            problems.add_at(row.mark, steps, f'unknown ball "{name}"; {hint(name, layout.names)}')
        if name in by_ball:
            problems.add_at(
                row.mark, steps, f'ball "{name}" is listed twice; remove one of the two lines'
            )
        by_ball[name] = row.lengths[: len(axes)]
    missing = [layout.names[i] for i in balls if layout.names[i] not in by_ball]
    if missing and len(problems.messages) == before:
        problems.add(
            steps, f"no co-ordinates for {listing(missing)}; add them, or leave them out of balls"
        )
    if len(problems.messages) > before:
        return None
    found = np.array([by_ball[layout.names[i]] for i in balls])
    if text := far_spread(
        found, layout.coordinates[balls][:, [AXIS_NAMES.index(axis) for axis in axes]]
    ):
        problems.add(steps, text)
        return None
    return found


def far_spread(values: Array, drawn: Array) -> str:
    """What is wrong with certified co-ordinates (m, axes) whose spread is not that of the drawing;
    empty if nothing is.

    Where their axes begin may be another place than in the drawing.
    """
    # Root mean squares. A plate that is flat as drawn is not quite so as certified.
    found, expected = (
        float(np.sqrt(((one - one.mean(axis=0)) ** 2).sum(axis=1).mean()))
        for one in (values, drawn)
    )
    if abs(found - expected) <= FAR_FROM_DRAWING * expected + HARDLY_FLAT:
        return ""
    times = f"{found / expected:.3g} times as far apart as in the artefact's drawing"
    return f"the balls of these co-ordinates are {times}; correct one of the two"
