"""Compensation tables from Python."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from ballplate.arguments import (
    PathLike,
    map_or_path,
)
from ballplate.simulator.inputs import QuantityError, ensure_one_of, ensure_type

if TYPE_CHECKING:
    from ballplate.results import Fit
    from ballplate.simulator.maps import FittedMap

    from .compensation_tables import (
        MadeCompensation,
        ReadCompensation,
    )


TableFormatName = Literal["csv", "isg", "heidenhain"]
TableSense = Literal["corrections", "errors of indication"]


def compensation(
    machine: PathLike | Fit | FittedMap,
    format: TableFormatName,
    pitch: str | Sequence[float] | None = None,
    origin: str | Sequence[float] | None = None,
    sense: TableSense | None = None,
    volumetric: bool = False,
    without_rotations: bool = False,
    allow_lack_of_fit: bool = False,
) -> MadeCompensation:
    """A compensation table of a machine file or of a map, in the format csv, isg or heidenhain.

    `pitch` is the distance of positions, one for all axes or one for each, and `origin` where
    errors are zero: texts with units, or metres. `sense` is corrections or errors of indication.
    `files(stem)` of the result are the texts of its files.

    A map whose fit has a lack of fit beyond the limit is refused without `allow_lack_of_fit`.

    >>> import ballplate as bp
    >>> bp.compensation("designs/park/machines/npl-like.yaml", "isg", "50 mm")
    <MadeCompensation of npl-like: isg, 19, 24, 9 positions>
    """
    from .compensation_tables import (
        made_compensation,
        of_map,
        tabled_machine,
    )

    ensure_one_of(get_args(TableFormatName), format=str(format))
    ensure_one_of(get_args(TableSense), sense=sense)
    machine_given = map_or_path("machine", machine)
    if isinstance(machine_given, Path):
        label, (source, remarks) = (
            machine_given.stem,
            tabled_machine(machine_given, allow_lack_of_fit),
        )
    else:
        label, (source, remarks) = (
            machine_given.title,
            of_map(machine_given, machine_given.title, allow_lack_of_fit),
        )
    lengths = _metres("pitch", pitch), _metres("origin", origin)
    flags = volumetric, without_rotations
    return made_compensation(source, label, format, *lengths, sense, *flags, remarks)


def read_compensation(
    files: PathLike | Sequence[PathLike],
    format: TableFormatName,
    sense: TableSense | None = None,
    arrangement: str | None = None,
    origin: str | Sequence[float] | None = None,
) -> ReadCompensation:
    """The compensation table that files in the format csv, isg or heidenhain hold.

    What the files do not say is said beside them: the `sense`, corrections or errors of indication,
    the `arrangement` of the axes, such as MB2 or "probe x z, workpiece y", and the `origin` from
    which levers of rotations count. `correction(points)` of the result are corrections between the
    table's positions, `machine_files(stem)` the texts of a machine file.

    >>> import ballplate as bp
    >>> from tempfile import TemporaryDirectory
    >>> made = bp.compensation("designs/park/machines/npl-like.yaml", "isg")
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "table.csv")
    ...     _ = file.write_text(made.files("table")["table.csv"])
    ...     bp.read_compensation(file, "isg")
    <ReadCompensation of table: isg, 21, 21, 21 positions>
    """
    from .compensation_tables import read_compensation_files

    ensure_one_of(get_args(TableFormatName), format=str(format))
    ensure_one_of(get_args(TableSense), sense=sense)
    ensure_type(str, "an arrangement, such as MB2", arrangement=arrangement)
    several = [files] if isinstance(files, str | os.PathLike) else files
    paths = [Path(path) for path in several]
    if not paths:
        raise ValueError("files: no file; give one at least")
    return read_compensation_files(paths, format, sense, arrangement, _metres("origin", origin))


def _metres(name: str, stated: str | Sequence[float] | None) -> tuple[float, ...] | None:
    """Lengths in metres, of a text with units or of numbers."""
    from .compensation_tables import parse_lengths

    if stated is None:
        return None
    if isinstance(stated, str):
        try:
            return parse_lengths(stated)
        except QuantityError as error:
            raise ValueError(f"{name}: {error}") from None
    values = tuple(stated) if isinstance(stated, Iterable) else (stated,)
    if not all(isinstance(value, int | float) and math.isfinite(value) for value in values):
        raise TypeError(f"{name}={stated!r}; give lengths in metres, or a text with units")
    return tuple(float(value) for value in values)
