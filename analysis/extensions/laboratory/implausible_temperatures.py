"""Temperatures in a file of readings that no laboratory has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from ballplate.simulator.design import COLDEST, WARMEST, Design
from ballplate.simulator.inputs import Mark


def doubts_about_temperatures(design: Design, marks: Sequence[Mark]) -> tuple[str, ...]:
    """A sentence about each column in degC that has temperatures outside those possible."""
    names = [
        name
        for influence in design.influences
        for name, units in influence.columns.items()
        if "degC" in units
    ]
    doubts = []
    for name in dict.fromkeys(names):
        values = (design.readings.beside or {}).get(name, np.zeros(0))
        odd = np.flatnonzero((values < COLDEST) | (values > WARMEST))
        if len(odd):
            where = f" (line {marks[int(odd[0])].line})" if marks else ""
            doubts.append(
                f"{name}: {len(odd)} of the temperatures are outside {COLDEST:g} to {WARMEST:g}"
                f" degC, the first {values[odd[0]]:g} degC{where}; check their unit and the sensor"
            )
    return tuple(doubts)
