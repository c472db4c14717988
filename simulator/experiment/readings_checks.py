"""Checks of an experiment's `readings`: units, encodings, probes and the machine's correction."""

from __future__ import annotations

import codecs

from ballplate.simulator.inputs.messages import ExperimentError, Steps
from ballplate.simulator.inputs.quantities import QuantityError, parse_positive_length
from ballplate.simulator.inputs.settings import hint
from ballplate.simulator.inputs.units import LENGTH_UNITS, plain_unit

from .own_sections import needed_service
from .readings_section import ColumnsSettings, CompensationSettings, ReadingsSettings, check_rule
from .references import References
from .validation import Sections

AXES = ("x", "y", "z")


def check_readings(sections: Sections, references: References) -> None:
    """Report faults of the readings section beyond its form; read the file of a correction."""
    settings, problems = sections.readings, references.problems
    if not isinstance(settings, ReadingsSettings):
        return
    if settings.unit is not None and plain_unit(settings.unit) not in LENGTH_UNITS:
        text = f'unknown unit "{settings.unit}"; {hint(settings.unit, LENGTH_UNITS)}'
        problems.add(("readings", "unit"), text)
    if settings.encoding is not None and not is_text_encoding(settings.encoding):
        text = f'unknown encoding "{settings.encoding}"; write for example utf-8 or cp1252'
        problems.add(("readings", "encoding"), text)
    if settings.names is not None:
        try:
            check_rule(settings.names)
        except ValueError as error:
            problems.add(("readings", "names"), str(error))
    for name, probe in (settings.probes or {}).items():
        if probe not in references.probes:
            text = f'unknown probe "{probe}"; {hint(probe, references.probes)}'
            problems.add(("readings", "probes", name), text)
    if settings.columns is not None:
        if settings.columns.z is not None and references.dimension == 2:
            problems.add(("readings", "columns", "z"), "there are two dimensions; leave z out")
        for axis in AXES:
            columns = getattr(settings.columns, axis)
            if isinstance(columns, dict):
                _check_probes(list(columns), ("readings", "columns", axis), references)
        _check_constants(settings.columns, references)
    offsets = settings.offsets_in_controller or {}
    _check_probes(list(offsets), ("readings", "offsets_in_controller"), references)
    for name, offset in offsets.items():
        references.has_dimension(offset, ("readings", "offsets_in_controller", name))
    if offsets and settings.coordinates not in ("ball centres", "part"):
        text = "applies to coordinates: ball centres, or part; add it, or leave this out"
        problems.add(("readings", "offsets_in_controller"), text)
    _read_correction(settings, references)


def _check_constants(columns: ColumnsSettings, references: References) -> None:
    """Report settings that cannot be the same in all rows, and an invalid constant uncertainty."""
    if (columns.ball or "").startswith("="):
        text = "a ball is that of a reading, and not of all rows; name its column"
        references.problems.add(("readings", "columns", "ball"), text)
    if (columns.u or "").startswith("="):
        try:
            parse_positive_length((columns.u or "")[1:].strip())
        except QuantityError as error:
            text = f'{error}; of all rows write for example "=0.2 um"'
            references.problems.add(("readings", "columns", "u"), text)


def is_text_encoding(name: str) -> bool:
    """True if Python has a text encoding of this name.

    >>> is_text_encoding("cp1252"), is_text_encoding("zip"), is_text_encoding("cp 12520")
    (True, False, False)
    """
    try:
        codec = codecs.lookup(name)
        "".encode(name)
    except (LookupError, UnicodeError, ValueError):
        return False
    return codec.name not in ("idna", "punycode", "undefined", "unicode_escape")


def _check_probes(names: list[str], steps: Steps, references: References) -> None:
    for name in names:
        if name not in references.probes:
            text = f'unknown probe "{name}"; {hint(name, references.probes)}'
            references.problems.add((*steps, name), text, True)


def _read_correction(settings: ReadingsSettings, references: References) -> None:
    """Set a correction to subtract to that of its machine file."""
    correction = settings.compensation
    if not isinstance(correction, CompensationSettings):
        return
    steps = ("readings", "compensation", "file")
    if references.dimension == 2:
        text = "a machine file has 3 dimensions, but machine.volume has 2"
        references.problems.add(steps, text)
        return
    read = needed_service("machine_of_file", steps, references.problems)
    if read is None:
        return
    try:
        correction.set_machine(read(references.file(correction.file), references.trust))
    except ExperimentError as error:
        references.problems.take(error, steps)
