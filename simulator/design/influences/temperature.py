"""Temperature of artefacts and scales: both expand from a reference temperature on.

A ball at y in its artefact's frame is at R (1 + b t) y + o, and a scale reading x stands for x (1 +
c s), where b and c are coefficients of thermal expansion and t and s what artefact and scales are
above the reference temperature. Products of the errors of a coefficient and of a temperature are
neglected. A file of readings may have temperatures of each reading in place of those of its
position.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np
from pydantic import Field

from ...geometry.ball_layouts import Name
from ...inputs.messages import Steps
from ...inputs.quantities import Expansion, Temperature, TemperatureDifference
from ...inputs.settings import Forms, NonEmpty, Settings
from ...machines.protocol import Array, Unit
from ..lookup import References
from ..objects import Flags
from .protocol import (
    DesignParts,
    Disturbed,
    Influence,
    InfluenceParameter,
    InfluenceSettings,
    or_unknown,
)

REFERENCE = 20.0

# Columns of readings with temperatures of their own, and their unit.
ARTEFACT_COLUMN = "temperature_artefact"
SCALES_COLUMN = "temperature_scales"
AXIS_COLUMNS = ("temperature_x", "temperature_y", "temperature_z")
UNITS = {"degC": Fraction(1)}

# What is outside these limits, in degC, K and 1/K, is possible and hardly meant.
COLDEST, WARMEST = -50.0, 100.0
LARGEST_UNCERTAINTY, LARGEST_EXPANSION = 10.0, 1e-4

# What the effects of parameters are told for at least, in K and 1/K: a coefficient matters little
# where a temperature is just the reference, and still has a size.
LEAST_DIFFERENCE, LEAST_EXPANSION = 1.0, 1e-6


class ExpansionSettings(Settings):
    """A coefficient of thermal expansion."""

    value: Expansion = Field(description="coefficient of thermal expansion")
    standard_uncertainty: Expansion | None = Field(
        None, description="of the coefficient; 0 um/m/K: exactly known; left out: unknown"
    )


class MeasuredSettings(Settings):
    """A temperature as it is measured in every position that states no other."""

    value: Forms[Temperature, NonEmpty[Temperature], Temperature] = Field(
        description="temperature, of scales also a list with one for each axis"
    )
    standard_uncertainty: TemperatureDifference = Field(
        0.0, description="of the temperature in each position, independent of all others; default 0"
    )
    sensor_uncertainty: TemperatureDifference = Field(
        0.0, description="of what the sensor is wrong by in all positions alike; default 0"
    )


class PlaceSettings(Settings):
    """Temperatures in one position."""

    artefact: Temperature | None = Field(None, description="temperature of the artefact there")
    scales: Forms[Temperature, NonEmpty[Temperature], Temperature] | None = Field(
        None, description="temperature of the scales there, or a list with one for each axis"
    )


class TemperaturesSettings(InfluenceSettings):
    """Temperatures of an artefact and of the machine's scales, and how much these expand."""

    kind: Literal["temperature"] = Field(description="temperature of artefact and scales")
    reference: Temperature = Field(
        REFERENCE, description="temperature at which lengths are stated; default 20 degC"
    )
    artefact: Name | None = Field(
        None, description="artefact that expands so; default: all artefacts, as one material"
    )
    artefact_expansion: ExpansionSettings | None = Field(
        None, description="expansion of the artefact; left out: it is not followed"
    )
    artefact_temperature: MeasuredSettings | None = Field(
        None, description="temperature of the artefact"
    )
    scale_expansion: (
        Forms[ExpansionSettings, NonEmpty[ExpansionSettings], ExpansionSettings] | None
    ) = Field(
        None, description="expansion of the scales, or a list with one for each axis; as above"
    )
    scale_temperature: MeasuredSettings | None = Field(
        None, description="temperature of the scales"
    )
    positions: dict[Name, PlaceSettings] | None = Field(
        None, description="name of a position → temperatures that are others there"
    )

    def check(self, steps: Steps, positions: Mapping[str, str], references: References) -> None:
        """Report unknown names, an expansion without a temperature, lists of wrong length and
        negative uncertainties.
        """
        if self.artefact is not None:
            references.artefact(self.artefact, steps)
        if self.artefact_expansion is None and self.scale_expansion is None:
            references.problems.add(
                steps, "nothing expands; add artefact_expansion or scale_expansion"
            )
        for name in self.positions or {}:
            references.is_position(name, positions, (*steps, "positions", name))
        for what in ("artefact", "scale"):
            expansion = getattr(self, f"{what}_expansion")
            temperature = getattr(self, f"{what}_temperature")
            missing = "temperature" if temperature is None else "expansion"
            references.require(
                (expansion is None) == (temperature is None),
                steps,
                f"{what}_expansion and {what}_temperature go together;"
                f" add {what}_{missing}, or remove the other",
            )
            _check_uncertainties(expansion, (*steps, f"{what}_expansion"), references)
            _check_uncertainties(temperature, (*steps, f"{what}_temperature"), references)
            if what == "artefact" and temperature is not None:
                references.require(
                    isinstance(temperature.value, float),
                    (*steps, "artefact_temperature", "value"),
                    "has a list, but an artefact has no axes; give one temperature",
                )
        listed: list[tuple[Steps, object]] = [(("scale_expansion",), self.scale_expansion)]
        if self.scale_temperature is not None:
            listed.append((("scale_temperature", "value"), self.scale_temperature.value))
        for name, place in (self.positions or {}).items():
            listed.append((("positions", name, "scales"), place.scales))
            for key, given in (("artefact", place.artefact), ("scales", place.scales)):
                expansion = self.artefact_expansion if key == "artefact" else self.scale_expansion
                references.require(
                    given is None or expansion is not None,
                    (*steps, "positions", name, key),
                    "is a temperature of what does not expand; add its expansion, or remove it",
                )
        self._doubt(steps, references)
        for path, value in listed:
            references.has_axes(value, (*steps, *path))

    def _doubt(self, steps: Steps, references: References) -> None:
        """Doubt temperatures, expansions and uncertainties that no laboratory has."""
        temperatures: list[tuple[Steps, object]] = [(("reference",), self.reference)]
        for key in ("artefact_temperature", "scale_temperature"):
            measured = getattr(self, key)
            if measured is not None:
                temperatures.append(((key, "value"), measured.value))
                for name in ("standard_uncertainty", "sensor_uncertainty"):
                    u = getattr(measured, name)
                    if u > LARGEST_UNCERTAINTY:
                        text = f"is {u:g} K, more than {LARGEST_UNCERTAINTY:g} K; check it"
                        references.problems.doubt((*steps, key, name), text)
        for name, place in (self.positions or {}).items():
            temperatures.append((("positions", name, "artefact"), place.artefact))
            temperatures.append((("positions", name, "scales"), place.scales))
        for path, value in _one_by_one(temperatures):
            if isinstance(value, float) and not COLDEST <= value <= WARMEST:
                text = (
                    f"is {value:g} degC, and temperatures of measurements are {COLDEST:g} to"
                    f" {WARMEST:g} degC; check it"
                )
                references.problems.doubt((*steps, *path), text)
        expansions = [(("artefact_expansion",), self.artefact_expansion)]
        for path, one in _one_by_one([*expansions, (("scale_expansion",), self.scale_expansion)]):
            for name in ("value", "standard_uncertainty"):
                size = getattr(one, name, None)
                if size is not None and abs(size) > LARGEST_EXPANSION:
                    text = (
                        f"is {1e6 * size:g} um/m/K, more than {1e6 * LARGEST_EXPANSION:g} um/m/K,"
                        " which solids hardly have; check it"
                    )
                    references.problems.doubt((*steps, *path, name), text)

    def influence(self, design: DesignParts) -> Temperatures:
        """The temperatures in a design."""
        name = self.artefact or (
            design.artefacts.names[0] if len(design.artefacts.names) == 1 else "the artefacts"
        )
        every = np.arange(len(design.artefacts.names))
        chosen = every if self.artefact is None else [design.artefacts.names.index(self.artefact)]
        arm = float(np.abs(design.balls.places).max(initial=0.1))
        parts: list[Part] = []
        if self.artefact_expansion is not None and self.artefact_temperature is not None:
            here = np.isin(design.positions.artefact, chosen)
            temperatures = self._at_positions(design, "artefact", self.artefact_temperature.value)
            parts.append(
                _part(
                    name,
                    self.artefact_expansion,
                    self.artefact_temperature,
                    temperatures - self.reference,
                    here,
                    arm,
                    design,
                )
            )
        if self.scale_expansion is not None and self.scale_temperature is not None:
            listed = self.scale_expansion
            per_axis = isinstance(listed, tuple) or self._has_axes()
            reach = float(np.abs(design.machine.volume.corners).max())
            everywhere = np.ones(len(design.positions.names), bool)
            for axis in range(design.machine.dimension) if per_axis else (-1,):
                own = listed[axis] if isinstance(listed, tuple) else listed
                temperatures = self._at_positions(
                    design, "scales", self.scale_temperature.value, axis
                )
                parts.append(
                    _part(
                        "the scales" if axis < 0 else f"scale {'xyz'[axis]}",
                        own,
                        self.scale_temperature,
                        temperatures - self.reference,
                        everywhere,
                        reach,
                        design,
                        "all" if axis < 0 else axis,
                        shared=per_axis and not isinstance(listed, tuple) and axis > 0,
                    )
                )
        return Temperatures(
            tuple(parts), np.isin(design.balls.artefact, chosen), float(self.reference)
        )

    def _has_axes(self) -> bool:
        """Whether any temperature of the scales is stated by axis."""
        stated = [one.scales for one in (self.positions or {}).values()]
        assert self.scale_temperature is not None
        return any(isinstance(one, tuple) for one in (self.scale_temperature.value, *stated))

    def _at_positions(
        self, design: DesignParts, key: str, otherwise: object, axis: int = 0
    ) -> Array:
        """Temperatures (k,) in all positions, of scales along an axis."""
        listed = [
            getattr((self.positions or {}).get(name), key, None) for name in design.positions.names
        ]
        chosen = [otherwise if one is None else one for one in listed]
        return np.array([one[axis] if isinstance(one, tuple) else one for one in chosen], float)


