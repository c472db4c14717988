"""Recognition of files given as readings, or as certificate values, that hold something else."""

from __future__ import annotations

import re

from ballplate.simulator.inputs import GivenText, header_names

from .formats.registered import recognised
from .formats.report import Format

POINTS = frozenset(("feature", "nominal_x"))
CERTIFICATE = frozenset(("item", "first", "second", "value"))


def what_it_is(source: GivenText) -> str:
    """Return a description of a file without readings, and its use; empty if unknown."""
    names = header_names(source)
    if names >= POINTS:
        return (
            "this is a table of the nominal centres of balls, as ballplate sheet --points writes"
            " it, and has no readings; ballplate sheet --readings writes the table to fill in"
        )
    if names >= CERTIFICATE:
        return "these are values of certificates, not readings; give them with --certificate"
    form = recognised(source.text)
    if form is None:
        return ""
    if is_program(form, source.text):
        return (
            "this is a DMIS program, not a report; run it on the machine, then ballplate import on"
            " its output"
        )
    return (
        f"this is a report of a measuring program ({form.title}), and no table of readings; run"
        " ballplate import first, which makes one of it"
    )


def is_program(form: Format, text: str) -> bool:
    """True if a file of a format moves a machine, without any measured value."""
    return form.name == "dmis" and not re.search(r"^[ \t]*FA\(", text, re.MULTILINE)
