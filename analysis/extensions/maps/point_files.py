"""Points of a CSV file, which are to be corrected."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from ballplate.simulator.design import Volume
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import (
    MORE_ERRORS,
    MOST_MESSAGES,
    ExperimentError,
    GivenText,
    Message,
    header_names,
    hint,
    read_table,
)
from ballplate.simulator.machines import Array, Integers

# Columns of text that a file may have; the first three name its points.
NAMING, PROBE = ("name", "position", "ball"), "probe"


@dataclass(frozen=True, eq=False)
class GivenPoints:
    """Scale readings `points` (n, d) in metres, their names, if any, and probe indices (n,)."""

    points: Array
    names: tuple[str, ...]
    probes: Integers

    def name(self, i: int) -> str:
        """The name of a point, or its number from 1."""
        return self.names[i] or f"point {i + 1}"

    @cached_property
    def times(self) -> Counter[str]:
        """Number of points of each name."""
        return Counter(name for name in self.names if name)

    @cached_property
    def places(self) -> dict[str, int]:
        """The last point of each name."""
        return {name: i for i, name in enumerate(self.names)}


def read_points(
    source: Path | GivenText,
    probes: tuple[str, ...],
    probe: str,
    volume: Volume,
    offsets: Array | None = None,
) -> GivenPoints:
    """Return points of a CSV file with the columns x_mm, y_mm and z_mm, or in another unit,
    optionally name, or position and ball, and probe (default: `probe` of the `probes`).

    With `offsets` (l, d) of probes, the points of the file already include them.

    :raises ExperimentError: a wrong table, unknown probes, or points far outside the volume.
    """
    d = len(volume.lower)
    there = header_names(source)
    texts = tuple(name for name in (*NAMING, PROBE) if name in there)
    rows = read_table(source, texts, AXIS_NAMES[:d])
    points = np.array([row.lengths for row in rows])
    messages: list[Message] = []
    probe_indices = {name: k for k, name in enumerate(probes)}
    probe_names = [probe] * len(rows)
    if PROBE in texts:
        probe_names = [row.texts[texts.index(PROBE)] for row in rows]
    for row, name in zip(rows, probe_names, strict=True):
        if name not in probe_indices and len(messages) < MOST_MESSAGES:
            messages.append(
                row.mark.message("", f'unknown probe "{name}"; {hint(name, probe_indices)}')
            )
    for i, axis in np.argwhere(volume.far_outside(points)).tolist():
        text = (
            f"{AXIS_NAMES[axis]} is {points[i, axis]:.6g} m, far outside the volume; check the unit"
        )
        messages.append(rows[i].mark.message("", text))
        if len(messages) >= MOST_MESSAGES:
            messages.append(rows[i].mark.message("", MORE_ERRORS))
            break
    if messages:
        raise ExperimentError(messages)
    named = [k for k, name in enumerate(texts) if name in NAMING]
    names = tuple(" ".join(row.texts[k] for k in named) for row in rows)
    indices = np.array([probe_indices[name] for name in probe_names], np.int64)
    if offsets is not None:
        points = points - offsets[indices]
    return GivenPoints(points, names, indices)
