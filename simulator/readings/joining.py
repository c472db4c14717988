"""Readings joined to the rows of a design by what they are readings of, never by order."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator

import numpy as np
from ballplate.simulator.design.arrays import Design, Readings
from ballplate.simulator.design.measurement import UnmatchedReadingsError, ensure_rows
from ballplate.simulator.inputs.number_arrays import Array, Integers

# Indices of the position, the ball and the probe of a reading.
ReadingKey = tuple[int, int, int]


def reading_keys(readings: Readings) -> list[ReadingKey]:
    """Return position, ball and probe of each reading."""
    table = np.stack([readings.position, readings.ball, readings.probe], axis=1)
    return [(row[0], row[1], row[2]) for row in table.tolist()]


def rows_of(design: Design, source: Design, readings: Readings) -> Integers:
    """Return the rows (m,) of a design's readings that single readings of another design belong
    to, by names of position, artefact, ball and probe; -1 for none.

    The same ones in several groups are taken in the order of reading, further ones with the last.
    """
    planned = defaultdict(list)
    rows = np.repeat(np.arange(len(design.readings)), design.readings.repeats).tolist()
    for row, name in zip(rows, _names(design, design.readings.expanded()), strict=True):
        planned[name].append(row)
    taken: Counter[tuple[str, ...]] = Counter()
    result = []
    for name in _names(source, readings):
        among = planned.get(name, [-1])
        result.append(among[min(taken[name], len(among) - 1)])
        taken[name] += 1
    return np.array(result, np.int64)


def joined(design: Design, source: Design, readings: Readings, x: Array) -> Array:
    """Return scale readings (m, d) of a design's m readings, the means of their repeats in metres,
    from single readings of another design, `source`, with scale readings `x` (rows, d).

    :raises UnmatchedReadingsError: the two have different readings.
    """
    ensure_rows(source, readings, x)
    rows, repeats = rows_of(design, source, readings), design.readings.repeats
    if not np.array_equal(np.bincount(rows + 1, minlength=len(repeats) + 1), [0, *repeats]):
        raise UnmatchedReadingsError("readings are not those of the design")
    total = np.zeros((len(repeats), x.shape[1]))
    np.add.at(total, rows, x)
    return total / repeats[:, None]


def _names(design: Design, readings: Readings) -> Iterator[tuple[str, ...]]:
    positions = design.positions
    for k, ball, probe in reading_keys(readings):
        artefact = design.artefacts.names[positions.artefact[k]]
        yield positions.names[k], artefact, design.balls.names[ball], design.probes.names[probe]
