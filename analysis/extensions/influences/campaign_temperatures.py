"""Mean temperatures of a campaign, as the map of its fit states them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from ballplate.simulator.design import Design
from ballplate.simulator.experiment import InfluenceSettings
from ballplate.simulator.machines import Array

from .temperature import ARTEFACT_COLUMN, AXIS_COLUMNS, SCALES_COLUMN, TemperaturesSettings


def campaign_temperatures(
    influences: Iterable[InfluenceSettings], read: Design
) -> dict[str, float] | None:
    """Return the reference temperature and mean ones of scales and artefacts, over readings if they
    have them, otherwise over positions; None if no temperatures are stated.
    """
    stated = [settings for settings in influences if isinstance(settings, TemperaturesSettings)]
    if not stated:
        return None
    temperatures = {"reference": stated[0].reference}
    columns_read: Mapping[str, Array] = read.readings.beside or {}
    for word, columns in (
        ("scales", (*AXIS_COLUMNS, SCALES_COLUMN)),
        ("artefact", (ARTEFACT_COLUMN,)),
    ):
        values = [
            column[np.isfinite(column)] for name, column in columns_read.items() if name in columns
        ]
        if not sum(map(len, values)):
            values = [
                np.atleast_1d(value)
                for settings in stated
                for value in _by_position(settings, word, read.positions.names)
            ]
        if values:
            temperatures[word] = float(np.concatenate(values).mean())
    return temperatures


def _by_position(settings: TemperaturesSettings, word: str, positions: Sequence[str]) -> list[Any]:
    """Return stated temperatures of scales or artefacts in each position."""
    measured = settings.scale_temperature if word == "scales" else settings.artefact_temperature
    if measured is None:
        return []
    by_name = settings.positions or {}
    temperatures = [getattr(by_name.get(name), word, None) for name in positions]
    return [measured.value if value is None else value for value in temperatures]
