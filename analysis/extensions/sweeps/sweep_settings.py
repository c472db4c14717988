"""Keys of a sweep file: forms and ranges. `load_sweep` checks their references."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, Literal

from ballplate.results import COMPARED
from ballplate.simulator.experiment import Line, Seed
from ballplate.simulator.geometry import Name
from ballplate.simulator.inputs import Duration, Forms, NonEmpty, Settings, Text
from ballplate.uncertainty import QUANTITIES, RECORDED, RECORDED_IF_TOLD
from pydantic import AfterValidator, Field

if TYPE_CHECKING:
    Quantity = str
    Estimator = str
else:
    Quantity = Literal[tuple(symbol for symbol in QUANTITIES if " " not in symbol)]
    Estimator = Literal["full", *COMPARED]

KEPT = f"{RECORDED[0]} to {RECORDED[-1]}"
MORE = ", ".join(RECORDED_IF_TOLD)

Path = Annotated[str, Field(min_length=1)]
Scalar = str | int | float | bool
SomeValues = NonEmpty[Any]
Values = Forms[SomeValues, SomeValues, Annotated[dict[Name, Any], Field(min_length=1)]]
VariantNames = NonEmpty[Name]


# Synthetic data sets of a cell.
MOST_TRIALS = 10_000_000
# Values of a range of counts.
MOST_COUNTS = 1000


class SubsetSettings(Settings):
    """Subsets of a list, in its order."""

    sizes: NonEmpty[Annotated[int, Field(ge=1)]] = Field(
        description="how many entries, those of always included"
    )
    always: tuple[Name, ...] = Field((), description="names of entries that every subset holds")
    among: tuple[Name, ...] | None = Field(
        None, description="names to choose from; default: all entries of the list"
    )


class AxisSettings(Settings):
    """One axis of a sweep: the paths that it changes and their values."""

    path: Path | None = Field(
        None, description="path that the values replace, written as in error messages"
    )
    paths: NonEmpty[Path] | None = Field(
        None, description="several paths that take the same values"
    )
    values: Values | None = Field(None, description="list of values, or name: value")
    start: Scalar | None = Field(
        None, alias="from", description="first value of a range, a number or quantity"
    )
    to: Scalar | None = Field(None, description="last value of a range")
    count: Annotated[int, Field(ge=2, le=100_000)] | None = Field(
        None, description="number of values of a range"
    )
    step: Scalar | None = Field(
        None, description="difference of neighbouring values of a range, instead of count"
    )
    spacing: Literal["linear", "logarithmic"] = Field("linear", description="of a range with count")
    together: Annotated[dict[Path, Values], Field(min_length=1)] | None = Field(
        None,
        description=(
            "path: values, for several paths that change together; lists of the same length"
        ),
    )
    names: tuple[Name, ...] | None = Field(None, description="a name for each value of together")
    subsets: SubsetSettings | None = Field(
        None, description="subsets of the list at path, such as positions"
    )
    variants: Forms[Literal["all"], VariantNames, VariantNames] | None = Field(
        None, description="variants of the base file: all, or a list of names"
    )


class BoundsSettings(Settings):
    """Bounds of an axis, exclusive."""

    above: Scalar | None = Field(None, description="holds for values above this")
    below: Scalar | None = Field(None, description="holds for values below this")


Condition = Forms[Scalar, NonEmpty[Any], BoundsSettings]


Count = Annotated[int, Field(ge=1)]


def _range(text: str) -> tuple[int, ...]:
    """Return the counts of a range.

    >>> _range("4 to 6")
    (4, 5, 6)
    """
    match = re.fullmatch(r" *([1-9][0-9]{0,8}) +to +([1-9][0-9]{0,8}) *", text)
    low, high = map(int, match.groups()) if match else (1, 0)
    if not 0 <= high - low < MOST_COUNTS:
        raise ValueError("expected a number, a list, or a range from low to high such as 4 to 12")
    return tuple(range(low, high + 1))


Counts = Forms[Count | Annotated[str, AfterValidator(_range)], NonEmpty[Count], NonEmpty[Count]]
Hours = Annotated[Duration, Field(gt=0)]


class PlanSettings(Settings):
    """Each case chooses positions and certificates from the pool of the base, as `ballplate plan`
    does. Several values of a limit are an axis.
    """

    criterion: Text = Field("U6", description="what the choice minimises; as --criterion of plan")
    hours: Forms[Hours, NonEmpty[Hours], NonEmpty[Hours]] | None = Field(
        None, description="limit of laboratory time, such as 4 h, or a list: axis `hours limit`"
    )
    positions: Counts | None = Field(
        None,
        description="largest number of positions, a list or a range: axis `positions limit`",
    )
    readings: Counts | None = Field(
        None,
        description="largest number of readings, a list or a range: axis `readings limit`",
    )
    seed: Seed = Field(1, description="of the random starts of each search")


class SweepSettings(Settings):
    """A sweep file: an experiment, its axes, and the quantities to record."""

    title: Line = Field(description="subject of the sweep in one line")
    base: Annotated[str, Field(min_length=1)] = Field(
        description="experiment file, from this file's folder"
    )
    variant: Name | None = Field(
        None, description="variant of the base file; needed if it has several"
    )
    axes: dict[Name, AxisSettings] = Field(
        {}, description="name: what varies; every combination of the axes' values is a case"
    )
    plan: PlanSettings | None = Field(
        None, description="choose the positions of each case from the pool of the base"
    )
    estimator: NonEmpty[Estimator] = Field(
        (),
        description=(
            "estimators, an axis of this name: of each the errors of corrected distances are"
            " recorded, over as many data sets as trials"
        ),
    )
    skip: tuple[Annotated[dict[Name, Condition], Field(min_length=1)], ...] = Field(
        (),
        description=(
            "cases left out: axis: value, list of values or {above: …, below: …}, all of an entry"
            " at once"
        ),
    )
    only: tuple[Annotated[dict[Name, Condition], Field(min_length=1)], ...] = Field(
        (), description="cases kept, in the same form; default: all"
    )
    trials: Annotated[int, Field(ge=2, le=MOST_TRIALS)] | None = Field(
        None, description="synthetic data sets of each case; default: none"
    )
    seed: Seed = Field(
        1,
        description="of the data sets; each case derives its own, except for estimators",
    )
    record: NonEmpty[Quantity] = Field(
        RECORDED, description=f"quantities that are kept, {KEPT} and {MORE}; default: all of {KEPT}"
    )
