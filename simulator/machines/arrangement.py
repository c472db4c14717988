"""Arrangement of a machine's axes as a kinematic chain."""

from __future__ import annotations

from dataclasses import dataclass

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Arrangement:
    """Axes on the probe's and on the workpiece's side, each listed from the ground outwards.

    An axis moves all axes listed after it on its side, and the probe or the workpiece. Every axis
    is on exactly one side.

    :raises ValueError: an axis is missing or repeated.
    """

    probe_side: tuple[str, ...]
    workpiece_side: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if sorted(self.probe_side + self.workpiece_side) != list(AXES):
            raise ValueError(
                "an axis is missing or named twice; name each of x, y and z exactly once on the"
                " two sides together"
            )


ARRANGEMENTS: dict[str, Arrangement] = {
    "MB1": Arrangement(("y", "x", "z")),
    "MB2": Arrangement(("x", "y", "z")),
    "FB1": Arrangement(("x", "z"), ("y",)),
    "FB2": Arrangement(("y", "z"), ("x",)),
    "FH1": Arrangement(("y", "z"), ("x",)),
    "FH2": Arrangement(("x", "z"), ("y",)),
    "MH1": Arrangement(("y", "z", "x")),
    "MH2": Arrangement(("x", "z", "y")),
    "CX1": Arrangement(("z",), ("x", "y")),
    "CY1": Arrangement(("z",), ("y", "x")),
}
"""The ten machines of Park, Burdekin and Peggs; MB2 is the kinematic model of NPL Report CISE
15/98.
"""
