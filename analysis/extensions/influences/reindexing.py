"""Re-indexing of an articulating head: each turn to another probe brings the tip to rest at a
slightly different point.

Between two turns all readings have the same shift. In each position the head turns to each of its
probes once, so that there is one shift for each position and probe: x + e(x, a, p + s) = R y + o.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from ballplate.simulator.design import DesignParts
from ballplate.simulator.experiment import InfluenceSettings, References
from ballplate.simulator.geometry import Name
from ballplate.simulator.inputs import Length, NonEmpty, Steps
from pydantic import Field

from .displacements import SharedDisplacements, displacements
from .temperature import or_unknown


class ReindexingSettings(InfluenceSettings):
    """Repeatability of an articulating head."""

    kind: Literal["re-indexing"] = Field(description="re-indexing of an articulating head")
    standard_uncertainty: Length | None = Field(
        None,
        description=(
            "repeatability of re-indexing at the tip, for each axis, independent for each"
            " position and probe; left out: unknown"
        ),
    )
    probes: NonEmpty[Name] | None = Field(
        None, description="probes that the head turns to; default: all"
    )

    def check(self, steps: Steps, positions: Mapping[str, str], references: References) -> None:
        """Report unknown probes and an uncertainty below zero."""
        if self.probes is not None:
            references.are_probes(self.probes, (*steps, "probes"))
        references.is_not_negative(self.standard_uncertainty, (*steps, "standard_uncertainty"))

    def influence(self, design: DesignParts) -> SharedDisplacements:
        """The shifts in a design: of every probe in every position that it reads in."""
        names = design.probes.names
        chosen = [k for k, name in enumerate(names) if name in (self.probes or names)]
        turned = design.readings.select(np.isin(design.readings.probe, chosen))
        return displacements(
            design,
            ("position", "probe"),
            turned,
            or_unknown(self.standard_uncertainty),
            lambda labels: f"re-indexing of {labels['probe']} in {labels['position']}",
            "re-indexing",
            of_tips=True,
        )


SETTINGS = ReindexingSettings
