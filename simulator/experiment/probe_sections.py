"""The keys of probes, of an articulating head and of stars in an experiment file."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from ballplate.simulator.geometry.ball_layouts import Coordinates, Name
from ballplate.simulator.inputs.quantity_types import Angle, PositiveLength
from ballplate.simulator.inputs.settings import Forms, Settings, Text
from pydantic import Field, model_validator

from .position_sections import LengthPerAxis

StarProbes = Annotated[tuple[Name, ...], Field(min_length=2)]


class ProbeSettings(Settings):
    """A probe whose offset is estimated, or stated by the angles of a head."""

    offset: Coordinates | None = Field(
        None, description="offset from the machine's reference point, as far as it is known"
    )
    a: Angle | None = Field(
        None, alias="A", description="angle A of the head, 0 if the stylus points down"
    )
    b: Angle | None = Field(
        None, alias="B", description="angle B of the head, about the machine's z axis; default 0"
    )
    tip: Coordinates | None = Field(
        None, description="tip from the head's centre at A = 0 and B = 0; default: head.tip"
    )
    standard_uncertainty: LengthPerAxis | None = Field(
        None,
        description="of the stated offset, one length or per axis; the offset is then estimated",
    )
    unknown: bool = Field(
        False, description="whether the offset is estimated without prior knowledge of it"
    )
    reference: bool = Field(
        False,
        description=(
            "whether this probe's offset is held as the reference of the others; default: first"
        ),
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.offset is None) == (self.a is None):
            raise ValueError('needs either "offset" or the angle "A"; give exactly one of them')
        if self.a is None and (self.b is not None or self.tip is not None):
            raise ValueError('"B" and "tip" belong to the angle "A"; add it, or remove them')
        return self


AnyProbe = Forms[Coordinates, Coordinates, ProbeSettings]


class HeadSettings(Settings):
    """An articulating head: angle A tilts the stylus, B turns it about the machine's z axis."""

    centre: Coordinates | None = Field(
        None,
        description=(
            "offset of the centre that both axes go through from the machine's reference point;"
            " default: there"
        ),
    )
    tip: Coordinates | None = Field(
        None, description="tip from the centre at A = 0 and B = 0, such as [0 mm, 0 mm, -120 mm]"
    )


class StarSettings(Settings):
    """Probes whose tips are known among one another; where the star points is estimated."""

    probes: StarProbes | None = Field(None, description="names of its probes; default: all")
    standard_uncertainty: PositiveLength = Field(
        description="of each co-ordinate of a tip in the star's own frame"
    )
    place: Literal["stated", "unknown"] = Field(
        "stated",
        description=(
            "stated (default): the star turns about the machine's reference point; unknown: its"
            " location is estimated too, relative to the probe that is the reference"
        ),
    )
    values: Text | None = Field(
        None,
        description=(
            "CSV file with the tips in the star's frame, columns probe, x_mm, y_mm, z_mm; default:"
            " the offsets of the probes"
        ),
    )
