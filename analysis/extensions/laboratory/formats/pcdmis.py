"""Text reports of PC-DMIS: dimensions `DIM name= LOCATION OF SPHERE feature`, each with a table of
axes.

Newer reports head a dimension by its unit, its name and its feature: `MM  LOC1 - SPH1`.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import takewhile

from ballplate.simulator.inputs import LENGTH_UNITS, Mark, shorten

from .columns import agrees, is_number, with_point
from .report import AXES, CIRCLE, SPHERE, UNSTATED, Feature, Format, Located, Report, ReportProblems
from .runs import OF_RUNS
from .text import Text, read_lines

UNITS = {"MM": LENGTH_UNITS["mm"], "IN": LENGTH_UNITS["in"], "INCH": LENGTH_UNITS["in"]}
DIMENSION = re.compile(r"\s*DIM(?:ENSION)?\s+([^=]*[^=\s])\s*=\s*(.*)", re.IGNORECASE)
UNIT = re.compile(r"\bUNITS\s*=\s*(\w+)", re.IGNORECASE)
# What a dimension is, and of which kind of feature.
WHAT = re.compile(r"[A-Z0-9 ]*?\b(?:OF|FROM|BETWEEN)\s+\S+", re.IGNORECASE)
LOCATION = re.compile(r"LOCATION OF\s+(\S+)\s+(\S+)", re.IGNORECASE)
HEADED = re.compile(r"\s*(?:\S{1,3}\s+)?(MM|IN|INCH)\s+(\S.*?)\s+-\s+(\S.*?)\s*", re.IGNORECASE)
MEASURED = ("MEAS", "MEASURED")
NOMINALS = ("NOMINAL", "NOM")
ENDING = re.compile(r"\s*END OF DIMENSION\s+\S.*", re.IGNORECASE)
PROBE = re.compile(r"\s*(TIP|LOADPROBE)\s*/\s*([^,\s]+).*", re.IGNORECASE)
BEGINNING = re.compile(
    r"^[ \t]*(?:DIM(?:ENSION)?[ \t][^=\n]*=|AX[ \t]+(?:NOM|MEAS|\+TOL))|\bPC-?DMIS\b",
    re.MULTILINE | re.IGNORECASE,
)
# What stands about dimensions, such as `SER NUMBER : 2`.
BESIDE = re.compile(r"\b([A-Z][A-Z ]{1,20}?)\s*[:=]\s*(\S.*?)(?=\s\s|$)", re.IGNORECASE)
LONGEST = 1000


@dataclass
class _Dimension:
    """The current location of a feature, its unit, its columns (heading and end of each), and a
    flag for rows read.
    """

    mark: Mark
    name: str
    title: str
    kind: str
    unit: Fraction | None
    columns: list[tuple[str, int]] = field(default_factory=list)
    has_row: bool = False


@dataclass
class _Reader:
    text: Text
    problems: ReportProblems
    unit: Fraction | None
    probe: str = ""
    marks: dict[str, str] = field(default_factory=dict)
    dimension: _Dimension | None = None
    located: dict[str, Located] = field(default_factory=dict)
    complete: list[Located] = field(default_factory=list)
    others: Counter[str] = field(default_factory=Counter)

    def take(self, number: int, line: str) -> None:
        """Read one line."""
        mark = self.text.mark(number)
        if len(line) > LONGEST:
            self.problems.add(mark, f"{len(line)} characters are too long for a line of a report")
            return
        match = DIMENSION.fullmatch(line)
        if match is not None:
            unit = UNIT.search(match[2])
            self._end()
            self._start(match[1], match[2], unit[1] if unit else None, mark)
            return
        headed = HEADED.fullmatch(line)
        if headed is not None:
            self._end()
            unit_of_heading = UNITS[headed[1].upper()]
            self.dimension = _Dimension(mark, headed[3], headed[2], UNSTATED, unit_of_heading)
            return
        probe = PROBE.fullmatch(line)
        if probe is not None:
            self.probe = probe[2] if probe[1].upper() == "TIP" else self.probe
            return
        words = line.split()
        if not words:
            return
        first = words[0].upper()
        if first in ("DIM", "DIMENSION"):
            self._end()
            self.others["dimension (without its name and =)"] += 1
        elif ENDING.fullmatch(line):
            self._end()
        elif self.dimension is None or first not in ("AX", *AXES):
            self._beside(line)
        elif first == "AX":
            headings = list(re.finditer(r"\S+", line))[1:]
            self.dimension.columns = [(word[0].upper(), word.end()) for word in headings]
        else:
            self.dimension.has_row = True
            self._row(first, line, mark, number == len(self.text.lines))

    def _beside(self, line: str) -> None:
        """Take what a line says of the features below; another run begins other features."""
        for name, text in BESIDE.findall(line):
            before = self.marks.get(name.upper(), text)
            self.marks = self.marks | {name.upper(): text}
            if OF_RUNS.fullmatch(name) and text != before:
                self.located = {}

    def _end(self) -> None:
        """End the current dimension; a location without a row is skipped and reported."""
        ended, self.dimension = self.dimension, None
        if ended is None or ended.has_row:
            return
        if ended.kind != UNSTATED:
            self.complete.append(self._located(ended, ended.mark))
        elif ended.columns:
            self.others[f"dimension (no row {' or '.join(AXES)})"] += 1

    def finish(self) -> None:
        """End the file.

        :raises ExperimentError: earlier faults, or the file ends before the first row of a
            dimension or within its name.
        """
        last = self.text.lines[-1]
        if self.dimension is not None and not self.dimension.has_row:
            problem = (
                f'the file ends before the first row of "{shorten(self.dimension.title, 30)}"; it'
                " was cut off, take a whole copy"
            )
            self.problems.add(self.dimension.mark, problem)
        elif self.text.is_cut and last.split()[0].upper() in ("DIM", "DIMENSION"):
            problem = "the file ends within this line; it was cut off, take a whole copy"
            self.problems.add(self.text.mark(len(self.text.lines)), problem)
        self.problems.finish()

    def _start(self, title: str, words: str, unit: str | None, mark: Mark) -> None:
        located = LOCATION.match(words)
        if located is None or located[1].lower() not in (SPHERE, CIRCLE):
            self.dimension = None
            kind = WHAT.match(words)
            self.others[f"dimension ({shorten(kind[0].lower() if kind else words, 30)})"] += 1
            return
        if unit is not None and unit.upper() not in UNITS:
            self.problems.add(mark, f'unknown unit "{shorten(unit)}"; PC-DMIS has MM and IN')
        unit_of_dimension = UNITS.get(unit.upper(), self.unit) if unit is not None else self.unit
        self.dimension = _Dimension(
            mark, located[2].rstrip(","), title, located[1].lower(), unit_of_dimension
        )

    def _row(self, axis: str, line: str, mark: Mark, is_last: bool) -> None:
        assert self.dimension is not None
        names = [name for name, _ in self.dimension.columns]
        measured = next((name for name in MEASURED if name in names), None)
        if measured is None:
            problem = (
                "no column MEAS; report measured values, and head the columns AX NOMINAL MEAS …"
            )
            self.problems.add(mark, problem)
            return
        row = _by_column(line, self.dimension.columns)
        if row is None or measured not in row:
            problem = f"its numbers are not below the {len(names)} headings; was the line cut off?"
            self.problems.add(mark, problem)
            return
        if is_last and self.text.is_cut and line.rstrip().endswith(row[measured]):
            problem = "the file ends within this line; end it, or take a whole copy"
            self.problems.add(mark, problem)
            return
        if self.dimension.unit is None:
            problem = "no UNITS= of this dimension; state the unit with --unit mm or --unit in"
            self.problems.add(mark, problem)
            self.dimension.unit = LENGTH_UNITS["mm"]
        if not _agrees(row):
            problem = f"{axis}: the deviation is not measured minus nominal; is the line damaged?"
            self.problems.add(mark, problem)
            return
        value = self.problems.length(with_point(row[measured]), self.dimension.unit, mark)
        self._locate(axis, value, mark)

    def _located(self, found: _Dimension, mark: Mark) -> Located:
        return Located(
            Feature(
                *(mark, found.name, found.kind),
                probe=self.probe,
                dimension=found.title,
                marks=self.marks,
            )
        )

    def _locate(self, axis: str, value: float, mark: Mark) -> None:
        """Add a co-ordinate to its feature; one that it has already begins another reading."""
        assert self.dimension is not None
        name = self.dimension.name
        located = self.located.get(name)
        if located is None or axis in located.axes:
            self.located[name] = located = self._located(self.dimension, mark)
            self.complete.append(located)
        located.axes[axis] = value


def _by_column(line: str, columns: list[tuple[str, int]]) -> dict[str, str] | None:
    """Return the numbers of a row by column, if their assignment is unique.

    With blanks, numbers end below the ends of their headings.
    """
    matches = list(re.finditer(r"\S+", line))[1:]
    # Behind the numbers may stand a bar of characters.
    numbers = list(takewhile(lambda word: is_number(word[0]), matches))
    if len(numbers) == len(columns):
        return {name: word[0] for (name, _), word in zip(columns, numbers, strict=True)}
    ends = {end: name for name, end in columns}
    row = {ends[word.end()]: word[0] for word in numbers if word.end() in ends}
    # The deviation then checks it.
    is_clear = (
        len(row) == len(numbers) < len(columns)
        and "DEV" in row
        and not row.keys().isdisjoint(NOMINALS)
    )
    return row if is_clear else None


def _agrees(row: dict[str, str]) -> bool:
    """True if a row's deviation, if stated, is measured less nominal.

    An option of the program reverses its sign for negative nominal values.
    """
    actual, nominal, deviation = (
        next(filter(None, map(row.get, names)), "") for names in (MEASURED, NOMINALS, ("DEV",))
    )
    return agrees(actual, nominal, deviation, signed=False)


def read(content: bytes, file: str, unit: Fraction | None) -> Report:
    """Return features of a text report of PC-DMIS; see `Format`.

    :raises ExperimentError: an invalid row of a location, or no unit.
    """
    text = read_lines(content, file)
    reader = _Reader(text, ReportProblems(file), unit)
    for number, line in enumerate(text.lines, start=1):
        reader.take(number, line)
    reader.finish()
    features = tuple(located.complete() for located in reader.complete)
    return Report(file, PCDMIS.title, features, reader.others, text.remarks)


PCDMIS = Format("pcdmis", "PC-DMIS report", lambda text: BEGINNING.search(text) is not None, read)
