"""Error maps from Python: corrected points, curves, differences."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ballplate.arguments import PathLike, table_of
from ballplate.simulator.inputs import (
    GivenText,
    ensure_one_of,
    ensure_positive,
    ensure_type,
    ensure_whole,
    hint,
)

from ..machine_files import fit_map_or_path, fitted_map_of, map_or_path

if TYPE_CHECKING:
    import pandas
    from ballplate.results import Fit
    from ballplate.simulator.machines import Array

    from ..machine_files import FittedMap
    from .correction import Correction
    from .error_curves_result import ErrorCurves
    from .error_map import ErrorMap
    from .map_difference import MapDifference
    from .map_places import Line


def diff(
    first: Fit | FittedMap | PathLike,
    second: Fit | FittedMap | PathLike,
    *,
    grid: int = 4,
    probe: str | None = None,
    coverage_factor: float = 2.0,
    shared: Literal["certificate"] | None = None,
    stated: str | None = None,
    dates: tuple[str | None, str | None] = (None, None),
) -> MapDifference:
    """Return the second of two maps less the first: lengths, errors at points without the free
    motion of the frame, error functions, and balls of plates of two fits.

    Each is a fit, its `to_map()`, or the path of a map file, of a machine file (an expected map,
    with the expanded uncertainty `stated` of lengths, such as "0.5 um + L/1000000"), or of an
    experiment file that names its readings. There are `grid` points along each axis. With `shared`
    both fits rest on the same certificate, whose errors cancel. `dates` are days of the campaigns,
    such as "2026-11-22".

    :raises ValueError: the maps do not go together, or share no certificate.

    >>> import ballplate as bp
    >>> campaigns = [bp.fit(bp.quickstart(), bp.simulate(bp.quickstart(), seed)) for seed in (1, 2)]
    >>> bp.diff(*campaigns)
    <MapDifference of second less first: no change is shown (p = 0.53)>
    """
    from ballplate.simulator.inputs import Target, parse_length_function, stated_day

    from .sources import map_difference

    ensure_whole(2, 5, grid=grid)
    ensure_positive("a number above 0, such as 2", 100.0, coverage_factor=coverage_factor)
    ensure_one_of(("certificate",), shared=shared)
    ensure_type(str, "the name of a probe", probe=probe)
    ensure_type(str, 'a length such as "0.5 um + L/1000000"', stated=stated)
    if isinstance(dates, str) or len(dates) != 2:
        raise ValueError(f"dates={dates!r}; give two, that of the first and that of the second")
    days = tuple(None if day is None else stated_day(day) for day in dates)
    target = None if stated is None else Target(parse_length_function(stated), coverage_factor)
    sides = [fit_map_or_path(name, side) for name, side in (("first", first), ("second", second))]
    return map_difference(
        (sides[0], sides[1]),
        coverage_factor=coverage_factor,
        grid=grid,
        probe=probe,
        shared=shared is not None,
        stated=None if target is None else target.standard,
        dates=(days[0], days[1]),
    )


def map(
    machine: PathLike | Fit | FittedMap,
    grid: Sequence[int] | None = None,
    line: str | Line | None = None,
    points: int | PathLike | pandas.DataFrame | Sequence[Sequence[float]] | None = None,
    *,
    plane: str | Mapping[str, float] | None = None,
    probe: str | None = None,
    draw: int | None = None,
    seed: int = 1,
    budget: bool = False,
) -> ErrorMap:
    """Return volumetric errors of a machine file, with standard deviations of its random part, or
    of a map, with expanded uncertainties: on a grid over the volume, in a plane, along a line, or
    at points.

    `line` is a text as in `ballplate map --line`, co-ordinates in metres of the two fixed axes, or
    two points; `plane` the co-ordinate of the axis across it. `points` is their number along a
    line, a table as for the command, or co-ordinates (m, d) in metres. For a map, `probe` names the
    probe. `draw` is the number of realisations of the random part, or of the covariance of a
    map, from a `seed`. `budget` adds the contributions of parametric errors of a machine file.

    >>> import ballplate as bp
    >>> bp.map("designs/park/machines/npl-like.yaml", line="y = 300 mm, z = 200 mm", points=3)
    <ErrorMap of npl-like: 3 points, resultant 16.17 µm at most>
    >>> fitted = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart())).to_map()
    >>> bp.map(fitted, points=[[0.5, 0.5, 0.5]]).errors.uncertainties.round(8)
    array([[2.2e-07, 1.9e-07, 1.7e-07]])
    """
    import numpy as np

    from .error_map import map_errors
    from .map_places import PlacesAsked, parse_places, parse_plane
    from .realisations import MOST_DRAWS, Draws
    from .volumetric_errors import MOST_POINTS

    source = map_or_path("machine", machine)
    ensure_type(str, "the name of a probe", probe=probe)
    ensure_type(bool, "True or False", budget=budget)
    ensure_whole(1, MOST_DRAWS, draw=draw)
    ensure_whole(0, seed=seed)
    counts = None
    if grid is not None:
        counts = _several("grid", grid)
        if len(counts) not in (2, 3):
            raise ValueError(f"grid={grid!r}; give three numbers of points, such as (5, 5, 5)")
        ensure_whole(2, MOST_POINTS, **{f"grid[{k}]": count for k, count in enumerate(counts)})
        if (count := math.prod(counts)) > MOST_POINTS:
            raise ValueError(f"{count} points are too many; at most {MOST_POINTS} are possible")
    number: int | None = None
    places: Path | GivenText | Array | None = None
    if isinstance(points, int) or points is None:
        ensure_whole(2, MOST_POINTS, points=points)
        number = points
    elif isinstance(points, str | os.PathLike) or hasattr(points, "to_csv"):
        places = table_of("points", points)
    else:
        places = co_ordinates = np.asarray(points, float)
        if co_ordinates.ndim != 2 or not np.isfinite(co_ordinates).all():
            raise ValueError(
                f"points of shape {co_ordinates.shape}; give finite numbers in metres (m, d)"
            )
    asked = PlacesAsked(
        counts,
        parse_places(line) if isinstance(line, str) else line,
        parse_plane(plane) if isinstance(plane, str) else plane,
        number,
        places,
    )
    draws = None if draw is None else Draws(draw, seed)
    return map_errors(source, asked, probe, draws, budget)


def curves(
    fitted: Fit | FittedMap | PathLike, errors: str | Iterable[str] = (), points: int = 41
) -> ErrorCurves:
    """Return the error functions of a map, or some of them, at a number of positions along each
    line, with expanded uncertainties; squareness errors as angles; other numbers of the model.

    `fitted` is a fit, its `to_map()`, or the path of a map file, or of a machine file, whose errors
    have standard deviations of their random part.

    >>> import ballplate as bp
    >>> bp.curves(bp.fit(bp.quickstart(), bp.simulate(bp.quickstart())).to_map())
    <ErrorCurves of map: 18 error functions, 3 squareness errors>
    """
    from ..machine_files import is_map_file
    from .error_curves_result import error_curves, machine_curves
    from .error_sources import map_of_source

    ensure_whole(2, 10_000, points=points)
    names = (errors,) if isinstance(errors, str) else tuple(errors)
    for name in names:
        ensure_type(str, "the name of a parametric error, such as EXX", errors=name)
    source = map_or_path("fitted", fitted)
    if isinstance(source, Path) and not is_map_file(source):
        return machine_curves(source, names, points)
    return error_curves(*map_of_source(source), names, points)


def correct(
    fitted: Fit | FittedMap | PathLike,
    points: Any,
    probe: str | Sequence[str] | None = None,
    lengths: Sequence[Sequence[str | int]] = (),
    coordinates: Literal["scale readings", "ball centres"] = "scale readings",
    coverage_factor: float | None = None,
    with_repeatability: bool = False,
) -> Correction:
    """Return points corrected by a fit, its map, or the file of a map, with their uncertainty.

    `points` are an array (n, d) in metres, or a table as for `ballplate correct`, with a default
    `probe`, itself by default that of the map. `coordinates` are those of the scales, or of centres
    of balls, which include the stated offset of the probe. `lengths` are pairs of names or of
    indices. The coverage factor is by default that of the map; `with_repeatability` includes the
    repeatability of the corrected readings.

    >>> import ballplate as bp
    >>> fitted = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))
    >>> ends = [[0.1, 0.2, 0.3], [0.4, 0.2, 0.3]]
    >>> bp.correct(fitted, ends)
    <Correction of quickstart: 2 points; U = 2 u = 0.4325 µm at most>
    >>> found = bp.correct(fitted, ends, lengths=[(0, 1)])
    >>> found.points.shape, found.blocks.shape, found.covariance().shape
    ((2, 3), (2, 3, 3), (6, 6))
    >>> f"{1e6 * found.lengths[0].standard_uncertainty:.3f} µm"
    '0.080 µm'
    """
    import pandas
    from ballplate.results import ensure_points, probe_places

    from .correction import correction
    from .point_files import GivenPoints, read_points
    from .selected_lengths import between_named

    ensure_one_of(("scale readings", "ball centres"), coordinates=coordinates)
    ensure_positive("a number above 0 and at most 100", 100.0, coverage_factor=coverage_factor)
    ensure_type(bool, "True or False", with_repeatability=with_repeatability)
    chosen = fitted_map_of("fitted", fitted)
    names = chosen.probes.names
    offsets = chosen.drawn_offsets if coordinates == "ball centres" else None
    if isinstance(points, str | os.PathLike | pandas.DataFrame):
        name = chosen.probe if probe is None else probe
        if name not in names:
            raise ValueError(f"no probe {name!r}; {hint(str(name), names)}")
        table = table_of("points", points)
        points_read = read_points(table, names, str(name), chosen.volume, offsets)
    else:
        x = ensure_points(points, chosen.volume)
        asked = chosen.probe if probe is None else probe
        probes = probe_places(asked, names, len(x))
        x = x if offsets is None else x - offsets[probes]
        points_read = GivenPoints(x, ("",) * len(x), probes)
    wanted = between_named(points_read, lengths)
    return correction(chosen, points_read, wanted, coverage_factor, with_repeatability)


def _several(name: str, value: Any) -> tuple[int, ...]:
    if isinstance(value, Iterable) and type(value) is not str:
        return tuple(value)
    ensure_whole(2, None, **{name: value})
    return (value,)
