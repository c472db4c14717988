"""The keys of a pool: candidates, the time that they take, and limits on the choice."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, Union

from ballplate.simulator.geometry.poses import Axis
from ballplate.simulator.inputs.quantity_types import Duration, Length, Place, RoomPart
from ballplate.simulator.inputs.settings import Forms, Name, NonEmpty, Settings, Several, Text
from ballplate.simulator.inputs.validation import OpenKinds
from pydantic import Discriminator, Field, Tag, create_model, model_validator

from .calibrated_coordinates import CalibratedBalls
from .calibrations import CALIBRATIONS
from .position_sections import Count, LengthPerAxis, PositionSettings, ProbeNames, QuarterTurns

GROUP_KEYS = ("planes", "levels", "corners", "centres")

Seconds = Duration | None


class OwnTimesSettings(Settings):
    """How long a position takes by itself, where that differs from the other positions."""

    set_up: Seconds = Field(None, description="to set the artefact up and align it")
    reading: Seconds = Field(None, description="of a reading of a ball")


class TimesSettings(OwnTimesSettings):
    """How long things take."""

    set_up: Seconds = Field(None, description="to set an artefact up and align it; default 20 min")
    reading: Seconds = Field(None, description="of a reading of a ball; default 15 s")
    probe_change: Seconds = Field(None, description="to change to another probe; default 2 min")
    plane_change: Seconds = Field(
        None,
        description=(
            "additional, if a position is in another plane, or of another artefact, than the"
            " previous one; default 30 min"
        ),
    )
    positions: dict[Name, OwnTimesSettings] | None = Field(
        None, description="name of a position of the file → times that are others there"
    )


class RangeSettings(Settings):
    """Evenly spaced lengths, or parts of the free room, both ends included."""

    from_: Place = Field(alias="from", description="the first")
    to: Place = Field(description="the last")
    count: Annotated[int, Field(ge=2, le=1000)] = Field(description="how many")

    @model_validator(mode="after")
    def _of_one_kind(self) -> Self:
        if isinstance(self.from_, RoomPart) != isinstance(self.to, RoomPart):
            raise ValueError(
                "has a length at one end and a part of the free room at the other; give two lengths"
                " or two parts"
            )
        return self


Places = Forms[Place, Several[Place], RangeSettings]
PlacesByAxis = dict[Axis, Places]


ProbeSets = Annotated[
    Annotated[ProbeNames, Tag("<list>")] | Annotated[Several[ProbeNames], Tag("<sets>")],
    Discriminator(
        lambda value: (
            "<sets>"
            if isinstance(value, tuple) and any(isinstance(item, tuple) for item in value)
            else "<list>"
        )
    ),
]


class GroupSettings(Settings):
    """Candidates that are every combination of planes, levels, places, turns and probes."""

    name: Name | None = Field(
        None, description="of the group; the names of its candidates begin with it"
    )
    artefact: Name | None = Field(
        None, description="name of the artefact; optional if there is exactly one"
    )
    planes: NonEmpty[Axis] | None = Field(
        None,
        description=(
            "axes that the artefact's plane is normal to, such as [x, y, z]; omitted in 2-D"
        ),
    )
    levels: Places | None = Field(
        None,
        description=(
            "co-ordinates of the planes: a list, such as [low, 30 %, 750 mm], or {from: 0 mm, to:"
            " 1 m, count: 5}; omitted in 2-D"
        ),
    )
    corners: PlacesByAxis | None = Field(
        None,
        description=(
            "lower corners of the turned bounding rectangle along each axis, as lists or ranges"
            " of lengths or of parts of the free room"
        ),
    )
    centres: PlacesByAxis | None = Field(
        None, description="centres of the bounding rectangle along each axis, instead of corners"
    )
    quarter_turns: Forms[QuarterTurns, Several[QuarterTurns], QuarterTurns] = Field(
        0, description="one number of turns by 90 degrees, 0 to 3, or a list; default 0"
    )
    probes: ProbeSets | None = Field(
        None,
        description=(
            "names of probes, or a list of such sets to choose from, [[right, left], [right]];"
            " optional if there is exactly one probe"
        ),
    )
    balls: CalibratedBalls = Field("all", description="all (default), corners, or a list of balls")
    repeats: Count = Field(
        1, description="how often every ball is read with every probe; default 1"
    )
    standard_uncertainty: LengthPerAxis | None = Field(
        None,
        description="of each reading there, one length or per axis; default: machine.repeatability",
    )
    times: OwnTimesSettings | None = Field(
        None, description="times that differ from those in pool.times"
    )

    @model_validator(mode="after")
    def _one_anchor(self) -> Self:
        if (self.corners is None) == (self.centres is None):
            raise ValueError('needs either "corners" or "centres"; give exactly one of them')
        return self


class ListedSettings(PositionSettings):
    """A candidate by itself, described as a position is."""

    name: Name = Field(description="name of the position, if it is chosen")
    times: OwnTimesSettings | None = Field(
        None, description="times that differ from those in pool.times"
    )


def is_group(value: Any) -> bool:
    """True if an entry of the pool's candidates, mapping or settings, stands for many."""
    return (
        isinstance(value, GroupSettings)
        or isinstance(value, dict)
        and bool(set(GROUP_KEYS) & set(value))
    )


