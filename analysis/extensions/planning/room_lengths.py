"""Positions with lengths for the parts of their room."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ballplate.simulator.experiment import Position
from ballplate.simulator.geometry import AXIS_INDEX
from ballplate.simulator.inputs import length_text


def in_lengths(settings: Mapping[str, Any], position: Position) -> dict[str, Any]:
    """Return the settings of a position with lengths for the parts of its room."""
    lengths = {axis: length_text(length) for axis, length in position.parts.items()}
    stated = dict(settings)
    for key in {"corner", "centre"} & stated.keys():
        stated[key] = {axis: lengths.get(axis, text) for axis, text in stated[key].items()}
    if "level" in stated:
        stated["level"] = lengths.get(stated["plane"], stated["level"])
    if "pose" in stated:
        origin = zip(AXIS_INDEX, stated["pose"]["origin"], strict=False)
        origin_lengths = [lengths.get(axis, text) for axis, text in origin]
        stated["pose"] = {**stated["pose"], "origin": origin_lengths}
    return stated
