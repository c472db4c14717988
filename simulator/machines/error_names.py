"""The errors of a machine of three axes and their ISO 230-1 names: 18 of the axes, 3 of
squareness.

The meaning of a name is always looked up here, never parsed from its letters.
"""

from __future__ import annotations

from dataclasses import dataclass

from .protocol import Unit

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
