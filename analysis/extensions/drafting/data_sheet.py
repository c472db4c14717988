"""The data sheet of a machine with its plate and tips, and the places of the plate."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ballplate.simulator.inputs import LengthFunction, Target, format_length, parse_positive_length
from ballplate.simulator.machines import ARRANGEMENTS

from .machine_tables import arrangement_of, machine_kind, table
from .places import Settings, Tips, places_of, tips_of
from .sheet_values import (
    Plate,
    StatedTips,
    expanded,
    hours,
    permissible_error,
    plate,
    target,
    temperature,
    tips,
    volume,
)

# How each entry is read, in the order of the questions; the first five have to be stated.
READERS: dict[str, Callable[[str], Any]] = {
    "machine_type": machine_kind,
    "volume": volume,
    "mpe": permissible_error,
    "plate": plate,
    "certificate": expanded,
    "tips": tips,
    "repeatability": parse_positive_length,
    "temperature": temperature,
    "target": target,
    "hours": hours,
}
NEEDED = tuple(READERS)[:5]


@dataclass(frozen=True)
class DataSheet:
    """Values by the names of `READERS`, in metres; None for usual values.

    :raises ValueError: the repeatability is above the constant part of the MPE, or there are
        several tips in two dimensions.
    """

    machine_type: str
    volume: tuple[float, ...]
    mpe: LengthFunction
    plate: Plate
    certificate: Target
    tips: StatedTips
    hours: float
    repeatability: float | None = None
    temperature: str | None = None
    target: Target | None = None

    def __post_init__(self) -> None:
        if self.repeatability is not None and self.repeatability > self.mpe.constant:
            raise ValueError(
                f"repeatability {format_length(self.repeatability)} is above the constant part of"
                f" the MPE, {format_length(self.mpe.constant)}; correct one of them"
            )

        if len(self.volume) == 2 and self.tips.form != "one":
            raise ValueError(
                f"tips {self.tips.form} are not for a volume of two lengths, which has one probe"
                ' without an offset; give "one", or three lengths'
            )

    @property
    def arrangement(self) -> str:
        """Return the name of the machine's arrangement."""
        return arrangement_of(self.machine_type, self.volume)

    @property
    def tips_there(self) -> Tips:
        """Return the tips of this machine."""
        pointing = ARRANGEMENTS[self.arrangement].probe_side[-1]
        return tips_of(self.tips, pointing, self.volume)

    @property
    def places(self) -> list[Settings]:
        """Return the places of the plate.

        :raises ValueError: there is none.
        """
        return list(places_of(self.plate, self.tips_there, self.volume))


def data_sheet(texts: Mapping[str, str]) -> DataSheet:
    """Return a data sheet of texts by the names of `READERS`, with defaults for others.

    :raises ValueError: a text cannot be read.
    """
    stated = {name: texts.get(name) or table("entries")[name]["default"] for name in READERS}
    if not texts.get("tips") and len(volume(stated["volume"])) == 2:
        stated["tips"] = "one"
    return DataSheet(**{name: READERS[name](text) for name, text in stated.items() if text})
