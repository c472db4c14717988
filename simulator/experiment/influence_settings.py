"""The keys of an influence quantity in a file, of whatever kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar

from ballplate.simulator.design.influence_quantities import DesignParts, Influence
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.settings import Settings
from ballplate.simulator.inputs.validation import OpenKinds

from .references import References


class InfluenceSettings(Settings):
    """Settings of one influence quantity, with a `kind` of its own.

    If it is `in_order` it depends on the time of readings: a plan chooses without it.
    """

    in_order: ClassVar[bool] = False

    def check(self, steps: Steps, positions: Mapping[str, str], references: References) -> None:
        """Report faults, given `positions`: names with those of their artefacts."""

    def influence(self, design: DesignParts) -> Influence:
        """Return the influence quantity in a design.

        :raises ValueError: the design lacks data that it needs.
        """
        raise NotImplementedError


if TYPE_CHECKING:
    AnyInfluence = InfluenceSettings
else:
    AnyInfluence = Annotated[InfluenceSettings, OpenKinds("influences", InfluenceSettings)]
