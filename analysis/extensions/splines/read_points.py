"""Points of an error curve from a CSV file: an abscissa, or the nominal profile of a part, and an
error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from ballplate.simulator.inputs import (
    LENGTH_UNITS,
    header_cells,
    hint,
    listing,
    read_table,
    refused,
    table_lines,
)
from ballplate.simulator.machines import Array

EXAMPLE = "position_mm,error_um"
PROFILE = ("nominal_x", "nominal_z")
TEXTS = ("point", "feature")
ARC_LENGTH = "arc_length"
MOST_POINTS = 20_000


@dataclass(frozen=True)
class CurvePoints:
    """Points in the order of the file, in metres.

    `x` (m,) is not there where the abscissa is the arc length along the profile; `places` (m, 2),
    radius and axial co-ordinate, are not there where the file has no profile. `x_name` and `y_name`
    name abscissa and error.
    """

    names: tuple[str, ...]
    features: tuple[str, ...]
    x_name: str
    y_name: str
    x: Array | None = field(repr=False)
    y: Array = field(repr=False)
    places: Array | None = field(repr=False)

    def chosen(self, indices: Sequence[int]) -> CurvePoints:
        """Those of some indices."""
        index = list(indices)
        return CurvePoints(
            tuple(self.names[k] for k in index),
            tuple(self.features[k] for k in index),
            self.x_name,
            self.y_name,
            None if self.x is None else self.x[index],
            self.y[index],
            None if self.places is None else self.places[index],
        )


def read_points(path: Path, x: str | None = None, y: str | None = None) -> CurvePoints:
    """Read points from a file whose first line names the columns, each with its unit, such as
    position_mm,error_um.

    `x` and `y` choose columns, with or without the unit. Without `x` the abscissa is the arc
    length along the profile if the file has the columns nominal_x and nominal_z, otherwise the
    first column with a unit; without `y` the error is the only column left. `point` and `feature`
    are texts.

    :raises ExperimentError: all faults of the file at once.
    """
    lines = table_lines(path)
    if not lines:
        raise refused(path, f"the file is empty; its first line should be {EXAMPLE}")
    cells = list(header_cells(str(path), lines[0], EXAMPLE))
    columns = [name for _, _, name, unit in cells if unit in LENGTH_UNITS]
    texts = [text for text in TEXTS if text in [cell for _, cell, _, _ in cells]]
    try:
        x_name, y_name = _chosen_columns(columns, x, y)
    except ValueError as error:
        raise refused(path, str(error), line=lines[0].number) from None
    profile = PROFILE if set(PROFILE) <= set(columns) else ()
    wanted = list(dict.fromkeys([y_name, *profile, *([] if x_name is None else [x_name])]))
    others = [name for name in dict.fromkeys(columns) if name not in wanted]
    rows = read_table(path, texts, wanted, others, empty=others)
    if len(rows) > MOST_POINTS:
        raise refused(path, f"more than {MOST_POINTS} points; leave some out")
    labels = [dict(zip(texts, row.texts, strict=True)) for row in rows]
    names = [label.get("point", str(k)) for k, label in enumerate(labels, start=1)]
    seen: set[str] = set()
    for row, name in zip(rows, names, strict=True):
        if name in seen:
            raise row.mark.refused(f'a second point "{name}"; rename one')
        seen.add(name)
    table = np.array([row.lengths for row in rows])
    by_name = dict(zip([*wanted, *others], table.T, strict=True))
    return CurvePoints(
        tuple(names),
        tuple(label.get("feature", "") for label in labels),
        x_name or ARC_LENGTH,
        y_name,
        None if x_name is None else by_name[x_name],
        by_name[y_name],
        np.stack([by_name[name] for name in profile], axis=1) if profile else None,
    )


def _chosen_columns(columns: Sequence[str], x: str | None, y: str | None) -> tuple[str | None, str]:
    """Names of abscissa, None for the arc length, and error among columns of lengths.

    :raises ValueError: there is none, or no only one.
    """
    has_profile = set(PROFILE) <= set(columns)
    left = [name for name in columns if not (has_profile and name in PROFILE)]
    x_name = None
    if x == ARC_LENGTH and x not in columns:
        if not has_profile:
            text = "the arc length needs a profile; add the columns nominal_x_mm and nominal_z_mm"
            raise ValueError(text)
    elif x is not None:
        x_name = _named("x", x, columns)
    elif not has_profile and left:
        x_name = left[0]
    left = [name for name in left if name != x_name]
    if y is None and len(left) > 1:
        text = f"several columns may be the error: {listing(left)}; choose one with --y"
        raise ValueError(text)
    y_name = _named("y", y, columns) if y is not None else left[0] if left else None
    if y_name is None or y_name == x_name:
        text = "abscissa and error are two columns whose names end in a unit of length"
        raise ValueError(f"{text}; write for example {EXAMPLE}")
    return x_name, y_name


def _named(option: str, name: str, columns: Sequence[str]) -> str:
    plain = name if name in columns else name.rpartition("_")[0]
    if plain not in columns:
        text = f'no column "{name}" with a unit of length for --{option}; {hint(name, columns)}'
        raise ValueError(text)
    return plain


def choose_points(points: CurvePoints, text: str, file: str) -> list[int]:
    """Indices of the points that a text such as 12-32, 40 names.

    :raises ExperimentError: names that the file does not have.
    """
    indices = set()
    for part in (part.strip() for part in text.split(",")):
        first, _, last = (name.strip() for name in part.partition("-"))
        ends = [part] if part in points.names else [first, last]
        unknown = [name for name in ends if name not in points.names]
        if unknown:
            name = unknown[0] if "-" in part and all(ends) else part
            raise refused(file, f'no point "{name}"; {hint(name, points.names)}')
        start, end = points.names.index(ends[0]), points.names.index(ends[-1])
        indices |= {*range(start, end + 1)}
    return sorted(indices)
