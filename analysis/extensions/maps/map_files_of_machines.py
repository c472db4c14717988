"""Errors of a machine, whether a file describes it or a fit has left a map of it behind."""

from __future__ import annotations

from pathlib import Path

from ballplate.simulator.experiment import is_map_file, read_map
from ballplate.simulator.maps import FittedMap

from .fitted_errors_result import FittedErrorMap, fitted_map_errors
from .map_places import PlacesAsked
from .realisations import Draws
from .volumetric_results import MachineErrors, machine_errors


def map_of_source(source: Path | FittedMap) -> tuple[FittedMap, str]:
    """Return a map, read from its file if needed, with its label.

    :raises ExperimentError: the file is wrong.
    """
    return (read_map(source), source.stem) if isinstance(source, Path) else (source, "map")


def map_errors(
    source: Path | FittedMap,
    asked: PlacesAsked,
    probe: str | None = None,
    draws: Draws | None = None,
    with_budget: bool = False,
) -> MachineErrors | FittedErrorMap:
    """Return errors of a machine file, with their budget if requested, or of a map at places.

    :raises ExperimentError: the file is wrong.
    :raises ValueError: what does not go together, or is not in the machine.
    """
    if isinstance(source, Path) and not is_map_file(source):
        if probe is not None:
            raise ValueError("a machine file states its own probe; leave the probe out")
        return machine_errors(source, asked, draws, with_budget)
    if with_budget:
        raise ValueError("a budget is made of a machine file alone; leave it out")
    fitted, label = map_of_source(source)
    return fitted_map_errors(fitted, label, asked, probe, draws)