@dataclass(frozen=True)
class Part:
    """What expands as one: the artefact, with `axis` -2, all scales, -1, or the scale of an axis.

    `differences` (k,) are its temperatures in all positions above the reference; `expansion` is
    the coefficient, `own` tells that it is a parameter of this part, and not of the one before.
    `wrong` (k,) are the places of the parameters of single positions among its own, -1 for
    positions without one. `parameters` (p,) are first the coefficient, then the sensor, then the
    temperatures.
    """

    axis: int
    differences: Array
    expansion: float
    own: bool
    wrong: np.ndarray
    parameters: tuple[InfluenceParameter, ...]

    @property
    def columns(self) -> list[str]:
        """Columns with its temperature, the last that a reading has counting."""
        if self.axis == -2:
            return [ARTEFACT_COLUMN]
        return [SCALES_COLUMN, *([AXIS_COLUMNS[self.axis]] if self.axis >= 0 else [])]


@dataclass(frozen=True)
class Temperatures(Influence):
    """Temperatures of `parts`; `balls` (n,) are those of the artefact that expands."""

    parts: tuple[Part, ...]
    balls: Flags
    reference: float

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        return tuple(parameter for part in self.parts for parameter in part.parameters)

    @property
    def columns(self) -> Mapping[str, Mapping[str, Fraction]]:
        """Temperatures of single readings, where a file has them."""
        return {name: UNITS for part in self.parts for name in part.columns}

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """Location and derivative: an artefact's expansion moves balls, and that of scales is
        taken off, since the scales say too little by it.
        """
        shift = np.zeros(at.x.shape)
        derivative = np.zeros((*at.x.shape, len(self.parameters)))
        first, coefficient = 0, 0
        for part in self.parts:
            if part.axis == -2:
                length = np.where(self.balls[at.ball][:, None], at.arms, 0.0)
            else:
                axes = np.arange(at.x.shape[1])
                length = np.where((axes == part.axis) | (part.axis == -1), -at.x, 0.0)
            difference = part.differences[at.position]
            for column in part.columns:
                given = at.column(column) - self.reference
                difference = np.where(np.isnan(given), difference, given)
            shift += part.expansion * difference[:, None] * length
            if part.own:
                coefficient = first
            sensor = first + part.own
            derivative[:, :, coefficient] += difference[:, None] * length
            derivative[:, :, sensor] = part.expansion * length
            rows = np.flatnonzero(part.wrong[at.position] >= 0)
            derivative[rows, :, first + part.wrong[at.position[rows]]] = (
                part.expansion * length[rows]
            )
            first += len(part.parameters)
        return shift, derivative


