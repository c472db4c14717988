"""Drift of the scale readings over a campaign, linear in time: of the reference point along each
axis, and of the scales.

Scale readings grow by c t along an axis and by s t x along with x, where t is the time from the
mean of all readings: the machine is described at that time. The time is that of the file of
readings if it has one, otherwise the duration of the readings in their order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from ballplate.simulator.design import (
    DesignParts,
    Disturbed,
    Influence,
    InfluenceParameter,
    Readings,
)
from ballplate.simulator.experiment import InfluenceSettings, References
from ballplate.simulator.geometry import AXIS_NAMES, Name
from ballplate.simulator.inputs import (
    DURATION_UNITS,
    Duration,
    Forms,
    LengthDrift,
    NonEmpty,
    RatioDrift,
    Settings,
    Steps,
    Units,
)
from ballplate.simulator.machines import Array
from pydantic import Field

from .temperature import or_unknown

HOUR = 3600.0
TIME = "time"

# What a drift is told for at least, in hours: one within a second still has a size.
LEAST_HOURS = 1e-3


class PointDriftSettings(Settings):
    """Drift of the reference point along an axis."""

    value: LengthDrift = Field(0.0, description="by how much readings grow; default 0 um/h")
    standard_uncertainty: LengthDrift | None = Field(
        None, description="of it; 0 um/h: exactly known; left out: unknown"
    )


class ScaleDriftSettings(Settings):
    """Drift of lengths that the scales indicate."""

    value: RatioDrift = Field(0.0, description="by how much they grow; default 0 ppm/h")
    standard_uncertainty: RatioDrift | None = Field(
        None, description="of it; 0 ppm/h: exactly known; left out: unknown"
    )


class DriftTimesSettings(Settings):
    """Duration of readings for a file without times."""

    set_up: Duration = Field(0.0, description="before each position; default 0 s")
    reading: Duration = Field(15.0, description="of a reading of a ball; default 15 s")
    probe_change: Duration = Field(0.0, description="between probes in a position; default 0 s")


class DriftPositionSettings(Settings):
    """When a position is read."""

    start: Duration | None = Field(
        None, description="when its first reading begins, from any zero on"
    )
    reading: Duration | None = Field(None, description="duration of a reading there")


class DriftSettings(InfluenceSettings):
    """Drift of the readings over the campaign, linear in time."""

    in_order: ClassVar[bool] = True

    kind: Literal["drift"] = Field(description="drift of readings, linear in time")
    axes: Forms[PointDriftSettings, NonEmpty[PointDriftSettings], PointDriftSettings] | None = (
        Field(None, description="of the reference point, the same of each axis, or a list by axis")
    )
    scale: Forms[ScaleDriftSettings, NonEmpty[ScaleDriftSettings], ScaleDriftSettings] | None = (
        Field(None, description="of all scales together, or a list by axis")
    )
    times: DriftTimesSettings | None = Field(
        None, description="durations of readings, for a file without times"
    )
    positions: dict[Name, DriftPositionSettings] | None = Field(
        None, description="name of a position → when it is read"
    )

    def check(self, steps: Steps, positions: Mapping[str, str], references: References) -> None:
        """Report a drift without rates, unknown names, lists of another length and negative
        uncertainties.
        """
        references.require(
            self.axes is not None or self.scale is not None,
            steps,
            "nothing drifts; add axes or scale",
        )
        for name in self.positions or {}:
            references.is_position(name, positions, (*steps, "positions", name))
        for key, amounts in (("axes", self.axes), ("scale", self.scale)):
            references.has_axes(amounts, (*steps, key))
            for amount in amounts if isinstance(amounts, tuple) else [amounts]:
                u = getattr(amount, "standard_uncertainty", None)
                references.is_not_negative(u, (*steps, key, "standard_uncertainty"))

    def influence(self, design: DesignParts) -> Drift:
        """The drift in a design."""
        d, times = design.machine.dimension, self.times or DriftTimesSettings.model_construct()
        none = DriftPositionSettings.model_construct()
        places = [(self.positions or {}).get(name, none) for name in design.positions.names]
        clock = Clock(
            times.set_up,
            times.probe_change,
            tuple(times.reading if amount.reading is None else amount.reading for amount in places),
            tuple(np.nan if amount.start is None else amount.start for amount in places),
        )
        hours = max(float(np.abs(clock.hours(design.readings)).max(initial=0.0)), LEAST_HOURS)
        reach = float(np.abs(design.machine.volume.corners).max())
        parts = []
        parameters = []
        if self.axes is not None:
            listed = self.axes if isinstance(self.axes, tuple) else (self.axes,) * d
            for axis, amount in enumerate(listed):
                words, u = (
                    f"drift along {AXIS_NAMES[axis]}",
                    or_unknown(amount.standard_uncertainty),
                )
                parts.append((axis, False))
                parameters.append(InfluenceParameter(words, "m/h", amount.value, u, hours))
        if self.scale is not None:
            by_axis = isinstance(self.scale, tuple)
            for axis, scale in enumerate(
                self.scale if isinstance(self.scale, tuple) else [self.scale]
            ):
                words = f"scale {AXIS_NAMES[axis]}" if by_axis else "the scales"
                u = or_unknown(scale.standard_uncertainty)
                parts.append((axis if by_axis else -1, True))
                words = f"drift of {words}"
                parameters.append(InfluenceParameter(words, "1/h", scale.value, u, hours * reach))
        return Drift(clock, tuple(parts), tuple(parameters))


@dataclass(frozen=True)
class Clock:
    """Times of readings in seconds: durations of set-ups and changes of probe and, by position,
    the duration of a reading and the begin of the first, NaN if that follows from earlier ones.
    """

    set_up: float
    probe_change: float
    reading: tuple[float, ...]
    starts: tuple[float, ...]

    def hours(self, readings: Readings) -> Array:
        """Return the times (m,) of all readings in their order, from their mean, in hours."""
        beside = readings.beside or {}
        seconds = beside.get(TIME, np.full(len(readings), np.nan))
        if np.isnan(seconds).any():
            seconds = self.seconds(readings)
        return (seconds - np.average(seconds, weights=readings.repeats)) / HOUR

    def seconds(self, readings: Readings) -> Array:
        """Seconds (m,) at which readings are made, one after the other, repeats together."""
        position, probe = readings.position, readings.probe
        is_next = np.append(True, position[1:] != position[:-1])
        is_changed = np.append(False, probe[1:] != probe[:-1]) & ~is_next
        before = self.set_up * is_next + self.probe_change * is_changed
        seconds_taken = np.array(self.reading)[position] * readings.repeats
        seconds = np.cumsum(before + seconds_taken) - 0.5 * seconds_taken
        positions_seen = set()
        for first in np.flatnonzero(is_next).tolist():
            start = self.starts[position[first]]
            if not np.isnan(start) and int(position[first]) not in positions_seen:
                seconds[first:] += start - (seconds[first] - 0.5 * seconds_taken[first])
            positions_seen.add(int(position[first]))
        return np.asarray(seconds)


def even_clock(positions: int) -> Clock:
    """A clock by which each reading takes as long as the others."""
    return Clock(0.0, 0.0, (1.0,) * positions, (np.nan,) * positions)


@dataclass(frozen=True)
class Drift(Influence):
    """Drifts by a clock; `parts` (p,) are the axes of parameters, -1 for all, and flags of
    scales.
    """

    clock: Clock
    parts: tuple[tuple[int, bool], ...]
    listed: tuple[InfluenceParameter, ...]

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        return self.listed

    @property
    def columns(self) -> Units:
        """The time of each reading, from any zero on."""
        return {TIME: DURATION_UNITS}

    @property
    def column(self) -> str:
        """Name of the column with the hours of its clock."""
        return f"hours by {self.clock}"

    def in_sequence(self, readings: Readings) -> Mapping[str, Array]:
        """Hours from the mean of all readings on."""
        return {self.column: self.clock.hours(readings)}

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """Return the shifts: the excess of the scales is subtracted, so locations grow with it."""
        m, d = at.x.shape
        hours = at.column(self.column)
        derivative = np.zeros((m, d, len(self.parts)))
        for k, (axis, of_scale) in enumerate(self.parts):
            for j in range(d) if axis < 0 else (axis,):
                derivative[:, j, k] = hours * at.x[:, j] if of_scale else hours
        values = np.array([axis_amounts.value for axis_amounts in self.listed], float)
        return derivative @ values, derivative


SETTINGS = DriftSettings
