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
# What may tell runs of a program in one file apart.
OF_RUNS = ("FILNAM", "PARTID", "PARTSN", "PARTRV", "LOTID", "DATE", "TIME")
QUOTED = re.compile(r"\s*(['\"])(.*?)\1")
SYSTEMS = ("DATSET", "TRANS", "ROTATE", "LOCATE", "TRMATX")


@dataclass(frozen=True)
class Statement:
    """A statement with its continuation lines joined; `kind` and `name` precede the =."""

    mark: Mark
    kind: str
    name: str
    word: str
    rest: str
    is_cut: bool

    @property
    def parts(self) -> list[str]:
        """Parts between commas."""
        return [part.strip() for part in self.rest.split(",")]


def statements(text: Text, problems: ReportProblems) -> Iterator[Statement]:
    """Yield statements of a file without comments; invalid ones are reported."""
    joined, start = "", 0
    for number, line in enumerate(text.lines, start=1):
        stripped = line.strip()
        if stripped.startswith("$$") or not stripped and not joined:
            continue
        start = start if joined else number
        joined += stripped.removesuffix("$").rstrip()
        if stripped.endswith("$"):
            continue
        match = STATEMENT.fullmatch(joined)
        if match is not None:
            kind, name, word, groups = ((group or "").strip() for group in match.groups())
            last = text.is_cut and number == len(text.lines)
            yield Statement(text.mark(start), kind.upper(), name, word.upper(), groups, last)
        elif re.match(r"\s*FA?\s*\(", joined, re.IGNORECASE):
            problem = (
                f'"{shorten(joined)}" is no DMIS statement; check whether the file is complete'
            )
            problems.add(text.mark(start), problem)
        joined = ""
    if joined:
        problem = "the file ends within a statement; it was cut off, take a whole copy"
        problems.add(text.mark(start), problem)


