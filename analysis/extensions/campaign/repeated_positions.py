"""Repeated readings of positions: later ones replace the earlier."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import groupby

from ballplate.simulator.design import Design
from ballplate.simulator.inputs import FileRow, number_of
from ballplate.simulator.readings import reading_keys

Names = tuple[str, ...]


def without_redone(
    rows: Sequence[FileRow], design: Design
) -> tuple[tuple[FileRow, ...], tuple[str, ...]]:
    """Return rows of readings in their order, without replaced ones, and notes on the rows left
    out.

    A position is read in runs of rows, separated by another position or file. A run that reads
    balls more often than planned follows a new set-up and replaces all earlier readings of the
    position. Repeats within a run replace earlier readings of the same ball and probe. A run of
    other balls or probes continues the position.
    """
    planned = _planned(design)
    rows_by_position: dict[str, list[int]] = {}
    left_out: dict[str, int] = {}
    repeated: dict[str, int] = {}
    runs = groupby(range(len(rows)), lambda i: (rows[i].mark.file, rows[i].texts[0]))
    for (_, position), members in runs:
        rows_by_reading: dict[Names, list[int]] = {}
        for i in members:
            rows_by_reading.setdefault(rows[i].texts, []).append(i)
        for texts, members_of_reading in rows_by_reading.items():
            surplus = len(members_of_reading) - planned[texts]
            if surplus > 0:
                repeated[position] = repeated.get(position, 0) + surplus
                del members_of_reading[:surplus]
        earlier = rows_by_position.get(position, [])
        count = Counter(rows[i].texts for i in earlier)
        if any(
            0 < count[texts] > planned[texts] - len(members_of_reading)
            for texts, members_of_reading in rows_by_reading.items()
        ):
            left_out[position] = left_out.get(position, 0) + len(earlier)
            earlier = []
        rows_by_position[position] = [
            *earlier,
            *(i for members_of_reading in rows_by_reading.values() for i in members_of_reading),
        ]
    notes = [
        f"{position} was read again: {number_of(count, 'reading')} taken before are left out"
        for position, count in left_out.items()
    ]
    notes += [
        f"{position}: of {number_of(count, 'reading')} {'that are' if count > 1 else 'that is'}"
        " repeated the last counts"
        for position, count in repeated.items()
    ]
    chosen = sorted(i for members in rows_by_position.values() for i in members)
    return tuple(rows[i] for i in chosen), tuple(notes)


def _planned(design: Design) -> Counter[Names]:
    """Return planned numbers of readings by names of position, ball and probe; at least 1."""
    readings = design.readings.expanded()
    planned = _AtLeastOnce(
        (design.positions.names[k], design.balls.names[ball], design.probes.names[probe])
        for k, ball, probe in reading_keys(readings)
    )
    return planned


class _AtLeastOnce(Counter[Names]):
    def __missing__(self, key: Names) -> int:
        return 1
