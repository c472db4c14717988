"""Names in one column of a table that state position, ball and probe, by the rule of names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ballplate.simulator.design import Design
from ballplate.simulator.experiment import ReadingsSettings
from ballplate.simulator.inputs import FileRow, shorten

from .any_table import TableRows
from .feature_names import Parts, fold, known_texts, named
from .heading_words import quoted
from .headings import TEXTS


def with_stated_names(
    table: TableRows, file: str, design: Design, settings: ReadingsSettings
) -> TableRows:
    """Return rows of a table with what the experiment's rule finds in the names of balls, and with
    the probes that it states; a table of the experiment's own names needs no rule.

    :raises ExperimentError: no name is of the rule, or a column states another name.
    """
    rule, others = settings.names, settings.probes or {}
    rows, told = table.rows, table.told
    if others:
        probes = known_texts("probe", design, others)
        rows = tuple(
            replace(row, texts=(*row.texts[:2], probes.get(fold(row.texts[2]), row.texts[2])))
            for row in rows
        )
    if rule is not None:
        names = [row.texts[1] for row in rows]
        parts_read: Sequence[Parts | None] = [{} for _ in names]
        if not set(names) <= set(design.balls.names):
            parts_read = named(names, rule, design, file, others).parts
            left = [name for name, parts in zip(names, parts_read, strict=True) if parts is None]
            more = f"; left out, of another form ({len(left)}): {quoted(left, 5)}" if left else ""
            told += (f"{file}: names are read as {rule}{more}",)
        rows = tuple(
            _with_parts(row, parts, Path(file).stem)
            for row, parts in zip(rows, parts_read, strict=True)
            if parts is not None
        )
    return replace(table, rows=rows, told=told)


def _with_parts(row: FileRow, parts: Parts, stem: str) -> FileRow:
    """Return a row with the names that are in that of its ball; its position is otherwise that of
    its column, or of the file's name.

    :raises ExperimentError: a column of the table states another name.
    """
    found = {**parts, "position": f"{parts.get('position', '')} {parts.get('run', '')}".strip()}
    texts = []
    for role, text in zip(TEXTS, row.texts, strict=True):
        part = found.get(role, "")
        if role != "ball" and text and part and fold(text) != fold(part):
            problem = f'the name "{shorten(row.texts[1])}" has the {role} {part}, and its column'
            raise row.mark.refused(f'{problem} "{shorten(text)}"; state one of them')
        texts.append(part or text)
    return replace(row, texts=(texts[0] or stem, *texts[1:]))
