"""Checks of the ends of measuring volumes."""

from __future__ import annotations

from collections.abc import Mapping

from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.problems import Problems
from ballplate.simulator.inputs.quantity_words import format_length


def check_ends(ends: Mapping[str, tuple[float, float]], steps: Steps, problems: Problems) -> bool:
    """True if each axis of a volume ends above its beginning; others are reported."""
    wrong = {axis: (low, high) for axis, (low, high) in ends.items() if high <= low}
    for axis, (low, high) in wrong.items():
        text = f"ends at {format_length(high)}, not above its beginning, {format_length(low)}"
        problems.add((*steps, axis), f"{text}; exchange or correct them")
    return not wrong
