"""A map that a command names, of a map file or of readings that are fitted."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import complain

if TYPE_CHECKING:
    from ..machine_files import FittedMap

# What is taken.
FITTED = "map file, as fit -o writes it, or experiment file that names its readings"


def fitted_map(path: Path) -> FittedMap:
    """Return the map of a map file, or of a fit of an experiment file that names its readings;
    print the notes of the fit.

    :raises ExperimentError: the file is wrong, or the estimate did not converge.
    """
    from ..machine_files import read_map
    from .fit_files import fit_of_file, kind_of_file

    if kind_of_file(path) != "experiment":
        return read_map(path)
    fitted = fit_of_file(path)
    for remark in fitted.notes:
        complain(remark)
    return fitted.to_map()
