"""Output of programs that follow DMIS (ISO 22093): features `F(name)`, nominal, and `FA(name)`,
actual, a statement to a line.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np
from ballplate.simulator.inputs import (
    ANGLE_UNITS,
    LENGTH_UNITS,
    Mark,
    QuantityError,
    exact_number,
    shorten,
)

from .report import LOCATED, SPHERE, Feature, Format, Place, Report, ReportProblems, System
from .text import Text, read_lines

UNITS = {
    "MM": LENGTH_UNITS["mm"],
    "CM": LENGTH_UNITS["cm"],
    "M": LENGTH_UNITS["m"],
    "INCH": LENGTH_UNITS["in"],
    "FEET": 12 * LENGTH_UNITS["in"],
}
ANGLES = {"ANGDEC": ANGLE_UNITS["deg"], "ANGDMS": ANGLE_UNITS["deg"], "ANGRAD": Fraction(1)}
# Axes of the radius at angle 0, of the radius at 90°, and of the height.
PLANES = {"XYPLAN": (0, 1, 2), "YZPLAN": (1, 2, 0), "ZXPLAN": (2, 0, 1)}
KINDS = {
    "CYLNDR": "cylinder",
    "CPARLN": "slot",
    "ELLIPS": "ellipse",
    "EDGEPT": "edge point",
    "GCURVE": "curve",
    "GSURF": "surface",
    "PARPLN": "pair of planes",
    "PATERN": "pattern",
    "RCTNGL": "rectangle",
}
STATEMENT = re.compile(
    r"(?:([A-Za-z]+)\s*\(([^()]*)\)\s*=\s*)?([A-Za-z]+)\s*(?:/\s*(.*))?", re.DOTALL
)
LABEL = re.compile(r"\b(?:F|FA|S|SA|D|DA|SW)\s*\(([^()]*)\)", re.IGNORECASE)
DATUM = re.compile(r"DA?\s*\(", re.IGNORECASE)
BEGINNING = re.compile(
    r"^[ \t]*(?:DMISMN[ \t]*/|FILNAM[ \t]*/|FA?[ \t]*\([^()\n]*\)[ \t]*=[ \t]*FEAT\b)",
    re.MULTILINE | re.IGNORECASE,
)
# What moves a machine: only a program has it, and its points are where it is to probe.
OF_PROGRAMS = ("GOTO", "MODE", "GOHOME")
SYSTEMS = ("DATSET", "TRANS", "ROTATE", "LOCATE", "TRMATX")


@dataclass(frozen=True)
class Statement:
    """A statement with its continuation lines joined; what is left of = is `kind` and `name`."""

    mark: Mark
    kind: str
    name: str
    word: str
    rest: str
    is_cut: bool

    @property
    def parts(self) -> list[str]:
        """What is between commas."""
        return [part.strip() for part in self.rest.split(",")]


def statements(text: Text, problems: ReportProblems) -> Iterator[Statement]:
    """Statements of a file, comments left out; those that cannot be parted are told."""
    joined, start = "", 0
    for number, line in enumerate(text.lines, start=1):
        stripped = line.strip()
        if stripped.startswith("$$") or not stripped and not joined:
            continue
        start = start if joined else number
        joined += stripped.removesuffix("$").rstrip()
        if stripped.endswith("$"):
            continue
        found = STATEMENT.fullmatch(joined)
        if found is not None:
            kind, name, word, rest = ((group or "").strip() for group in found.groups())
            last = text.is_cut and number == len(text.lines)
            yield Statement(text.mark(start), kind.upper(), name, word.upper(), rest, last)
        elif re.match(r"\s*FA?\s*\(", joined, re.IGNORECASE):
            told = f'"{shorten(joined)}" is no DMIS statement; check whether the file is complete'
            problems.add(text.mark(start), told)
        joined = ""
    if joined:
        told = "the file ends within a statement; it was cut off, take a whole copy"
        problems.add(text.mark(start), told)


@dataclass
class _Reader:
    """What the statements so far have set, and the features that they gave."""

    problems: ReportProblems
    unit: Fraction | None
    angle: str = "ANGDEC"
    plane: str = "XYPLAN"
    probe: str = ""
    system: System = "machine"
    of: str = ""
    measuring: str = ""
    is_program: bool = False
    is_ended: bool = False
    machine_systems: set[str] = field(default_factory=set)
    actual: dict[str, list[Feature]] = field(default_factory=dict)
    nominal: dict[str, Feature] = field(default_factory=dict)
    # Points by the sphere that they are on, as probed and as features that it is made of.
    probed: dict[str, list[Place]] = field(default_factory=dict)
    made_of: dict[str, list[str]] = field(default_factory=dict)
    others: Counter[str] = field(default_factory=Counter)

    def take(self, one: Statement) -> None:
        """Read one statement."""
        if one.word == "FEAT" and one.kind in ("F", "FA"):
            self._feature(one)
        elif one.word == "FEAT" or one.kind in ("F", "FA"):
            told = f'"{shorten(f"{one.kind}({one.name})={one.word}", 30)}" is no feature of DMIS'
            self.problems.add(one.mark, f"{told}; write F(name)=FEAT/… or FA(name)=FEAT/…")
        elif one.word == "UNITS":
            self._units(one)
        elif one.word == "SNSLCT":
            found = LABEL.search(one.rest)
            self.probe = found[1].strip() if found else one.parts[0]
        elif one.word == "WKPLAN" and one.parts[0].upper() in PLANES:
            self.plane = one.parts[0].upper()
        elif one.word in SYSTEMS or one.word == "RECALL" and DATUM.match(one.rest):
            self._system(one)
        elif one.word == "MEAS":
            found = LABEL.search(one.rest)
            self.measuring = found[1].strip() if found else ""
        elif one.word == "ENDMES":
            self.measuring = ""
        elif one.word in ("PTMEAS", "PTDATA") and self.measuring:
            self.probed.setdefault(self.measuring, []).append(self._place(one, one.parts))
        elif one.word == "CONST" and one.parts[0].upper() == "SPHERE":
            names = [name.strip() for name in LABEL.findall(one.rest)]
            self.made_of[names[0] if names else ""] = names[1:]
        elif one.word == "TOL" and one.kind == "TA":
            self.others["tolerance"] += 1
        self.is_program |= one.word in OF_PROGRAMS
        self.is_ended |= one.word == "ENDFIL"

    def _units(self, one: Statement) -> None:
        name = one.parts[0].upper()
        if name not in UNITS:
            told = f'unknown unit "{shorten(name)}"; DMIS has {", ".join(UNITS)}'
            self.problems.add(one.mark, told)
        self.unit = UNITS.get(name, Fraction(1, 1000))
        self.angle = next((p.upper() for p in one.parts[1:] if p.upper() in ANGLES), self.angle)

    def _system(self, one: Statement) -> None:
        found = LABEL.search(one.rest)
        name = one.name or (found[1].strip() if found and one.word == "RECALL" else "")
        if one.word == "DATSET" and one.parts[0].upper() == "MCS":
            self.machine_systems.add(name)
            self.system, self.of = "machine", ""
        elif one.word == "RECALL" and name in self.machine_systems:
            self.system, self.of = "machine", ""
        else:
            self.system, self.of = "part", name

    def _feature(self, one: Statement) -> None:
        parts = one.parts
        kind = KINDS.get(parts[0].upper(), parts[0].lower())
        here = Feature(one.mark, one.name, kind, probe=self.probe, system=self.system, of=self.of)
        if kind in LOCATED:
            if parts[1:2] and parts[1].upper() in ("INNER", "OUTER"):
                parts = parts[1:]
            place = self._place(one, parts[1:], 4 if kind == SPHERE else 3)
            here = replace(here, centre=place)
        if one.kind == "FA":
            self.actual.setdefault(one.name, []).append(here)
            self.measuring = one.name if kind == SPHERE else ""
        else:
            self.nominal[one.name] = here

    def _place(self, one: Statement, parts: list[str], least: int = 3) -> Place:
        """The co-ordinates of a statement in metres, NaN after a message."""
        nowhere = math.nan, math.nan, math.nan
        form, *numbers = parts or [""]
        if self.unit is None:
            told = "no UNITS/ before the first feature; state the unit with --unit mm or --unit in"
            self.problems.add(one.mark, told)
            self.unit = Fraction(1, 1000)
        if form.upper() not in ("CART", "POL"):
            told = f'"{shorten(form)}" where CART or POL is expected'
            self.problems.add(one.mark, told)
            return nowhere
        if len(numbers) < least or one.is_cut:
            told = f"{len(numbers)} numbers instead of {least}; was the file cut off?"
            if len(numbers) >= least:
                told = "the file ends within this line; end it, or take a whole copy"
            self.problems.add(one.mark, told)
            return nowhere
        if _has_decimal_commas(numbers) or (least == 4 and not _is_sphere(numbers)):
            told = f"{len(numbers)} numbers where DMIS has {least}; are commas meant as decimal"
            self.problems.add(one.mark, f"{told} points? DMIS has points: export it so")
            return nowhere
        for text in numbers[3:least]:
            self.problems.length(text, self.unit, one.mark)
        if form.upper() == "CART":
            return self.problems.place(numbers[:3], self.unit, one.mark)
        radius = self.problems.length(numbers[0], self.unit, one.mark)
        height = self.problems.length(numbers[2], self.unit, one.mark)
        angle = self._angle(numbers[1], one.mark)
        place = [0.0, 0.0, 0.0]
        values = radius * math.cos(angle), radius * math.sin(angle), height
        for axis, value in zip(PLANES[self.plane], values, strict=True):
            place[axis] = value
        return place[0], place[1], place[2]

    def _angle(self, text: str, mark: Mark) -> float:
        """An angle in radians: a decimal number, or degrees, minutes and seconds."""
        try:
            parts = [exact_number(part) for part in text.lstrip("+-").split(":")]
        except QuantityError as error:
            self.problems.add(mark, str(error))
            return math.nan
        total = sum((part / 60**k for k, part in enumerate(parts)), Fraction(0))
        return float(total * ANGLES[self.angle]) * (-1.0 if text.startswith("-") else 1.0)


def _has_decimal_commas(numbers: list[str]) -> bool:
    """True if a number has zeros before its digits, as decimals behind a comma have.

    >>> _has_decimal_commas(["749", "99877", "-0", "00121"])
    True
    >>> _has_decimal_commas(["0.00121", "00749.998", "0"])
    False
    """
    return any(re.fullmatch(r"[+-]?0[0-9]+", one) for one in numbers)


def _is_sphere(numbers: list[str]) -> bool:
    """True if numbers are a centre and a diameter, and perhaps a direction."""
    if len(numbers) != 7:
        return len(numbers) == 4
    try:
        return abs(math.hypot(*map(float, numbers[4:])) - 1.0) < 0.01
    except ValueError:
        return False


def _of_points(reader: _Reader) -> Iterator[Feature]:
    """Spheres that have no actual centre, with the points that were probed on them."""
    for name, nominal in reader.nominal.items():
        if name in reader.actual or nominal.kind != SPHERE:
            continue
        points = reader.probed.get(name, [])
        lacks = "nominal only, not measured"
        if points and reader.is_program:
            points, lacks = [], "PTMEAS of a program are where to probe, not what was measured"
        for other in reader.made_of.get(name, ()):
            points += [one.centre for one in reader.actual.get(other, ()) if one.centre]
        found = np.array(points) if points else None
        lacks = "" if points else lacks
        yield replace(nominal, centre=None, points=found, lacks=lacks)


def read(content: bytes, file: str, unit: Fraction | None) -> Report:
    """Features of DMIS output; see `Format`.

    :raises ExperimentError: a statement about a feature is wrong, or the unit is not stated.
    """
    text = read_lines(content, file)
    reader = _Reader(ReportProblems(file), unit)
    for one in statements(text, reader.problems):
        reader.take(one)
    reader.problems.finish()
    features = [one for several in reader.actual.values() for one in several]
    features += _of_points(reader)
    features.sort(key=lambda one: one.mark.line)
    remarks = text.remarks
    if not reader.is_ended:
        remarks += (f"{file}: no ENDFIL at its end; the file may have been cut off",)
    return Report(file, DMIS.title, tuple(features), reader.others, remarks)


DMIS = Format("dmis", "DMIS output", lambda text: BEGINNING.search(text) is not None, read)
