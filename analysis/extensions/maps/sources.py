"""Maps to be compared, from files: map files, machine files, experiments with their readings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from ballplate.results import Fit
from ballplate.simulator.inputs import LengthFunction

from ..machine_files import FittedMap, MachineDescription, load_machine, read_map
from .compared_maps import ComparedMap, NotComparableError, expected_map, map_of_fit
from .comparison import compared
from .fit_files import fit_of_file, kind_of_file
from .map_difference import MapDifference
from .shared_certificates import with_shared_certificates

Side = Path | Fit | FittedMap


def map_difference(
    sides: tuple[Side, Side],
    *,
    coverage_factor: float = 2.0,
    grid: int = 4,
    probe: str | None = None,
    shared: bool = False,
    stated: LengthFunction | None = None,
    dates: tuple[str | None, str | None] = (None, None),
) -> MapDifference:
    """Return the second of two `sides` less the first: each a fit, a fitted map, or the path of a
    map file, a machine file or an experiment that names its readings.

    With `shared`, errors of certified values common to both fits cancel. `stated` is the standard
    uncertainty of lengths by a machine file; `dates` are days of the campaigns, by default those of
    the maps.

    :raises ExperimentError: a file is wrong.
    :raises NotComparableError: the maps, or what is asked for, do not go together.
    """
    labels = _labels(sides)
    described = [
        load_machine(side) if isinstance(side, Path) and kind_of_file(side) == "machine" else None
        for side in sides
    ]
    if all(described):
        text = "both files describe machines; name at least one map or fit"
        raise NotComparableError(text)
    if stated is not None and not any(described):
        raise NotComparableError(
            "a stated uncertainty needs a machine file; name one, or leave it out"
        )
    measured = [
        None if machine else _measured(side, label, day)
        for side, label, day, machine in zip(sides, labels, dates, described, strict=True)
    ]
    dimension = next(
        compared_map.dimension for compared_map in measured if compared_map is not None
    )
    first, second = (
        compared_map or _expected(machine, label, dimension, stated, day)
        for compared_map, machine, label, day in zip(
            measured, described, labels, dates, strict=True
        )
    )
    count = None
    if shared:
        first, second, count = with_shared_certificates(first, second)
    comparison = compared(first, second, coverage_factor, grid, probe)
    return MapDifference(first, second, comparison, coverage_factor, count)


def _expected(
    machine: MachineDescription | None,
    label: str,
    dimension: int,
    stated: LengthFunction | None,
    day: str | None,
) -> ComparedMap:
    assert machine is not None
    return expected_map(machine, label, dimension, stated, day)


def _labels(sides: tuple[Side, Side]) -> tuple[str, str]:
    """Short names of both sides that differ."""
    names = [
        side.stem
        if isinstance(side, Path)
        else side.experiment
        if isinstance(side, FittedMap)
        else side.label
        for side in sides
    ]
    paths = [
        str(side) if isinstance(side, Path) else name
        for side, name in zip(sides, names, strict=True)
    ]
    for first, second in (names, paths):
        if first != second and first and second:
            return first, second
    return "first", "second"


def _measured(side: Side, label: str, day: str | None) -> ComparedMap:
    if isinstance(side, Fit):
        return map_of_fit(side, label, day)
    if isinstance(side, Path):
        if kind_of_file(side) == "experiment":
            return map_of_fit(fit_of_file(side), label, day)
        side = read_map(side)
    own_values = slice(len(side.values))
    return ComparedMap(
        label,
        side.title,
        side.model,
        side.values,
        side.root[own_values],
        side.undetermined[own_values],
        np.zeros((len(side.values), 0)),
        side.degrees_of_freedom if side.sigma_is_estimated else np.inf,
        side.volume,
        dict(zip(side.probes.names, side.probes.offsets, strict=True)),
        side.probe,
        day or side.date,
        data=side.data,
        lack_of_fit=side.lack_of_fit,
        cautions=(side.lack_of_fit.caution,),
        sigma=side.sigma,
    )