def _part(
    name: str,
    expansion: ExpansionSettings,
    measured: MeasuredSettings,
    differences: Array,
    here: Flags,
    reach: float,
    design: DesignParts,
    axis: int | Literal["all"] = -2,
    shared: bool = False,
) -> Part:
    """What expands as one, with its parameters; `reach` is how far it goes, in metres."""
    size = max(abs(expansion.value), LEAST_EXPANSION) * reach
    most = max(float(np.abs(differences).max(initial=0.0)), LEAST_DIFFERENCE)
    u = expansion.standard_uncertainty
    parameters = []

    def add(words: str, unit: Unit, value: float, u: float, effect: float, k: int = -1) -> None:
        parameters.append(InfluenceParameter(words, unit, value, u, effect, k))

    if not shared:
        words = f"expansion of {'the scales' if axis == 'all' else name}"
        add(words, "1/K", expansion.value, or_unknown(u), most * reach)
    add(f"sensor error of {name}", "K", 0.0, measured.sensor_uncertainty, size)
    wrong = np.full(len(here), -1)
    for k in np.flatnonzero(here) if measured.standard_uncertainty else ():
        wrong[k] = len(parameters)
        words = f"temperature error of {name} in {design.positions.names[k]}"
        add(words, "K", 0.0, measured.standard_uncertainty, size, int(k))
    return Part(
        -1 if axis == "all" else axis,
        differences,
        expansion.value,
        not shared,
        wrong,
        tuple(parameters),
    )


def _check_uncertainties(stated: object, steps: Steps, references: References) -> None:
    for one in stated if isinstance(stated, tuple) else [stated]:
        for key in ("standard_uncertainty", "sensor_uncertainty"):
            references.is_not_negative(getattr(one, key, None), (*steps, key))


def _one_by_one(stated: Iterable[tuple[Steps, object]]) -> Iterator[tuple[Steps, object]]:
    """Paths and what is stated there, lists taken apart."""
    for path, value in stated:
        if isinstance(value, tuple):
            yield from (((*path, i), one) for i, one in enumerate(value))
        else:
            yield path, value
