"""Temperature of artefacts and scales: both expand from a reference temperature.

A ball at y in its artefact's frame is at R (1 + b t) y + o, and a scale reading x means x (1 + c
s), where b and c are coefficients of thermal expansion and t and s the excess of artefact and
scales over the reference temperature. Products of the errors of a coefficient and of a temperature
are neglected. A file of readings may have temperatures of each reading instead of its position's.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np
from ballplate.simulator.design import DesignParts, Disturbed, Flags, Influence, InfluenceParameter
from ballplate.simulator.experiment import InfluenceSettings, References
from ballplate.simulator.geometry import Name
from ballplate.simulator.inputs import (
    Expansion,
    Forms,
    NonEmpty,
    Settings,
    Steps,
    Temperature,
    TemperatureDifference,
    Units,
)
from ballplate.simulator.machines import Array, Unit
from pydantic import Field

REFERENCE = 20.0

# Columns of readings with temperatures of their own, and their unit.
ARTEFACT_COLUMN = "temperature_artefact"
SCALES_COLUMN = "temperature_scales"
AXIS_COLUMNS = ("temperature_x", "temperature_y", "temperature_z")
# What expands along all axes alike, in place of an axis.
ARTEFACT, SCALES = -2, -1
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
    """A temperature measured in every position without a temperature of its own."""

    value: Forms[Temperature, NonEmpty[Temperature], Temperature] = Field(
        description="temperature, of scales also a list with one for each axis"
    )
    standard_uncertainty: TemperatureDifference = Field(
        0.0, description="of the temperature in each position, independent of all others; default 0"
    )
    sensor_uncertainty: TemperatureDifference = Field(
        0.0, description="of the sensor's error common to all positions; default 0"
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
        """Report unknown names, an expansion without a temperature, lists of another length and
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
        for quantity in ("artefact", "scale"):
            expansion = getattr(self, f"{quantity}_expansion")
            temperature = getattr(self, f"{quantity}_temperature")
            missing = "temperature" if temperature is None else "expansion"
            references.require(
                (expansion is None) == (temperature is None),
                steps,
                f"{quantity}_expansion and {quantity}_temperature go together;"
                f" add {quantity}_{missing}, or remove the other",
            )
            _check_uncertainties(expansion, (*steps, f"{quantity}_expansion"), references)
            _check_uncertainties(temperature, (*steps, f"{quantity}_temperature"), references)
            if quantity == "artefact" and temperature is not None:
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
            for key, temperatures in (("artefact", place.artefact), ("scales", place.scales)):
                expansion = self.artefact_expansion if key == "artefact" else self.scale_expansion
                references.require(
                    temperatures is None or expansion is not None,
                    (*steps, "positions", name, key),
                    "is a temperature of what does not expand; add its expansion, or remove it",
                )
        self._doubt(steps, references)
        for path, value in listed:
            references.has_axes(value, (*steps, *path))
        self._check_forms(steps, positions, references)

    def _check_forms(
        self, steps: Steps, positions: Mapping[str, str], references: References
    ) -> None:
        """Report scales with one sensor in some positions and several in others."""
        if self.scale_temperature is None:
            return
        scales_by_position = {name: place.scales for name, place in (self.positions or {}).items()}
        by_axis = {
            name: isinstance(
                self.scale_temperature.value
                if scales_by_position.get(name) is None
                else scales_by_position[name],
                tuple,
            )
            for name in positions
        }
        if len(set(by_axis.values())) > 1:
            usual = isinstance(self.scale_temperature.value, tuple)
            name = next(name for name, temperature in by_axis.items() if temperature != usual)
            text = (
                "has one temperature for each axis, and other positions one for all"
                if by_axis[name]
                else "has one temperature for all axes, and other positions one for each"
            )
            references.problems.add(
                (*steps, "positions", name, "scales"),
                f"{text}; state all in the same form, which says how many sensors there are",
            )

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
        for path, expansion in _one_by_one(
            [*expansions, (("scale_expansion",), self.scale_expansion)]
        ):
            for name in ("value", "standard_uncertainty"):
                size = getattr(expansion, name, None)
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
        parameters: list[InfluenceParameter] = []
        parts: list[Part] = []
        if self.artefact_expansion is not None and self.artefact_temperature is not None:
            here = np.isin(design.positions.artefact, chosen)
            above = self._at_positions(design, "artefact", self.artefact_temperature.value)
            parts += _parts(
                parameters,
                name,
                ARTEFACT,
                (self.artefact_expansion,),
                self.artefact_temperature,
                above[None] - self.reference,
                here,
                arm,
                design.positions.names,
            )
        if self.scale_expansion is not None and self.scale_temperature is not None:
            axes = range(design.machine.dimension)
            listed = self.scale_expansion
            parts += _parts(
                parameters,
                "the scales",
                SCALES,
                listed if isinstance(listed, tuple) else (listed,),
                self.scale_temperature,
                np.array(
                    [
                        self._at_positions(design, "scales", self.scale_temperature.value, axis)
                        for axis in (axes if self._has_axes() else (0,))
                    ]
                )
                - self.reference,
                np.ones(len(design.positions.names), bool),
                float(np.abs(design.machine.volume.corners).max()),
                design.positions.names,
            )
        return Temperatures(
            tuple(parameters),
            tuple(parts),
            np.isin(design.balls.artefact, chosen),
            float(self.reference),
        )

    def _has_axes(self) -> bool:
        """True if any temperature of the scales is stated by axis."""
        scales_stated = [
            position_temperatures.scales
            for position_temperatures in (self.positions or {}).values()
        ]
        assert self.scale_temperature is not None
        return any(
            isinstance(temperature, tuple)
            for temperature in (self.scale_temperature.value, *scales_stated)
        )

    def _at_positions(
        self, design: DesignParts, key: str, otherwise: object, axis: int = 0
    ) -> Array:
        """Temperatures (k,) in all positions, of scales along an axis."""
        listed = [
            getattr((self.positions or {}).get(name), key, None) for name in design.positions.names
        ]
        chosen = [otherwise if value is None else value for value in listed]
        return np.array(
            [value[axis] if isinstance(value, tuple) else value for value in chosen], float
        )


