"""Tables as laboratories keep them in spreadsheets."""

from __future__ import annotations

from decimal import Decimal

import numpy as np

from tests.extensions.laboratory.samples.dmis import positions
from tests.extensions.laboratory.samples.readings import INCH, MILLIMETRE, Reading, in_unit

# What is missing: a row left out, or one whose values stayed empty.
LEFT_OUT = {("P2", "r3c2", "down"), ("P4", "r1c1", "side"), ("P5", "r2c3", "back")}
EMPTY = {("P4", "r4c4", "side")}

# Two balls whose names were exchanged by hand, with one tip in one position.
SWAPPED = {("P3", "r2c1", "side"): "r2c2", ("P3", "r2c2", "side"): "r2c1"}


def german(readings: list[Reading]) -> str:
    """Scale readings with semicolons and decimal commas, below some lines about the campaign."""
    lines = [
        "Messprotokoll Kugelplatte KP 44;;;;;",
        "Prüfer;Labor 2;;;;",
        "Messgerät;KMG 1;;;;",
        "Datum;04.03.2026;;;;",
        "Temperatur;20,1 °C;;;;",
        ";;;;;",
        "Aufstellung;Kugel;Taster;X [mm];Y [mm];Z [mm]",
    ]
    for reading in readings:
        cells = in_unit(reading.scales, MILLIMETRE, 4)
        lines.append(";".join([*reading.key, *(cell.replace(".", ",") for cell in cells)]))
    return "\r\n".join([*lines, ""])


def centres(readings: list[Reading]) -> str:
    """Centres in the machine's co-ordinates, with the diameter and the form."""
    lines = ["position,ball,probe,x_mm,y_mm,z_mm,diameter_mm,form_mm"]
    for reading in readings:
        cells = in_unit((*reading.centre, reading.diameter), MILLIMETRE, 5)
        lines.append(",".join([*reading.key, *cells, f"0.000{4 + reading.number % 5}0"]))
    return "\n".join([*lines, ""])


def part(readings: list[Reading]) -> str:
    """Centres in co-ordinates of the plate: in each position about ball r1c1, with x towards r1c4
    and y towards r4c1, but for an alignment that was some hundredths of a millimetre off.
    """
    generator = np.random.default_rng(44)
    lines = ["position,ball,probe,x_mm,y_mm,z_mm"]
    for group in positions(readings):
        place = {r.ball: np.array([float(c) for c in r.nominal]) for r in group}
        origin = place["r1c1"] + generator.normal(0.0, 0.05, 3)
        x = place["r1c4"] - place["r1c1"] + generator.normal(0.0, 0.05, 3)
        y = place["r4c1"] - place["r1c1"] + generator.normal(0.0, 0.05, 3)
        z = np.cross(x, y)
        axes = np.array([a / np.linalg.norm(a) for a in (x, np.cross(z, x), z)])
        for reading in group:
            centre = axes @ (np.array([float(c) for c in reading.centre]) - origin)
            cells = in_unit([Decimal(repr(float(c))) for c in centre], MILLIMETRE, 6)
            lines.append(",".join([*reading.key, *cells]))
    return "\n".join([*lines, ""])


def one_per_position(readings: list[Reading]) -> dict[str, str]:
    """Scale readings, a file for each position, which its name alone tells."""
    files = {}
    for group in positions(readings):
        lines = [f"Ball plate KP 44, position {group[0].position[1:]} of 5", "values in mm", ""]
        lines.append("tip\tball\tX\tY\tZ")
        for reading in group:
            cells = in_unit(reading.scales, MILLIMETRE, 4)
            lines.append("\t".join([reading.probe, reading.ball, *cells]))
        files[group[0].position] = "\n".join([*lines, ""])
    return files


def inches(readings: list[Reading]) -> str:
    """Scale readings in inches, under names of columns of their own."""
    lines = ["No,Setup,Tip,Sphere,X (in),Y (in),Z (in),Temp (F)"]
    for number, reading in enumerate(readings, 1):
        cells = in_unit(reading.scales, INCH, 6)
        names = [str(number), reading.position, reading.probe, reading.ball]
        lines.append(",".join([*names, *cells, "68.2"]))
    return "\n".join([*lines, ""])


def missing(readings: list[Reading]) -> str:
    """Scale readings of which three rows are left out, and one has no values."""
    lines = ["position,ball,probe,x_mm,y_mm,z_mm"]
    for reading in readings:
        if reading.key in LEFT_OUT:
            continue
        empty = reading.key in EMPTY
        cells = ["", "", ""] if empty else in_unit(reading.scales, MILLIMETRE, 5)
        lines.append(",".join([*reading.key, *cells]))
    return "\n".join([*lines, ""])


def swapped(readings: list[Reading]) -> str:
    """Scale readings in which two balls have each other's names."""
    lines = ["position,ball,probe,x_mm,y_mm,z_mm"]
    for reading in readings:
        ball = SWAPPED.get(reading.key, reading.ball)
        cells = in_unit(reading.scales, MILLIMETRE, 5)
        lines.append(",".join([reading.position, ball, reading.probe, *cells]))
    return "\n".join([*lines, ""])


def shuffled(readings: list[Reading]) -> str:
    """Scale readings in another order, with positions and balls by number."""
    lines = ["Position No.,Ball No.,Probe,X/mm,Y/mm,Z/mm"]
    for index in np.random.default_rng(5).permutation(len(readings)):
        reading = readings[index]
        cells = in_unit(reading.scales, MILLIMETRE, 4)
        names = [reading.position[1:], str(reading.number), reading.probe]
        lines.append(",".join([*names, *cells]))
    return "\n".join([*lines, ""])


def wide(readings: list[Reading]) -> str:
    """Scale readings with a row for each ball, and three columns for each position and tip."""
    sets = list(dict.fromkeys((r.position, r.probe) for r in readings))
    at = {r.key: in_unit(r.scales, MILLIMETRE, 5) for r in readings}
    titles = [f"{position} {probe} {a} (mm)" for position, probe in sets for a in "XYZ"]
    lines = [",".join(["Ball", *titles])]
    for ball in dict.fromkeys(r.ball for r in readings):
        cells = [cell for position, probe in sets for cell in at[position, ball, probe]]
        lines.append(",".join([ball, *cells]))
    return "\n".join([*lines, ""])
