"""The samples state the readings of their plain CSVs, as index.csv says.

Nothing here reads the formats: the numbers are looked for behind the name of each reading.
"""

from __future__ import annotations

import csv
import re
import xml.etree.ElementTree as ET
from collections import defaultdict
from decimal import Decimal
from itertools import combinations
from math import dist
from pathlib import Path

import pytest

SAMPLES = Path(__file__).parent / "samples"
ROWS = list(csv.DictReader((SAMPLES / "index.csv").read_text("utf-8").splitlines()))
BY_FILE = {row["file"]: row for row in ROWS}
BY_NAME = [row for row in ROWS if row["coordinates"] in ("scale readings", "ball centres")]

# Millimetres, from campaign.yaml.
OFFSETS = {"down": (0, 0, -60), "side": (40, 35, -30), "back": (-20, -45, -40)}

# How far behind its name the numbers of a reading end at most.
NEAR = 900


def _plain(row: dict[str, str]) -> dict[tuple[str, str, str], list[Decimal]]:
    """Scale readings, or centres where the file states these or points about them, in mm."""
    readings = {}
    with (SAMPLES / row["plain"]).open(newline="") as stream:
        for line in csv.DictReader(stream):
            place = [Decimal(line[f"{axis}_mm"]) for axis in "xyz"]
            if row["coordinates"] != "scale readings":
                offset = OFFSETS[line["probe"]]
                place = [value + o for value, o in zip(place, offset, strict=True)]
            readings[line["position"], line["ball"], line["probe"]] = place
    return readings


def _text(path: Path) -> str:
    if path.suffix == ".qif":
        return _locations(path)
    german = path.name.startswith(("calypso", "german"))
    return path.read_bytes().decode("cp1252" if german else "utf-8")


def _locations(path: Path) -> str:
    """Names and measured places of a QIF file, which only an identifier ties together."""
    root = ET.parse(path).getroot()
    space = root.tag.removesuffix("QIFDocument")
    names = {item.get("id"): item.findtext(f"{space}FeatureName") for item in root.iter()}
    measured = [e for e in root.iter() if e.find(f"{space}FeatureItemId") is not None]
    lines = []
    for element in measured:
        name = names[element.findtext(f"{space}FeatureItemId")]
        lines.append(f"<{name}> {element.findtext(f'{space}Location')}")
    return "\n".join(lines)


def _name(row: dict[str, str], position: str, ball: str, probe: str) -> str:
    if row["file"] == "swapped.csv" and (position, probe) == ("P3", "side"):
        ball = {"r2c1": "r2c2", "r2c2": "r2c1"}.get(ball, ball)
    return row["names"].format(
        position=position,
        ball=ball,
        probe=probe,
        BALL=ball.upper(),
        PROBE=probe.upper(),
        number=4 * (int(ball[1]) - 1) + int(ball[3]),
        place=position[1:],
    )


def _follow(numbers: list[str], name: str, text: str) -> bool:
    """Does the name stand in the text once, and do the numbers follow it in their order?"""
    _, found, rest = text.partition(name)
    there = iter(re.findall(r"-?\d+[.,]\d+", rest[:NEAR]))
    return bool(found) and name not in rest and all(number in there for number in numbers)


@pytest.mark.parametrize("row", BY_NAME, ids=lambda row: row["file"])
def test_a_sample_states_its_readings(row: dict[str, str]) -> None:
    unit = {"mm": Decimal(1), "inch": Decimal("25.4")}[row["unit"]]
    readings = _plain(row)
    assert len(readings) == (108 if row["file"] == "missing.csv" else 112)
    for key, place in readings.items():
        numbers = [f"{value / unit:.{row['digits']}f}" for value in place]
        if row["file"].startswith(("calypso", "german")):
            numbers = [number.replace(".", ",") for number in numbers]
        path = SAMPLES / row["file"]
        text = _text(path / f"{key[0]}.txt" if path.is_dir() else path)
        assert _follow(numbers, _name(row, *key), text), (key, numbers)


def test_every_sample_is_in_the_index() -> None:
    there = {path.name for path in SAMPLES.iterdir()}
    # The header of Calypso's tables states no readings.
    rest = {"README.md", "index.csv", "campaign.yaml", "plain", "calypso_hdr.txt", "__pycache__"}
    assert {name for name in there - rest if not name.endswith(".py")} == set(BY_FILE)


def test_values_that_were_not_read_are_not_stated() -> None:
    text = _text(SAMPLES / "missing.csv")
    assert not re.search("P2,r3c2,down|P4,r1c1,side|P5,r2c3,back", text)
    assert "\nP4,r4c4,side,,,\n" in text


def test_centres_on_the_part_are_moved_rigidly() -> None:
    row = BY_FILE["part.csv"]
    machine = _plain(row)
    part = {}
    for line in (SAMPLES / "part.csv").read_text().splitlines()[1:]:
        position, ball, probe, *place = line.split(",")
        part[position, ball, probe] = [float(value) for value in place]
    assert list(part) == list(machine)
    groups = defaultdict(list)
    for key in part:
        groups[key[0]].append(key)
    for keys in groups.values():
        for a, b in combinations(keys, 2):
            # Each co-ordinate is rounded to 0.5e-6 mm, in both files.
            assert abs(dist(part[a], part[b]) - dist(machine[a], machine[b])) < 4e-6


def test_points_are_on_the_spheres() -> None:
    row = BY_FILE["dmis_points.dmo"]
    text = _text(SAMPLES / row["file"])
    for key, centre in _plain(row).items():
        label = "_".join(key).upper()
        lines = re.findall(rf"^FA\({label}_\d\)=FEAT/POINT,CART,(.*)$", text, re.MULTILINE)
        assert len(lines) == (9 if key[2] == "down" else 5)
        for line in lines:
            x, y, z, *normal = map(float, line.split(","))
            place = [float(value) for value in centre]
            assert abs(dist((x, y, z), place) - 11.0) < 2e-6
            outward = [(p - c) / 11.0 for p, c in zip((x, y, z), place, strict=True)]
            assert dist(outward, normal) < 2e-6
