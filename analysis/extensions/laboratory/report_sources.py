"""Readings straight from reports of measuring programs, instead of tables."""

from __future__ import annotations

import math
from collections.abc import Collection
from pathlib import Path

from ballplate.simulator.design import Design
from ballplate.simulator.experiment import ReadingsSettings
from ballplate.simulator.inputs import (
    LENGTH_UNITS,
    FileRow,
    GivenText,
    listing,
    plain_unit,
    refused,
)

from .any_table import TableRows
from .formats.registered import recognised
from .imported import ImportedReading, ImportSettings, report_readings
from .other_files import is_program


def report_rows(
    source: Path | GivenText,
    text: GivenText,
    design: Design,
    settings: ReadingsSettings,
    further: Collection[str],
) -> TableRows | None:
    """Rows of a report of a measuring program, without what is in `further` columns of tables; None
    where the file with this `text` is none.

    :raises ExperimentError: it is one, and wrong, or its names are not those of the design.
    """
    form = recognised(text.text)
    # Who names columns says that it is a table.
    if form is None or is_program(form, text.text) or settings.columns is not None:
        return None
    # A pipe has been read, and is empty now.
    is_file = isinstance(source, Path) and source.is_file()
    unit = None if settings.unit is None else LENGTH_UNITS[plain_unit(settings.unit)]
    of_holes = design.positions.across is not None
    imported = report_readings(
        [source if is_file else text],
        ImportSettings(
            *(design, settings.names, form.name, unit),
            of_holes,
            settings.encoding if is_file else None,
            settings.probes or {},
        ),
    )
    rows = tuple(_row(reading, design.dimension, len(further)) for reading in imported.readings)
    notes = (*imported.told, *imported.remarks)
    if any(reading.uncertainty is not None for reading in imported.readings):
        notes += ("these uncertainties are not used; import --uncertainty writes them for fit",)
    return TableRows(rows, notes, coordinates=imported.coordinates)


def _row(reading: ImportedReading, dimension: int, further: int) -> FileRow:
    x = [math.nan if reading.across == i else reading.centre[i] for i in range(dimension)]
    blank = [math.nan] * (1 + further)
    return FileRow(reading.mark, (reading.position, reading.ball, reading.probe), (*x, *blank))


def with_coordinates(
    settings: ReadingsSettings, sources: Collection[object], tables: Collection[TableRows]
) -> tuple[ReadingsSettings, tuple[str, ...]]:
    """Settings that say what co-ordinates are, where reports do, and that as text.

    :raises ExperimentError: reports say other than stated, or some files say it and others do not.
    """
    coordinates = {
        str(source): table.coordinates for source, table in zip(sources, tables, strict=True)
    }
    reports = [name for name, kind in coordinates.items() if kind is not None]
    if not reports:
        return settings, ()
    if settings.coordinates == "scale readings":
        text = (
            "the centres in a report have the offsets of probes applied, and scale readings are"
            " stated; state ball centres, with offsets_in_controller if the applied offsets differ"
        )
        raise refused(reports[0], text)
    if settings.coordinates is not None:
        return settings, ()
    kinds = {kind for kind in coordinates.values() if kind is not None}
    if len(kinds) > 1:
        part_reports = [name for name in reports if coordinates[name] == "part"]
        others_listed = listing(name for name in reports if name not in part_reports)
        text = (
            f"centres in a part's co-ordinate system, and others ({others_listed}) in the"
            " machine's; state coordinates if all are of one type, or fit each separately"
        )
        raise refused(part_reports[0], text)
    if len(reports) < len(coordinates):
        plain = [name for name, kind in coordinates.items() if kind is None]
        text = (
            f"a table beside reports ({listing(reports)}), which have ball centres; state what all"
            " co-ordinates are: readings: {coordinates: ball centres}"
        )
        raise refused(plain[0], text)
    kind = kinds.pop()
    chosen = settings.model_copy(update={"coordinates": kind})
    words = "part co-ordinates" if kind == "part" else "ball centres"
    return chosen, (f"co-ordinates are interpreted as {words}, as in reports",)
