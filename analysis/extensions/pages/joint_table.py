"""One table of the uncertainties of several designs, with a column for each."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from operator import itemgetter
from pathlib import Path
from typing import Any

from ballplate.presentation import Data, MainTable, Result, percent, table_lines
from ballplate.results import Prediction, map_lines, scale_lines, verdict_lines
from ballplate.simulator.inputs import cell_of_text, in_one_line, number_of

HEADINGS = ("symbol", "value", "unit")
# Letters of all names together, beyond which numbers replace them.
LETTERS = 60
# Numbers that are no part of a name.
NUMBER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)(?!\w)")


@dataclass(frozen=True, repr=False)
class JointTable(Result):
    """Rank and predicted uncertainties of several designs, a column for each.

    There is a row for each value of each symbol and unit: NaN if undetermined, None if the design
    lacks the quantity. `notes` are all that qualifies the values, once if common to all designs,
    otherwise with their names; of lines that differ in numbers only, the numbers follow the order
    of the names.
    """

    predictions: tuple[Prediction, ...]
    label = "joint table"
    title = "predicted standard uncertainties"

    @cached_property
    def names(self) -> list[str]:
        """Headings of the designs: variants, or labels; numbers if these are long or ambiguous."""
        names = [getattr(p.experiment, "name", None) or p.label for p in self.predictions]
        text = ", ".join(map(cell_of_text, names))
        # Others are equal, headings, formulas, or have commas, which may end in a unit.
        plain = {*names} & {*text.split(", ")} - {*HEADINGS}
        if len(plain) == len(names) and len(text) <= LETTERS and text.isprintable():
            return names
        return [str(k) for k, _ in enumerate(names, start=1)]

    def headline(self) -> str:
        return number_of(len(self.names), "design")

    def data(self) -> Data:
        return {"designs": [p.data() for p in self.predictions]}

    def columns(self) -> MainTable:
        cells = list(map(_values, self.predictions))
        names = (*HEADINGS, *self.names)
        items = [
            dict(zip(names, (*key, *(each.get(key) for each in cells)), strict=True))
            for key in sorted({*chain(*cells)})
        ]
        return {name: itemgetter(name) for name in names} | {"unit": "unit"}, items

    def lines(self) -> list[str]:
        return [self.heading, "", *table_lines(*self.columns()), ""]

    @property
    def notes(self) -> tuple[str, ...]:
        found: dict[str, list[Any]] = {}
        for name, p in zip(self.names, self.predictions, strict=True):
            if name.isdigit():
                found[f"{name} {p.label}"] = [(name, p.label)]
            # Expected directions are those of the deficiency in the table.
            judged = replace(p.verdict, null=()) if p.verdict.as_expected else p.verdict
            rank = verdict_lines(judged, lengths=p.lengths)
            scale = (*map_lines(p.experiment), *scale_lines(p.scale))
            for line in (p.title, *rank, *scale, *p.qualified):
                found.setdefault(NUMBER.sub("#", line), []).append((name, line))
        return tuple(map(self._joined, found.values()))

    def _joined(self, found: list[Any]) -> str:
        names, lines = zip(*found, strict=True)
        parts = zip(*map(NUMBER.split, lines), strict=True)
        text = "".join(p[0] if len({*p}) == 1 else " / ".join(p) for p in parts)
        is_common = names == (*self.names,) and len({*lines}) == 1
        return text if is_common else f"{', '.join(dict.fromkeys(names))}: {text}"

    def write_to(self, path: Path) -> None:
        """Write the table in the format of the name's suffix, .md, .tex, .txt, .csv or .xlsx, the
        last two in metres and radians, with notes in rows below.

        :raises ImportError: openpyxl is missing, which .xlsx needs.
        :raises OSError: the file cannot be written.
        """
        import pandas

        texts = {".md": self.to_markdown, ".tex": self.to_latex, ".txt": self.__str__}
        below = [{"symbol": cell_of_text(in_one_line(note))} for note in self.notes]
        frame = pandas.DataFrame([*self.rows(), *below])
        if path.suffix == ".xlsx":
            frame.to_excel(path, index=False)
        elif path.suffix == ".csv":
            frame.to_csv(path, index=False, lineterminator="\n")
        else:
            path.write_bytes(texts[path.suffix]().encode())


def joint_table(*predictions: Prediction) -> JointTable:
    """Return one table of predictions with a column for each, as `run` of several designs prints.

    >>> import ballplate as bp
    >>> table = bp.joint_table(*map(bp.run, bp.load_all("designs/npl/5.2.yaml")))
    >>> list(table.to_frame().columns)
    ['symbol', 'value', 'unit', 'kinematic fit', 'empirical fit']
    """
    return JointTable(predictions)


def _values(p: Prediction) -> dict[Any, Any]:
    """Return the values of a design by symbol, kind of value and unit."""
    values: Any = {("", "rank deficiency", ""): p.verdict.deficiency}
    values["", "rank as expected", ""] = p.verdict.as_expected
    for symbol, q in p.quantities.items():
        # Lengths and angles together have neither maximum nor average.
        if ", " not in q.unit:
            values[symbol, "maximum", q.unit] = q.maximum
            values[symbol, "average", q.unit] = q.average
            if q.undetermined:
                values[symbol, "undetermined", ""] = f"{q.undetermined} of {q.count}"
        if q.within_target is not None:
            kind = f"within target (k = {q.coverage_factor:g})"
            values[symbol, kind, ""] = percent(q.within_target)
    return values
