"""Readings joined to the rows of a design by what they are readings of, never by order."""

from __future__ import annotations

from collections import Counter, defaultdict

import numpy as np

from ..design.arrays import Design, Readings, UnmatchedReadingsError, ensure_rows
from ..machines.protocol import Array, Integers

# Indices of the position, the ball and the probe of a reading.
ReadingKey = tuple[int, int, int]


def reading_keys(readings: Readings) -> list[ReadingKey]:
    """Return position, ball and probe of each reading."""
    table = np.stack([readings.position, readings.ball, readings.probe], axis=1)
    return [(row[0], row[1], row[2]) for row in table.tolist()]


def rows_of(design: Design, readings: Readings) -> Integers:
    """Return the rows (m,) of a design's readings that single readings belong to, -1 for none.

    The same ones in several groups are taken in the order of reading, further ones with the last.
    """
    planned = defaultdict(list)
    rows = np.repeat(np.arange(len(design.readings)), design.readings.repeats)
    for key, row in zip(reading_keys(design.readings.expanded()), rows.tolist(), strict=True):
        planned[key].append(row)
    taken: Counter[ReadingKey] = Counter()
    result = []
    for key in reading_keys(readings):
        among = planned.get(key, [-1])
        result.append(among[min(taken[key], len(among) - 1)])
        taken[key] += 1
    return np.array(result, np.int64)


def joined(design: Design, source: Design, readings: Readings, x: Array) -> Array:
    """Return scale readings (m, d) of a design's m readings, the means of their repeats in metres,
    from single readings of another design, `source`, with scale readings `x` (rows, d).

    Names of positions, artefacts, balls and probes match.

    :raises UnmatchedReadingsError: the two have different readings.
    """
    ensure_rows(source, readings, x)
    rows = rows_of(design, _of_names(design, source, readings))
    repeats = design.readings.repeats
    if not np.array_equal(np.bincount(rows + 1, minlength=len(repeats) + 1)[1:], repeats) or (
        len(rows) != repeats.sum()
    ):
        raise UnmatchedReadingsError("readings are not those of the design")
    # About one of them, so that the mean of equal readings is that reading.
    start, change = np.empty((2, len(repeats), x.shape[1]))
    start[rows], change[:] = x, 0.0
    np.add.at(change, rows, x - start[rows])
    return start + change / repeats[:, None]


def _of_names(design: Design, source: Design, readings: Readings) -> Readings:
    """Return readings of `source` as readings of `design`, with indices of the same names, -1
    without any.
    """
    columns = []
    for names, of, index in (
        (_balls(design), _balls(source), readings.ball),
        (design.positions.names, source.positions.names, readings.position),
        (design.probes.names, source.probes.names, readings.probe),
    ):
        place = {name: k for k, name in enumerate(names)}
        columns.append(np.array([place.get(name, -1) for name in of], np.int64)[index])
    return Readings(*columns, readings.repeats)


def _balls(design: Design) -> list[tuple[str, str]]:
    artefacts = (design.artefacts.names[k] for k in design.balls.artefact.tolist())
    return list(zip(artefacts, design.balls.names, strict=True))