@dataclass(frozen=True)
class Part:
    """A part that expands as one: the artefact, all scales, or the scale of an `axis` from 0.

    `differences` (k,) are its temperatures in all positions above the reference; `expansion` is
    the coefficient. `coefficient`, `sensor` and `errors` (k,), -1 for positions without one, are
    the indices of its parameters; scales measured together share them. `columns` have its
    temperatures; of several, the last that a reading has counts.
    """

    axis: int
    differences: Array
    expansion: float
    coefficient: int
    sensor: int
    errors: np.ndarray
    columns: tuple[str, ...]


@dataclass(frozen=True)
class Temperatures(Influence):
    """Temperatures of `parts` with the parameters `stated`; `balls` (n,) are those of the artefact
    that expands.
    """

    stated: tuple[InfluenceParameter, ...]
    parts: tuple[Part, ...]
    balls: Flags
    reference: float

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        return self.stated

    @property
    def columns(self) -> Units:
        """Temperatures of single readings, where a file has them."""
        return {name: UNITS for part in self.parts for name in part.columns}

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """Return location and derivative: an artefact's expansion moves balls, and that of scales
        is subtracted, since the scales read too little by it.
        """
        shift = np.zeros(at.x.shape)
        derivative = np.zeros((*at.x.shape, len(self.parameters)))
        for part in self.parts:
            if part.axis == ARTEFACT:
                length = np.where(self.balls[at.ball][:, None], at.arms, 0.0)
            else:
                axes = np.arange(at.x.shape[1])
                length = np.where((axes == part.axis) | (part.axis == SCALES), -at.x, 0.0)
            difference = part.differences[at.position]
            for column in part.columns:
                excess = at.column(column) - self.reference
                difference = np.where(np.isnan(excess), difference, excess)
            shift += part.expansion * difference[:, None] * length
            derivative[:, :, part.coefficient] += difference[:, None] * length
            derivative[:, :, part.sensor] += part.expansion * length
            errors = part.errors[at.position]
            rows = np.flatnonzero(errors >= 0)
            derivative[rows, :, errors[rows]] += part.expansion * length[rows]
        return shift, derivative


def _parts(
    parameters: list[InfluenceParameter],
    name: str,
    whole: int,
    expansions: Sequence[ExpansionSettings],
    measured: MeasuredSettings,
    differences: Array,
    here: Flags,
    reach: float,
    positions: Sequence[str],
) -> Iterator[Part]:
    """Return the parts that expand as one, each with `parameters` appended to those of all.

    `expansions` and `differences` (a, k) have one row per axis if stated so, otherwise one for
    all. `reach` is their extent in metres.
    """

    def add(words: str, unit: Unit, value: float, u: float, effect: float, k: int = -1) -> int:
        parameters.append(InfluenceParameter(words, unit, value, u, effect, k))
        return len(parameters) - 1

    def of_axis(count: int, axis: int) -> str:
        return name if count == 1 else f"scale {'xyz'[axis]}"

    size = max(LEAST_EXPANSION, *(abs(expansion.value) for expansion in expansions)) * reach
    most = max(float(np.abs(differences).max(initial=0.0)), LEAST_DIFFERENCE)
    count = max(len(expansions), len(differences))
    coefficient, sensor, errors = -1, -1, np.full(len(here), -1)
    for axis in range(count):
        if axis < len(expansions):
            expansion = expansions[axis]
            u = or_unknown(expansion.standard_uncertainty)
            words = f"expansion of {of_axis(len(expansions), axis)}"
            coefficient = add(words, "1/K", expansion.value, u, most * reach)
        if axis < len(differences):
            words = of_axis(len(differences), axis)
            sensor = add(f"sensor error of {words}", "K", 0.0, measured.sensor_uncertainty, size)
            errors = np.full(len(here), -1)
            for k in np.flatnonzero(here).tolist() if measured.standard_uncertainty else ():
                text = f"temperature error of {words} in {positions[k]}"
                errors[k] = add(text, "K", 0.0, measured.standard_uncertainty, size, int(k))
        along = axis if count > 1 else whole
        columns = (
            (ARTEFACT_COLUMN,)
            if whole == ARTEFACT
            else (SCALES_COLUMN, *AXIS_COLUMNS[along : along + 1])
        )
        row = differences[min(axis, len(differences) - 1)]
        value = expansions[min(axis, len(expansions) - 1)].value
        yield Part(along, row, value, coefficient, sensor, errors, columns)


def _check_uncertainties(setting: object, steps: Steps, references: References) -> None:
    for value in setting if isinstance(setting, tuple) else [setting]:
        for key in ("standard_uncertainty", "sensor_uncertainty"):
            references.is_not_negative(getattr(value, key, None), (*steps, key))


def _one_by_one(settings: Iterable[tuple[Steps, object]]) -> Iterator[tuple[Steps, object]]:
    """Yield paths and stated values, lists split."""
    for path, value in settings:
        if isinstance(value, tuple):
            yield from (((*path, i), item) for i, item in enumerate(value))
        else:
            yield path, value


SETTINGS = TemperaturesSettings


def or_unknown(uncertainty: float | None) -> float:
    """Return a standard uncertainty, infinite if none is stated."""
    return np.inf if uncertainty is None else uncertainty
