"""Reproducibility: readings that share something, such as their position and their ball, are
displaced together.

Repeatability is the standard deviation of readings repeated without a break; from one position,
probe or ball to the next more may change. Each combination of the stated levels has one
displacement, drawn separately along each axis: a ball at R y + o is found at R y + o + v.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from ballplate.simulator.design import DesignParts
from ballplate.simulator.experiment import InfluenceSettings, References
from ballplate.simulator.inputs import Length, NonEmpty, Steps
from pydantic import Field

from .displacements import Level, SharedDisplacements, displacements


class ReproducibilitySettings(InfluenceSettings):
    """Standard deviation of readings beyond their repeatability."""

    kind: Literal["reproducibility"] = Field(description="displacements that readings share")
    each: NonEmpty[Level] = Field(
        description=(
            "what has a displacement of its own: each combination of position, probe and ball, such"
            " as [position, ball]"
        ),
        examples=[["position", "ball"]],
    )
    standard_uncertainty: Length = Field(
        description="standard deviation of the displacements along each axis"
    )

    def check(self, steps: Steps, positions: Mapping[str, str], references: References) -> None:
        """Report duplicates, displacements without effect on the readings, and negative
        uncertainties.
        """
        references.require(
            len(set(self.each)) == len(self.each),
            (*steps, "each"),
            "has one of them twice; name each once",
        )
        references.require(
            self.each != ("position",),
            (*steps, "each"),
            "a displacement of a whole position is part of its pose; add probe or ball",
        )
        references.is_not_negative(self.standard_uncertainty, (*steps, "standard_uncertainty"))

    def influence(self, design: DesignParts) -> SharedDisplacements:
        """The displacements in a design: of every combination that is read."""
        return displacements(
            design,
            tuple(self.each),
            design.readings,
            self.standard_uncertainty,
            _words,
            f"displacements by {' and '.join(self.each)}",
        )


def _words(names_by_level: Mapping[Level, str]) -> str:
    named = (f"ball {name}" if level == "ball" else name for level, name in names_by_level.items())
    return f"displacement of {', '.join(named)}"


SETTINGS = ReproducibilitySettings
