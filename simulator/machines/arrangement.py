"""Arrangement of a machine's axes as a kinematic chain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, Self

from ballplate.simulator.inputs.settings import Settings
from pydantic import Field, model_validator

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


AxisName = Literal["x", "y", "z"]


class ArrangementSettings(Settings):
    """An arrangement of the axes that has no name of its own."""

    probe_side: tuple[AxisName, ...] = Field(
        default=(), description="Axes that move the probe, listed from the ground to the probe."
    )
    workpiece_side: tuple[AxisName, ...] = Field(
        default=(),
        description="Axes that move the workpiece, listed from the ground to the table.",
    )

    @model_validator(mode="after")
    def _each_axis_once(self) -> Self:
        arrangement_of(self)
        return self


MEANINGS = {
    "MB1": "moving bridge along y",
    "MB2": "moving bridge along x",
    "FB1": "fixed bridge, table along y",
    "FB2": "fixed bridge, table along x",
    "FH1": "fixed horizontal arm, table along x",
    "FH2": "fixed horizontal arm, table along y",
    "MH1": "moving horizontal arm along x, on a column along y",
    "MH2": "moving horizontal arm along y, on a column along x",
    "CX1": "column, table along y on x",
    "CY1": "column, table along x on y",
}
ArrangementName = Annotated[
    Literal["MB1", "MB2", "FB1", "FB2", "FH1", "FH2", "MH1", "MH2", "CX1", "CY1"],
    Field(json_schema_extra={"enumDescriptions": list(MEANINGS.values())}),
]
ARRANGEMENT = (
    "Order of the axes in the chain: a named arrangement, or the axes on either side. "
    "MB2 (x moves y, y moves z, z moves the probe) is NPL's kinematic model."
)
PRODUCTS = "Treatment of products of small errors: neglected (linearised) or multiplied out (full)."


def arrangement_of(settings: str | ArrangementSettings) -> Arrangement:
    """Return the named or listed arrangement."""
    if isinstance(settings, str):
        return ARRANGEMENTS[settings]
    return Arrangement(settings.probe_side, settings.workpiece_side)