CandidateSettings = Annotated[
    Annotated[GroupSettings, Tag("<group>")] | Annotated[ListedSettings, Tag("<listed>")],
    Discriminator(lambda value: "<group>" if is_group(value) else "<listed>"),
]


class _Priced(Settings):
    name: Name = Field(description="name of the item, used in tables and messages")
    price: Duration = Field(0.0, description="time taken from the budget, such as 3 h; default 0 h")


@cache
def _priced(kind: type[Settings]) -> Any:
    """Settings of a kind of calibration that can be had at a price."""
    words = f"{(kind.__doc__ or '').rstrip('.')}, to be had at a price."
    return create_model(
        f"Priced{kind.__name__}",
        __base__=(_Priced, kind),
        __doc__=words,
        __module__=kind.__module__,
    )


if TYPE_CHECKING:
    PricedSettings = _Priced
else:
    PricedSettings = Annotated[
        Union[tuple(_priced(kind) for kind in CALIBRATIONS)],  # noqa: UP007
        OpenKinds("calibrations", form=_priced),
    ]


class SelectorSettings(Settings):
    """Which candidates are meant: those to which everything stated applies."""

    name: Forms[Text, NonEmpty[Text], NonEmpty[Text]] | None = Field(
        None, description='name, in which * matches anything, such as "z *", or a list of names'
    )
    group: Name | None = Field(None, description="name of their entry in pool.candidates")
    plane: Axis | None = Field(None, description="axis that the artefact's plane is normal to")
    artefact: Name | None = Field(None, description="name of the artefact")
    probe: Name | None = Field(None, description="a probe that they are read with")

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not self.model_fields_set:
            raise ValueError(
                "has no criterion; give at least one of name, group, plane, artefact, probe"
            )
        return self


class AtMostSettings(Settings):
    """At most so many of some candidates."""

    of: SelectorSettings = Field(description="which, such as {plane: x}")
    count: Annotated[int, Field(ge=0, le=100_000)] = Field(description="how many of them at most")


# Lower and upper ends; axes that are left out are not limited.
Region = dict[Axis, tuple[Length, Length]]


class LimitsSettings(Settings):
    """What a choice has to comply with."""

    keep: Forms[Literal["all"], tuple[Name, ...], tuple[Name, ...]] = Field(
        (), description="candidates that must be chosen, by name; all: every position of the file"
    )
    at_most: tuple[AtMostSettings, ...] = Field(
        (), description="{of: {plane: x}, count: 2} and the like"
    )
    reach: dict[Name, Region] = Field(
        default_factory=dict,
        description="name of a probe → region in which it can read balls, {x: [200 mm, 1 m]}",
    )
    forbidden: tuple[Region, ...] = Field(
        (),
        description=(
            "boxes, {x: [0 mm, 200 mm], y: [0 mm, 200 mm]}, that no artefact may enter: the box"
            " around all its balls, with the edge of a plate, has to stay outside"
        ),
    )
    edge: Length | None = Field(
        None,
        description=(
            "material of a plate beyond its outermost balls, which has to stay inside the volume;"
            " default: only balls that are read have to"
        ),
    )


class PoolSettings(Settings):
    """What a plan chooses from, besides the positions of the file."""

    times: TimesSettings = Field(
        default_factory=lambda: TimesSettings.model_validate({}),
        description="durations of set-up, readings and changes",
    )
    candidates: tuple[CandidateSettings, ...] = Field(
        (), description="groups of candidates, and single ones described as a position is"
    )
    calibration: tuple[PricedSettings, ...] = Field(
        (), description="items of calibration that are available at a price"
    )
    limits: LimitsSettings = Field(
        default_factory=lambda: LimitsSettings.model_validate({}),
        description="limits that a choice must observe",
    )
