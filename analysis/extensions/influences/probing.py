"""Probing error along the stylus: a ball is found farther along it, or less far, than it is.

With s the unit vector from the reference point towards a probe's tip, a ball whose centre is at
R y + o is found at R y + o + (b + b_l) s, where b is common to all probes and b_l that of one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.simulator.design import DesignParts, Disturbed, Influence, InfluenceParameter
from ballplate.simulator.experiment import InfluenceSettings, References
from ballplate.simulator.geometry import Name
from ballplate.simulator.inputs import Length, NonEmpty, Steps
from ballplate.simulator.machines import Array, Integers
from pydantic import Field

from .temperature import or_unknown

# Offsets shorter than this, in metres, point nowhere.
SHORTEST = 1e-6

NOWHERE = (
    "a probe without an offset has no direction; state one in directions, such as"
    " {NAME: [0, 0, -1]}"
)


class ProbingSettings(InfluenceSettings):
    """Distance by which probes find balls too far along their styli."""

    kind: Literal["probing"] = Field(description="probing error along the stylus")
    value: Length = Field(
        0.0, description="by how much balls are found too far along every stylus; default 0"
    )
    standard_uncertainty: Length | None = Field(
        None,
        description="of that value, common to all probes; 0 um: exactly known; left out: unknown",
    )
    between_probes: Length = Field(
        0.0,
        description=("standard uncertainty of each probe's deviation from that value; default 0"),
    )
    probes: NonEmpty[Name] | None = Field(None, description="probes that have it; default: all")
    directions: dict[Name, NonEmpty[float]] | None = Field(
        None,
        description=(
            "probe → direction from its stem to its tip, such as [0, 0, -1]; default: that of the"
            " offset"
        ),
    )

    def check(self, steps: Steps, positions: Mapping[str, str], references: References) -> None:
        """Report unknown probes, invalid directions and negative uncertainties."""
        if self.probes is not None:
            references.are_probes(self.probes, (*steps, "probes"))
        for name, direction in (self.directions or {}).items():
            place = (*steps, "directions", name)
            references.is_probe(name, place)
            if references.has_dimension(direction, place):
                references.require(
                    any(direction), place, "has no direction; give one that is not zero"
                )
        for key in ("standard_uncertainty", "between_probes"):
            references.is_not_negative(getattr(self, key), (*steps, key))

    def influence(self, design: DesignParts) -> Probing:
        """The probing errors in a design.

        :raises ValueError: a probe has neither an offset nor a direction.
        """
        names, d = design.probes.names, design.machine.dimension
        directions_stated = self.directions or {}
        chosen = [
            k
            for k in np.unique(design.readings.probe).tolist()
            if names[k] in (self.probes or names)
        ]
        directions, place = np.zeros((len(names), d)), np.full(len(names), -1)
        u = or_unknown(self.standard_uncertainty)
        parameters = [InfluenceParameter("probing error", "m", self.value, u, 1.0)]
        for k in chosen:
            along = np.array(directions_stated.get(names[k], design.probes.offsets[k]), float)
            length = float(np.sqrt(along @ along))
            if length < (0.0 if names[k] in directions_stated else SHORTEST):
                raise ValueError(NOWHERE.replace("NAME", names[k]))
            directions[k] = along / length
            if self.between_probes:
                place[k] = len(parameters)
                prior_name = f"probing error of {names[k]}"
                u = self.between_probes
                parameters.append(
                    InfluenceParameter(
                        prior_name, "m", 0.0, u, 1.0, component="probing errors of probes"
                    )
                )
        return Probing(directions, place, tuple(parameters))


@dataclass(frozen=True)
class Probing(Influence):
    """Probing errors; `directions` (l, d) are those of the probes' styli, zero for probes without
    one, and `place` (l,) is the index of each probe's parameter, or -1.
    """

    directions: Array
    place: Integers
    listed: tuple[InfluenceParameter, ...]

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        return self.listed

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """Balls are found farther along the styli."""
        along = self.directions[at.probe]
        derivative = np.zeros((*along.shape, len(self.listed)))
        derivative[:, :, 0] = along
        rows = np.flatnonzero(self.place[at.probe] >= 0)
        derivative[rows, :, self.place[at.probe[rows]]] = along[rows]
        return self.listed[0].value * along, derivative


SETTINGS = ProbingSettings
