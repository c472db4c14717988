"""Whether the volume of a machine is that of a file."""

from __future__ import annotations

from collections.abc import Sequence

from ballplate.simulator.design import Machine
from ballplate.simulator.experiment import References
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import Steps, format_length

# Ends that are the same, in metres.
TOLERANCE = 1e-9


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
    for axis, ends, (low, high) in zip(AXIS_NAMES, outer, inner, strict=False):
        beyond = ends[0] - low, high - ends[1]
        if max(map(abs, beyond) if is_same else beyond) > TOLERANCE:
            text = (
                f"its volume is {format_length(ends[0])} to {format_length(ends[1])} in {axis},"
                f" but machine.volume is {format_length(low)} to {format_length(high)}; {remedy}"
            )
            references.problems.add(steps, text)
            is_right = False
    return is_right
