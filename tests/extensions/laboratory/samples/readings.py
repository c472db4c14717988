"""The simulated readings that every sample states, and what a file says of one of them."""

from __future__ import annotations

import csv
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

FOLDER = Path(__file__).parent
AXES = ("x", "y", "z")
INCH = Decimal("25.4")
MILLIMETRE = Decimal(1)
DIAMETER = Decimal(22)

# Offsets of the tips in millimetres, as in campaign.yaml.
OFFSETS = {
    "down": (Decimal(0), Decimal(0), Decimal(-60)),
    "side": (Decimal(40), Decimal(35), Decimal(-30)),
    "back": (Decimal(-20), Decimal(-45), Decimal(-40)),
}

Point = tuple[Decimal, Decimal, Decimal]


@dataclass(frozen=True)
class Reading:
    """The scale reading of a ball in millimetres, with all digits."""

    position: str
    ball: str
    probe: str
    scales: Point

    @property
    def key(self) -> tuple[str, str, str]:
        """Position, ball and probe."""
        return self.position, self.ball, self.probe

    @property
    def number(self) -> int:
        """The ball's number along the rows of the plate, from 1."""
        return 4 * (int(self.ball[1]) - 1) + int(self.ball[3])

    @property
    def centre(self) -> Point:
        """The ball's centre in millimetres: the scale reading and the tip's offset."""
        x, y, z = zip(self.scales, OFFSETS[self.probe], strict=True)
        return sum(x, Decimal(0)), sum(y, Decimal(0)), sum(z, Decimal(0))

    @property
    def nominal(self) -> Point:
        """The planned centre: all of them are at whole millimetres."""
        x, y, z = (round(c, 0) for c in self.centre)
        return x, y, z

    @property
    def diameter(self) -> Decimal:
        """A measured diameter: some tenths of a micrometre from the nominal one."""
        return (
            DIAMETER + Decimal((7 * self.number + len(self.position + self.probe)) % 9 - 4) / 10000
        )


def fixed(value: Decimal, digits: int) -> str:
    """A number with so many decimals, and no sign at zero."""
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if Decimal(text) == 0 else text


def in_unit(point: Iterable[Decimal], unit: Decimal, digits: int) -> list[str]:
    """Co-ordinates in millimetres as a file states them."""
    return [fixed(value / unit, digits) for value in point]


def simulate() -> list[Reading]:
    """The readings of campaign.yaml."""
    program = Path(sys.executable).with_name("ballplate")
    command = [program, "simulate", FOLDER / "campaign.yaml", "--quiet", "-o", "-"]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    readings = []
    for row in csv.DictReader(text.splitlines()):
        x, y, z = (Decimal(row[f"{axis}_mm"]) for axis in AXES)
        readings.append(Reading(row["position"], row["ball"], row["probe"], (x, y, z)))
    return readings


def plain(readings: list[Reading], unit: Decimal, digits: int, centres: bool) -> str:
    """The CSV of the same scale readings, as exactly as a file in that unit states them."""
    lines = ["position,ball,probe,x_mm,y_mm,z_mm"]
    for reading in readings:
        offset = OFFSETS[reading.probe] if centres else (Decimal(0),) * 3
        stated = in_unit(reading.centre if centres else reading.scales, unit, digits)
        values = [Decimal(s) * unit - o for s, o in zip(stated, offset, strict=True)]
        lines.append(",".join([*reading.key, *(f"{value:f}" for value in values)]))
    return "\n".join(lines) + "\n"
