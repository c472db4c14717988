"""Arrangements of a machine's axes, and the names of its errors.

The meaning of a name is always looked up here, never parsed from its letters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, Self

from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.settings import Settings
from pydantic import Field, model_validator

from .protocol import Unit


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
        if sorted(self.probe_side + self.workpiece_side) != list(AXIS_NAMES):
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


# Translations along x, y, z and rotations about them, by the letters of ISO 230-1.
TRANSLATIONS = ("X", "Y", "Z")
ROTATIONS = ("A", "B", "C")


@dataclass(frozen=True)
class AxisError:
    """An error of an axis: as `axis` (0 to 2) moves, it displaces along or turns about `component`
    (0 to 2).
    """

    axis: int
    component: int
    is_rotation: bool

    @property
    def name(self) -> str:
        """ISO 230-1 name.

        >>> AxisError(0, 0, False).name, AxisError(0, 2, True).name
        ('EXX', 'ECX')
        """
        letters = ROTATIONS if self.is_rotation else TRANSLATIONS
        return f"E{letters[self.component]}{TRANSLATIONS[self.axis]}"

    @property
    def unit(self) -> Unit:
        return "rad" if self.is_rotation else "m"

    @property
    def is_straightness(self) -> bool:
        return not self.is_rotation and self.axis != self.component

    @property
    def in_plane(self) -> bool:
        """True if it moves points of the xy plane within that plane."""
        return self.axis < 2 and self.is_rotation == (self.component == 2)

    @property
    def meaning(self) -> str:
        """Description.

        >>> [AXIS_ERRORS[name].meaning for name in ("EXX", "EYX", "ECZ")]
        ['positioning error of X', 'straightness of X in Y', 'roll of Z about Z']
        """
        axis, component = TRANSLATIONS[self.axis], TRANSLATIONS[self.component]
        if not self.is_rotation:
            if self.is_straightness:
                return f"straightness of {axis} in {component}"
            return f"positioning error of {axis}"
        if axis == component:
            word = "roll"
        elif axis == "Z":
            word = "tilt"
        else:
            word = "yaw" if component == "Z" else "pitch"
        return f"{word} of {axis} about {component}"

    @property
    def slope_meaning(self) -> str:
        """Description of a straightness that grows in proportion to the axis.

        >>> AXIS_ERRORS["EXZ"].slope_meaning
        'squareness of Z to X'
        """
        return f"squareness of {TRANSLATIONS[self.axis]} to {TRANSLATIONS[self.component]}"


@dataclass(frozen=True)
class SquarenessError:
    """The turn of `axis` about `about` from its right angle to the axis `to`, each 0 to 2.

    The turn is right-handed. To first order it displaces along `to`, by `sign` times the angle for
    each metre of `axis`.
    """

    axis: int
    to: int
    about: int

    @property
    def name(self) -> str:
        """ISO 230-1 name.

        >>> list(SQUARENESS_ERRORS)
        ['EC0Y', 'EB0Z', 'EA0Z']
        """
        return f"E{ROTATIONS[self.about]}0{TRANSLATIONS[self.axis]}"

    @property
    def unit(self) -> Unit:
        return "rad"

    @property
    def sign(self) -> float:
        """Component `to` of the cross product of the axes `about` and `axis`.

        >>> [error.sign for error in SQUARENESS_ERRORS.values()]
        [-1.0, 1.0, -1.0]
        """
        return 1.0 if (self.about + 1) % 3 == self.axis else -1.0

    @property
    def in_plane(self) -> bool:
        """True if it moves points of the xy plane within that plane."""
        return self.about == 2

    @property
    def meaning(self) -> str:
        """Description.

        >>> SQUARENESS_ERRORS["EC0Y"].meaning
        'squareness of Y to X'
        """
        return f"squareness of {TRANSLATIONS[self.axis]} to {TRANSLATIONS[self.to]}"


AXIS_ERRORS = {
    error.name: error
    for axis in range(3)
    for is_rotation in (False, True)
    for component in range(3)
    for error in (AxisError(axis, component, is_rotation),)
}
"""The 18 errors of the axes by name, all of X first, its displacements before its rotations."""

SQUARENESS_ERRORS = {
    error.name: error
    for error in (SquarenessError(1, 0, 2), SquarenessError(2, 0, 1), SquarenessError(2, 1, 0))
}
"""The three squareness errors by name: of Y to X, of Z to X and of Z to Y."""

ERRORS: dict[str, AxisError | SquarenessError] = {**AXIS_ERRORS, **SQUARENESS_ERRORS}
"""All 21 by name."""
