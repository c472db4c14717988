"""Checks of the ends of measuring volumes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..design.lookup import References
from ..design.objects import Machine
from ..inputs.messages import Steps
from ..inputs.problems import Problems
from ..inputs.quantities import format_length
from ..machines.arrangement import AXES

# Ends that are the same, in metres.
TOLERANCE = 1e-9


def check_ends(ends: Mapping[str, tuple[float, float]], steps: Steps, problems: Problems) -> bool:
    """True if each axis of a volume ends above its beginning; others are reported."""
    wrong = {axis: (low, high) for axis, (low, high) in ends.items() if high <= low}
    for axis, (low, high) in wrong.items():
        text = f"ends at {format_length(high)}, not above its beginning, {format_length(low)}"
        problems.add((*steps, axis), f"{text}; exchange or correct them")
    return not wrong


def check_within(
    lower: Sequence[float],
    upper: Sequence[float],
    machine: Machine,
    steps: Steps,
    references: References,
    remedy: str = "stay within it",
    is_same: bool = False,
) -> bool:
    """True if the volume of a machine is within ends (d,), or the same if asked; others are
    reported.
    """
    outer = [*zip(lower, upper, strict=True)]
    inner = [*zip(machine.volume.lower.tolist(), machine.volume.upper.tolist(), strict=True)]
    is_right = True
    for axis, ends, (low, high) in zip(AXES, outer, inner, strict=False):
        beyond = ends[0] - low, high - ends[1]
        if max(map(abs, beyond) if is_same else beyond) > TOLERANCE:
            text = (
                f"its volume is {format_length(ends[0])} to {format_length(ends[1])} in {axis},"
                f" but machine.volume is {format_length(low)} to {format_length(high)}; {remedy}"
            )
            references.problems.add(steps, text)
            is_right = False
    return is_right
