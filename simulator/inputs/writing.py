"""Text that is written: plain data as YAML, and cells of CSV that no spreadsheet computes."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any, ClassVar, TextIO

import yaml

from .yamltree import resolve_scalar


class PlainDumper(yaml.SafeDumper):
    """Writer without aliases that quotes texts with another meaning under YAML 1.1 or 1.2."""

    quote: ClassVar[str] = "'"

    def ignore_aliases(self, data: Any) -> bool:
        return True

    def represent_text(self, text: str) -> yaml.ScalarNode:
        try:
            is_text = resolve_scalar(text) is text
        except ValueError:
            is_text = False
        style = None if is_text else self.quote
        return self.represent_scalar("tag:yaml.org,2002:str", text, style=style)


PlainDumper.add_representer(str, PlainDumper.represent_text)


def yaml_text(
    data: Any,
    flow_style: bool | None = False,
    width: float = inf,
    dumper: type[PlainDumper] = PlainDumper,
) -> str:
    """Return plain data as YAML: in blocks, in one line (`flow_style` true), or with the innermost
    lists and mappings in one line each if nothing there is quoted (None), in lines of `width`.

    >>> print(yaml_text({"probes": ["down", "up"], "name": "1e-3"}, None), end="")
    probes: [down, up]
    name: '1e-3'
    """
    text: str = yaml.dump(
        data,
        Dumper=dumper,
        default_flow_style=flow_style,
        sort_keys=False,
        allow_unicode=True,
        width=width,
    )
    return text


# Start of a formula, behind the apostrophes that protect it; a sign alone is none.
_FORMULA = re.compile(r"'*[=+\-@\t\r].", re.DOTALL)
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|[+-]?(?:inf|nan)")


def cell_of_text(text: str) -> str:
    """Return the cell of a text, with an apostrophe before a formula.

    >>> [cell_of_text(text) for text in ("z low", "=1+1", "-0.25", "'=1+1")]
    ['z low', "'=1+1", '-0.25', "''=1+1"]
    """
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def text_of_cell(cell: str) -> str:
    """Return the text of a cell.

    >>> [text_of_cell(cell) for cell in ("z low", "'=1+1", "-0.25", "''=1+1", "'quoted'")]
    ['z low', '=1+1', '-0.25', "'=1+1", "'quoted'"]
    """
    protected = cell.startswith("'") and _FORMULA.match(cell) and not _NUMBER.fullmatch(cell[1:])
    return cell[1:] if protected else cell


@dataclass(frozen=True)
class CsvWriter:
    """Writer of rows of cells; lines end with a line feed."""

    stream: TextIO

    def writerow(self, cells: Sequence[Any]) -> None:
        """Write one row."""
        self.writerows([cells])

    def writerows(self, rows: Iterable[Sequence[Any]]) -> None:
        """Write several rows."""
        shown = (
            [cell_of_text(cell) if isinstance(cell, str) else cell for cell in row] for row in rows
        )
        csv.writer(self.stream, lineterminator="\n").writerows(shown)