@dataclass
class _Reader:
    """State set by earlier statements, and the features read."""

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
    marks: dict[str, str] = field(default_factory=dict)
    files: int = 0
    # Points by the sphere that they are on, as probed in each measurement of it and as features
    # that it is made of.
    probed: dict[str, list[tuple[dict[str, str], list[Place]]]] = field(default_factory=dict)
    made_of: dict[str, list[str]] = field(default_factory=dict)
    others: Counter[str] = field(default_factory=Counter)

    def take(self, statement: Statement) -> None:
        """Read one statement."""
        if statement.word == "FEAT" and statement.kind in ("F", "FA"):
            self._feature(statement)
        elif statement.word == "FEAT" or statement.kind in ("F", "FA"):
            words = shorten(f"{statement.kind}({statement.name})={statement.word}", 30)
            text = f'"{words}" is no feature of DMIS'
            self.problems.add(statement.mark, f"{text}; write F(name)=FEAT/… or FA(name)=FEAT/…")
        elif statement.word == "UNITS":
            self._units(statement)
        elif statement.word == "SNSLCT":
            label = LABEL.search(statement.rest)
            self.probe = label[1].strip() if label else statement.parts[0]
        elif statement.word == "WKPLAN" and statement.parts[0].upper() in PLANES:
            self.plane = statement.parts[0].upper()
        elif (
            statement.word in SYSTEMS or statement.word == "RECALL" and DATUM.match(statement.rest)
        ):
            self._system(statement)
        elif statement.word == "MEAS":
            label = LABEL.search(statement.rest)
            self._measure(label[1].strip() if label else "")
        elif statement.word == "ENDMES":
            self.measuring = ""
        elif statement.word in ("PTMEAS", "PTDATA") and self.measuring:
            self.probed[self.measuring][-1][1].append(self._place(statement, statement.parts))
        elif statement.word == "CONST" and statement.parts[0].upper() == "SPHERE":
            names = [name.strip() for name in LABEL.findall(statement.rest)]
            self.made_of[names[0] if names else ""] = names[1:]
        elif statement.word == "TOL" and statement.kind == "TA":
            self.others["tolerance"] += 1
        elif statement.word in OF_RUNS:
            # The same program, run again, has the same name.
            self.files += statement.word == "FILNAM"
            quoted = QUOTED.match(statement.rest)
            text = quoted[2].strip() if quoted else statement.rest.strip("'\" ")
            text += f" {self.files}" if statement.word == "FILNAM" else ""
            self.marks = self.marks | {statement.word: text}
        self.is_program |= statement.word in OF_PROGRAMS
        self.is_ended |= statement.word == "ENDFIL"

    def _measure(self, name: str) -> None:
        """Begin a measurement of a feature."""
        self.measuring = name
        self.probed.setdefault(name, []).append((self.marks, []))

    def _units(self, statement: Statement) -> None:
        name = statement.parts[0].upper()
        if name not in UNITS:
            problem = f'unknown unit "{shorten(name)}"; DMIS has {", ".join(UNITS)}'
            self.problems.add(statement.mark, problem)
        self.unit = UNITS.get(name, Fraction(1, 1000))
        self.angle = next(
            (p.upper() for p in statement.parts[1:] if p.upper() in ANGLES), self.angle
        )

    def _system(self, statement: Statement) -> None:
        label = LABEL.search(statement.rest)
        name = statement.name or (label[1].strip() if label and statement.word == "RECALL" else "")
        if statement.word == "DATSET" and statement.parts[0].upper() == "MCS":
            self.machine_systems.add(name)
            self.system, self.of = "machine", ""
        elif statement.word == "RECALL" and name in self.machine_systems:
            self.system, self.of = "machine", ""
        else:
            self.system, self.of = "part", name

    def _feature(self, statement: Statement) -> None:
        parts = statement.parts
        kind = KINDS.get(parts[0].upper(), parts[0].lower())
        here = Feature(
            *(statement.mark, statement.name, kind),
            probe=self.probe,
            system=self.system,
            of=self.of,
            marks=self.marks,
        )
        if kind in LOCATED:
            if parts[1:2] and parts[1].upper() in ("INNER", "OUTER"):
                parts = parts[1:]
            place = self._place(statement, parts[1:], 4 if kind == SPHERE else 3)
            here = replace(here, centre=place)
        if statement.kind == "FA":
            self.actual.setdefault(statement.name, []).append(here)
            self._measure(statement.name if kind == SPHERE else "")
        else:
            self.nominal[statement.name] = here

    def _place(self, statement: Statement, parts: list[str], least: int = 3) -> Place:
        """The co-ordinates of a statement in metres, NaN after a message."""
        nowhere = math.nan, math.nan, math.nan
        form, *numbers = parts or [""]
        if self.unit is None:
            problem = (
                "no UNITS/ before the first feature; state the unit with --unit mm or --unit in"
            )
            self.problems.add(statement.mark, problem)
            self.unit = Fraction(1, 1000)
        if form.upper() not in ("CART", "POL"):
            problem = f'"{shorten(form)}" where CART or POL is expected'
            self.problems.add(statement.mark, problem)
            return nowhere
        if len(numbers) < least or statement.is_cut:
            problem = f"{len(numbers)} numbers instead of {least}; was the file cut off?"
            if len(numbers) >= least:
                problem = "the file ends within this line; end it, or take a whole copy"
            self.problems.add(statement.mark, problem)
            return nowhere
        if _has_decimal_commas(numbers) or (least == 4 and not _is_sphere(numbers)):
            problem = f"{len(numbers)} numbers where DMIS has {least}; are commas meant as decimal"
            self.problems.add(statement.mark, f"{problem} points? DMIS has points: export it so")
            return nowhere
        for text in numbers[3:least]:
            self.problems.length(text, self.unit, statement.mark)
        if form.upper() == "CART":
            return self.problems.place(numbers[:3], self.unit, statement.mark)
        radius = self.problems.length(numbers[0], self.unit, statement.mark)
        height = self.problems.length(numbers[2], self.unit, statement.mark)
        angle = self._angle(numbers[1], statement.mark)
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
    return any(re.fullmatch(r"[+-]?0[0-9]+", number) for number in numbers)


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
        measured = [(marks, [*points]) for marks, points in reader.probed.get(name, ())]
        lacks = "nominal only, not measured"
        if any(points for _, points in measured) and reader.is_program:
            measured = []
            lacks = "PTMEAS of a program are points to probe, not measured points"
        for part in reader.made_of.get(name, ()):
            for k, point in enumerate(reader.actual.get(part, ())):
                measured += [(dict(point.marks), [])] if k == len(measured) else []
                measured[k][1].extend([point.centre] if point.centre else [])
        for marks, points in measured or [(dict(nominal.marks), [])]:
            array = np.array(points) if points else None
            lack = "" if points else lacks
            yield replace(nominal, centre=None, points=array, lacks=lack, marks=marks)


def read(content: bytes, file: str, unit: Fraction | None) -> Report:
    """Return features of DMIS output; see `Format`.

    :raises ExperimentError: an invalid statement about a feature, or no unit.
    """
    text = read_lines(content, file)
    reader = _Reader(ReportProblems(file), unit)
    for statement in statements(text, reader.problems):
        reader.take(statement)
    reader.problems.finish()
    features = [statement for several in reader.actual.values() for statement in several]
    features += _of_points(reader)
    features.sort(key=lambda statement: statement.mark.line)
    remarks = text.remarks
    if not reader.is_ended:
        remarks += (f"{file}: no ENDFIL at its end; the file may have been cut off",)
    return Report(file, DMIS.title, tuple(features), reader.others, remarks)


DMIS = Format("dmis", "DMIS output", lambda text: BEGINNING.search(text) is not None, read)
