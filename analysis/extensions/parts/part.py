"""A workpiece: its features, their dimensions, and how they are probed. Metres and radians."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from ballplate.simulator.inputs import Array

from ..machine_files import RandomPart
from .fitting import GeometricElement
from .part_sections import PartExpansion, PointProbing, ShortWaves

FORMS = ("flatness", "straightness", "roundness", "cylindricity")


@dataclass(frozen=True, eq=False)
class PartFeature:
    """A feature of a part: its nominal element, and the points (n, 3) that are touched on it, with
    unit normals (n, 3) away from the material.

    ``ends`` (2, 3) are those of its axis, or of a line, between its outermost points. ``probe``
    overrides the tip that is chosen.
    """

    name: str
    nominal: GeometricElement
    points: Array
    normals: Array
    ends: Array
    probe: str | None = None


@dataclass(frozen=True, eq=False)
class Place:
    """Where a part is: a point p of the part is at ``rotation`` (3, 3) p + ``origin`` (3,)."""

    name: str
    rotation: Array
    origin: Array


@dataclass(frozen=True)
class Dimension:
    """A dimension of features, in ``unit`` m or rad.

    ``tolerance`` are the limits of the deviation from ``nominal``, None where there is no limit.
    ``form`` is the form deviation that a form or zone is expected to have, and ``zone`` asks for
    the minimum zone instead of least squares. ``components`` are those of the vectors among the
    members: 0 if the value is their range, None if it is the only member.
    """

    name: str
    kind: str
    features: tuple[str, ...]
    datums: tuple[str, ...]
    nominal: float
    tolerance: tuple[float | None, float | None] | None
    unit: Literal["m", "rad"]
    form: float
    zone: bool
    components: int | None

    @property
    def used(self) -> tuple[str, ...]:
        """Names of the features and datums, each once."""
        return tuple(dict.fromkeys((*self.features, *self.datums)))


@dataclass(frozen=True, eq=False)
class Workpiece:
    """A workpiece, its dimensions and the places in which they are measured.

    ``undetermined`` says by dimension what its points or datums leave open. ``short_waves`` are
    "none", stated, or None for those that the machine's model suggests. An expanded uncertainty is
    compared with ``share_of_tolerance``. ``random`` are random errors of the machine.
    """

    title: str
    features: Mapping[str, PartFeature]
    dimensions: tuple[Dimension, ...]
    places: tuple[Place, ...]
    probing: PointProbing
    expansion: PartExpansion
    short_waves: Literal["none"] | ShortWaves | None
    share_of_tolerance: float
    undetermined: Mapping[str, str] = field(default_factory=dict)
    random: RandomPart | None = None
