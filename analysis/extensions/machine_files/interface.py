"""Maps of fits from Python."""

from __future__ import annotations

import os
from pathlib import Path

from ballplate.arguments import PathLike
from ballplate.results import Fit
from ballplate.simulator.inputs import ensure_path, ensure_type

from .fitted_map import FittedMap
from .map_files import read_map, write_map as write


def load_map(path: PathLike) -> FittedMap:
    """The map of a file that a fit left behind.

    >>> import ballplate as bp
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = f"{folder}/map.yaml"
    ...     bp.write_map(bp.fit(bp.quickstart(), bp.simulate(bp.quickstart())).to_map(), path)
    ...     bp.load_map(path)
    <FittedMap 5 x 5 ball plate in six positions: 69 parameters>
    """
    ensure_path("path", path)
    return read_map(path)


def write_map(fitted: FittedMap, path: PathLike) -> None:
    """Write what `to_map()` of a fit gives into a file in YAML. Numbers keep all their digits; a
    file of that name is overwritten.

    >>> import ballplate as bp
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = f"{folder}/map.yaml"
    ...     bp.write_map(bp.fit(bp.quickstart(), bp.simulate(bp.quickstart())).to_map(), path)
    ...     bp.load_map(path).degrees_of_freedom
    580
    """
    ensure_type(FittedMap, "what to_map() of a fit gives", fitted=fitted)
    ensure_path("path", path)
    write(fitted, path)


def fit_map_or_path(name: str, fitted: Fit | FittedMap | PathLike) -> Fit | FittedMap | Path:
    """A map to be compared: the path of a file as such."""
    if isinstance(fitted, str | os.PathLike):
        return Path(fitted)
    if not isinstance(fitted, Fit | FittedMap):
        raise TypeError(f"{name}={fitted!r}; give a fit, what its to_map() gives, or a path")
    return fitted


def map_or_path(name: str, fitted: Fit | FittedMap | PathLike) -> FittedMap | Path:
    """Return the map of a fit, or a given map or path unchanged."""
    side = fit_map_or_path(name, fitted)
    return side.to_map() if isinstance(side, Fit) else side


def fitted_map_of(name: str, fitted: Fit | FittedMap | PathLike) -> FittedMap:
    """Return the map of a fit, of its to_map(), or of a file."""
    loaded_map = map_or_path(name, fitted)
    return read_map(loaded_map) if isinstance(loaded_map, Path) else loaded_map
