"""Tables of Calypso: characteristics (`…chr.txt`), a row for each co-ordinate of a feature, and
features (`…fet.txt`), a row for each, with English or German headings.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction

from ballplate.simulator.inputs import LENGTH_UNITS, Mark, shorten

from .columns import agrees, headings, is_number, with_point
from .report import AXES, UNSTATED, Feature, Format, Located, Report, ReportProblems, System
from .runs import runs_of
from .text import Text, read_lines

UNITS = {
    "mm": LENGTH_UNITS["mm"],
    "cm": LENGTH_UNITS["cm"],
    "m": LENGTH_UNITS["m"],
    "µm": LENGTH_UNITS["um"],
    "um": LENGTH_UNITS["um"],
    "inch": LENGTH_UNITS["in"],
    "in": LENGTH_UNITS["in"],
    "zoll": LENGTH_UNITS["in"],
}
# Headings in letters alone → what the column has.
OF_CHARACTERISTICS = {
    **dict.fromkeys(("id", "name", "characteristic", "merkmal", "bezeichnung", "feature"), "id"),
    **dict.fromkeys(("featureid", "element", "elementid"), "feature"),
    **dict.fromkeys(("actual", "act", "istwert", "ist", "measuredvalue", "messwert"), "actual"),
    **dict.fromkeys(("nominal", "nom", "sollwert", "soll", "nennmass", "nennma"), "nominal"),
    **dict.fromkeys(("deviation", "dev", "abweichung", "abw", "istsoll"), "deviation"),
    **dict.fromkeys(("unit", "einheit"), "unit"),
    **dict.fromkeys(("type", "typ"), "type"),
    **dict.fromkeys(("idsymbol", "idsymb", "symbol"), "symbol"),
}
OF_FEATURES = {
    **dict.fromkeys(("id", "name", "featureid", "element", "elementid", "bezeichnung"), "id"),
    **dict.fromkeys(("type", "typ", "idtype", "geotype", "geometry", "elementtyp"), "type"),
    **dict.fromkeys(("idsymbol", "idsymb", "symbol"), "symbol"),
    **dict.fromkeys(("x", "xactual", "xist", "xistwert"), "X"),
    **dict.fromkeys(("y", "yactual", "yist", "yistwert"), "Y"),
    **dict.fromkeys(("z", "zactual", "zist", "zistwert"), "Z"),
    **dict.fromkeys(("unit", "einheit"), "unit"),
    **dict.fromkeys(("stylus", "taster"), "stylus"),
    **dict.fromkeys(("alignment", "koordinatensystem"), "alignment"),
}
# Headings that only Calypso writes: those that many programs have do not tell whose a report is.
OF_CALYPSO = re.compile(
    "planid|partnb|idsymbol|featureid|featuresigma|warninglimitcf|natuppertolid|natlowertolid|"
    "groupname|fftphi|geotype|numpoints|apexangle"
)
# Alignments that are the machine's own system.
OF_MACHINE = ("gerät", "geraet", "machine", "cmm", "gerätekoordinatensystem", "device")
KINDS = {
    **dict.fromkeys(("sphere", "kugel"), "sphere"),
    **dict.fromkeys(("circle", "kreis"), "circle"),
    **dict.fromkeys(("plane", "ebene"), "plane"),
    **dict.fromkeys(("point", "punkt", "spacepoint", "raumpunkt"), "point"),
    **dict.fromkeys(("cylinder", "zylinder"), "cylinder"),
    **dict.fromkeys(("cone", "kegel"), "cone"),
    **dict.fromkeys(("line", "gerade", "line2d", "line3d"), "line"),
}
# A unit that is given once, above the table or in a heading.
STATED = re.compile(
    r"(?:unit|einheit|masseinheit|maßeinheit)s?\s{0,9}[:=]?\s{0,9}\W?(mm|cm|m|µm|inch|in|zoll)\b|"
    r"[\[(](mm|cm|µm|um|inch|in|zoll)[\])]",
    re.IGNORECASE,
)
AXIS = re.compile(r"([XYZ])(?:[-_ ]?(?:value|wert|coordinate|koordinate|position))?[0-9]*", re.I)
BEFORE = re.compile(r"([XYZ])[-_ ]?(?:value|wert)?[-_.: ]+(\S.*)", re.IGNORECASE)
BEHIND = re.compile(r"(\S.*?)[-_.: ]+([XYZ])(?:[-_ ]?(?:value|wert))?", re.IGNORECASE)
# Lines at the beginning among which the headings are.
MOST_BEFORE = 200
LONGEST = 300


@dataclass(frozen=True)
class _Table:
    """Where the columns are, what parts them, and the lines below."""

    text: Text
    separator: str
    columns: dict[str, int]
    start: int
    is_of_features: bool


def _cells(line: str, separator: str) -> list[str]:
    parts = re.split(separator, line.strip("\r\n") if "\t" in separator else line.strip())
    return [part.strip().strip('"').strip() for part in parts]


def _table(text: Text) -> _Table | None:
    """Return the table of a report: it begins with the first line of known headings."""
    for number, line in enumerate(text.lines[:MOST_BEFORE], start=1):
        for separator in ("\t", ";", r"\s{2,}", r"\s+"):
            cells = _cells(line, separator)
            for columns_known, needed in (
                (OF_CHARACTERISTICS, {"id", "actual"}),
                (OF_FEATURES, {"id", "X", "Y", "Z"}),
            ):
                columns = headings([STATED.sub("", cell) for cell in cells], columns_known)
                if needed <= columns.keys():
                    return _Table(text, separator, columns, number, "X" in needed)
    return None


def recognises(beginning: str) -> bool:
    """True if a text has headings of Calypso within its first lines, among them two that other
    programs do not have, or those of a printed table of characteristics and the program's name.
    """
    table = _table(Text("", tuple(beginning.splitlines()), (), False))
    if table is None:
        return False
    cells = _cells(table.text.lines[table.start - 1], table.separator)
    own = [cell for cell in cells if OF_CALYPSO.fullmatch(re.sub("[^a-z]", "", cell.casefold()))]
    return len(own) >= 2 or (
        not table.is_of_features
        and {"nominal", "deviation"} <= table.columns.keys()
        and "calypso" in beginning.casefold()
    )


@dataclass
class _Reader:
    table: _Table
    problems: ReportProblems
    unit: Fraction | None
    rows_taken: list[Located] = field(default_factory=list)
    others: Counter[str] = field(default_factory=Counter)

    def rows(self) -> Iterator[tuple[Mark, dict[str, str], dict[str, str]]]:
        """Yield each row by column, and other cells by heading; rows that end before the last
        required column are reported.
        """
        table, text = self.table, self.table.text
        names = ("id", *AXES) if table.is_of_features else ("id", "actual")
        needed = max(table.columns[name] for name in names)
        heads = _cells(text.lines[table.start - 1], table.separator)
        width, used = len(heads), {*table.columns.values()}
        for number, line in enumerate(text.lines[table.start :], start=table.start + 1):
            cells = _cells(line, table.separator)
            if not line.strip() or set(line.strip()) <= set("-=_*"):
                continue
            if len(cells) == 1 or (not table.is_of_features and not _has_number(cells)):
                self.others["line (text)"] += 1
                continue
            mark = text.mark(number)
            is_cut = text.is_cut and number == len(text.lines)
            if len(cells) <= needed or (is_cut and len(cells) - 1 in table.columns.values()):
                problem = f"{len(cells)} cells below {width} headings; was the line cut off?"
                self.problems.add(mark, problem)
                continue
            values = {name: cells[i] for name, i in table.columns.items() if i < len(cells)}
            if len(values["id"]) > LONGEST:
                self.problems.add(mark, f"a name of {len(values['id'])} characters")
                continue
            beside = zip(heads, cells, strict=False)
            yield mark, values, {h: cell for i, (h, cell) in enumerate(beside) if i not in used}

    def take(self, mark: Mark, row: dict[str, str], marks: dict[str, str]) -> None:
        """Read one row."""
        if self.table.is_of_features:
            self._feature(mark, row, marks)
            return
        axis, name = _axis_and_name(row)
        if not axis:
            self.others["other characteristic"] += 1
            return
        if not is_number(row["actual"]):
            problem = f'"{shorten(row["actual"])}" is no number'
            self.problems.add(mark, f"{problem}; leave the row out, or measure again")
            return
        if not _agrees(row):
            problem = f"{axis}: the deviation is not actual minus nominal; is the line damaged?"
            self.problems.add(mark, problem)
            return
        axes = {axis: self._length(mark, row, row["actual"])}
        self.rows_taken.append(Located(Feature(mark, name, UNSTATED, marks=marks), axes))

    def _feature(self, mark: Mark, row: dict[str, str], marks: dict[str, str]) -> None:
        words = [row.get("type", ""), row.get("symbol", "")]
        kinds = [
            KINDS[word]
            for word in (re.sub("[^a-z]", "", w.lower()) for w in words)
            if word in KINDS
        ]
        kind, alignment = kinds[0] if kinds else UNSTATED, row.get("alignment", "")
        system: System = "part" if alignment else "unstated"
        system = "machine" if alignment.casefold() in OF_MACHINE else system
        feature = Feature(
            *(mark, row["id"], kind),
            probe=row.get("stylus", ""),
            system=system,
            of=alignment,
            marks=marks,
        )
        located = Located(feature)
        for axis in AXES:
            if is_number(row[axis]):
                located.axes[axis] = self._length(mark, row, row[axis])
        self.rows_taken.append(located)

    def _length(self, mark: Mark, row: dict[str, str], text: str) -> float:
        name = row.get("unit", "").lower()
        unit = UNITS.get(name, None if name else self.unit)
        if unit is None:
            problem = "no column of units; state the unit with --unit mm or --unit in"
            problem = f'unknown unit "{shorten(name)}"' if name else problem
            self.problems.add(mark, problem)
            self.unit = LENGTH_UNITS["mm"]
            return math.nan
        return self.problems.length(with_point(text), unit, mark)

    def complete(self) -> list[Located]:
        """Return features with the co-ordinates of their rows, run by run; a co-ordinate that a
        feature has already begins another reading.
        """
        keys = [(row.feature.name, *row.axes) for row in self.rows_taken]
        runs, _ = runs_of(keys, [row.feature.marks for row in self.rows_taken])
        latest: dict[tuple[str, str], Located] = {}
        features = []
        for run, row in zip(runs, self.rows_taken, strict=True):
            located = latest.get((run, row.feature.name))
            if located and not (self.table.is_of_features or row.axes.keys() & located.axes.keys()):
                located.axes.update(row.axes)
                continue
            latest[run, row.feature.name] = row
            features.append(row)
        return features


def _has_number(cells: list[str]) -> bool:
    return any(is_number(cell) for cell in cells[1:])


def _axis_and_name(row: dict[str, str]) -> tuple[str, str]:
    """Return the axis and the feature of a characteristic; the axis is empty for others.

    Its type or symbol states the axis, and a column the feature; otherwise both are in its name.
    """
    types = (AXIS.fullmatch(row.get(column, "")) for column in ("type", "symbol"))
    axis = next((axis_match[1].upper() for axis_match in types if axis_match is not None), "")
    feature = row.get("feature", "")
    if axis and feature:
        return axis, feature
    before, behind = BEFORE.fullmatch(row["id"]), BEHIND.fullmatch(row["id"])
    if before is not None and axis in ("", before[1].upper()):
        return before[1].upper(), feature or before[2]
    if behind is not None and axis in ("", behind[2].upper()):
        return behind[2].upper(), feature or behind[1]
    return axis, feature or row["id"]


def _agrees(row: dict[str, str]) -> bool:
    """True if a row's deviation is the actual value less the nominal, if it has them."""
    deviation = row.get("deviation", "")
    # Some versions leave the deviation of what is within its tolerance at zero.
    is_left = set(deviation) <= set("+-0.,")
    return is_left or agrees(row["actual"], row.get("nominal", ""), deviation)


def read(content: bytes, file: str, unit: Fraction | None) -> Report:
    """Return features of a table of Calypso; see `Format`.

    :raises ExperimentError: no headings, an invalid or incomplete row, or no unit.
    """
    text, problems = read_lines(content, file), ReportProblems(file)
    table = _table(text)
    if table is None:
        problem = "no headings such as id, actual, nominal, or id, type, x, y, z"
        raise text.mark(1).refused(problem)
    for line in text.lines[: table.start] if unit is None else ():
        unit_match = STATED.search(line)
        unit = UNITS[(unit_match[1] or unit_match[2]).lower()] if unit_match else unit
    reader = _Reader(table, problems, unit)
    for mark, row, marks in reader.rows():
        reader.take(mark, row, marks)
    problems.finish()
    features = tuple(located.complete() for located in reader.complete())
    return Report(file, CALYPSO.title, features, reader.others, text.remarks)


CALYPSO = Format("calypso", "Calypso table", recognises, read)
