"""Readable formats, and recognition of a file's format."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from ballplate.simulator.inputs import GivenText, listing, read_bytes, refused, text_and_encoding

from .calypso import CALYPSO
from .dmis import DMIS
from .pcdmis import PCDMIS
from .qif import QIF
from .report import Format, Report

# Asked in this order: the first that recognises a file reads it.
FORMATS: tuple[Format, ...] = (QIF, DMIS, PCDMIS, CALYPSO)

# Characters at the beginning of a file by which it is recognised.
BEGINNING = 100_000


def recognised(text: str) -> Format | None:
    """Return the format that the beginning of a text matches, if any."""
    beginning = "\n".join(text[:BEGINNING].splitlines())
    return next(
        (report_format for report_format in FORMATS if report_format.recognises(beginning)), None
    )


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
    titles = listing(known_format.title for known_format in FORMATS)
    names = ", ".join(known_format.name for known_format in FORMATS)
    text = f"not recognised as {titles}; state its format with --from ({names}); a table needs no"
    raise refused(file, f"{text} import: ballplate fit reads it")
