"""Re-indexing of an articulating head: each time it turns to another probe, the tip comes to rest
elsewhere by a little.

Between two turns all readings have the same shift. In each position the head turns to each of its
probes once, so that there is one shift for each position and probe: x + e(x, a, p + s) = R y + o.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from ...geometry.ball_layouts import Name
from ...geometry.motions import AXIS_NAMES
from ...inputs.messages import Steps
from ...inputs.quantities import Length
from ...inputs.settings import NonEmpty
from ...machines.protocol import Array, Integers
from ..lookup import References
from .protocol import DesignParts, Disturbed, Influence, InfluenceParameter, InfluenceSettings


class ReindexingSettings(InfluenceSettings):
    """How well an articulating head comes back to the same place."""

    kind: Literal["re-indexing"] = Field(description="re-indexing of an articulating head")
    standard_uncertainty: Length | None = Field(
        None,
        description=(
            "repeatability of re-indexing at the tip, for each axis, anew for each position and"
            " probe; left out: unknown"
        ),
    )
    probes: NonEmpty[Name] | None = Field(
        None, description="probes that the head turns to; default: all"
    )

    def check(self, steps: Steps, positions: Mapping[str, str], references: References) -> None:
        """Report unknown probes and an uncertainty below zero."""
        if self.probes is not None:
            references.are_probes(self.probes, (*steps, "probes"))
        u = self.standard_uncertainty
        references.require(
            u is None or u >= 0.0,
            (*steps, "standard_uncertainty"),
            "is below zero; give it without the sign",
        )

    def influence(self, design: DesignParts) -> Reindexing:
        """The shifts in a design: of every probe in every position that it reads in."""
        names, d = design.probes.names, design.machine.dimension
        count = len(names)
        chosen = [k for k, name in enumerate(names) if name in (self.probes or names)]
        turned = np.isin(design.readings.probe, chosen)
        key = design.readings.position[turned] * count + design.readings.probe[turned]
        used = np.unique(key)
        place = np.full(len(design.positions.names) * count, -1)
        place[used] = np.arange(len(used))
        u = np.inf if self.standard_uncertainty is None else self.standard_uncertainty
        parameters = tuple(
            InfluenceParameter(
                f"re-indexing of {names[k % count]} in {design.positions.names[k // count]}:"
                f" {letter}",
                "m",
                0.0,
                u,
                1.0,
                k // count,
                "re-indexing",
            )
            for k in used.tolist()
            for letter in AXIS_NAMES[:d]
        )
        return Reindexing(place.reshape(-1, count), parameters)


@dataclass(frozen=True)
class Reindexing(Influence):
    """Shifts of tips; `place` (positions, probes) is the number of each, -1 without one."""

    place: Integers
    listed: tuple[InfluenceParameter, ...]

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        return self.listed

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """A tip that is further along an axis is where the ball is with less on the scale."""
        m, d = at.x.shape
        derivative = np.zeros((m, d, len(self.parameters)))
        place = self.place[at.position, at.probe]
        rows = np.flatnonzero(place >= 0)
        for axis in range(d):
            derivative[rows, axis, d * place[rows] + axis] = -1.0
        return np.zeros((m, d)), derivative
