"""Readable formats, and recognition of a file's format."""

from __future__ import annotations

import re
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

from ballplate.simulator.inputs import (
    GivenText,
    listing,
    read_bytes,
    refused,
    text_and_encoding,
)

from .calypso import CALYPSO
from .dmis import DMIS
from .pcdmis import PCDMIS
from .qif import QIF
from .report import Format, Report

# Asked in this order: the first that recognises a file reads it.
FORMATS: tuple[Format, ...] = (QIF, DMIS, PCDMIS, CALYPSO)

NUMBER = re.compile("[+-]?[0-9]+(?:[.,][0-9]*)?(?:[eE][+-]?[0-9]+)?")

# Characters at the beginning of a file by which it is recognised.
BEGINNING = 100_000


def recognised(text: str) -> Format | None:
    """Return the format that the beginning of a text matches, if any."""
    beginning = "\n".join(text[:BEGINNING].splitlines())
    return next(
        (report_format for report_format in FORMATS if report_format.recognises(beginning)), None
    )


def is_table(text: str) -> bool:
    r"""True if lines of a text are rows of the same columns, of a name at least and three numbers.

    >>> is_table("p;b;x;y;z\nlow;1;0,1;2,5;3"), is_table("one, two, three, four\nfive")
    (True, False)
    """
    lines = [line for line in text[:BEGINNING].splitlines() if line.strip()]
    for separator in ("\t", ";", ","):
        for before, row in pairwise(lines[:50]):
            cells = row.split(separator)
            numbers = sum(NUMBER.fullmatch(cell.strip(' "')) is not None for cell in cells)
            if numbers >= 3 and 4 <= len(cells) == len(before.split(separator)):
                return True
    return False


def read_report(
    path: Path | GivenText,
    name: str | None = None,
    unit: Fraction | None = None,
    encoding: str | None = None,
) -> Report:
    """Return the report in a file, of the named format or of the one that recognises it.

    `unit` is metres per unit for a file without a unit, `encoding` that of a text, by default
    detected; XML states its own.

    :raises ExperimentError: the file cannot be read, is of unknown format, or is invalid.
    """
    content, file = read_bytes(path), str(path)
    text = text_and_encoding(content, file, encoding)[0]
    report_format = recognised(text)
    if name is not None:
        report_format = {known_format.name: known_format for known_format in FORMATS}[name]
    if report_format is not None:
        if encoding is not None and report_format is not QIF:
            content = text.encode("utf-8", "surrogatepass")
        return report_format.read(content, file, unit)
    if is_table(text):
        raise refused(file, "this is a table, which needs no import; ballplate fit reads it")
    titles = listing(known_format.title for known_format in FORMATS)
    names = ", ".join(known_format.name for known_format in FORMATS)
    text = f"not recognised as {titles}; state its format with --from ({names})"
    raise refused(file, text)
