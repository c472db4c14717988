"""The fit of an experiment file that names its readings."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from ballplate.results import Fit, fit
from ballplate.simulator.experiment import lay_out, load
from ballplate.simulator.inputs import Mapping, read_tree, refused
from ballplate.simulator.readings import read_readings

from ..machine_files import is_map_file


def kind_of_file(path: Path) -> Literal["map", "machine", "experiment"]:
    """Return the type of a file; a map if ambiguous.

    :raises ExperimentError: it cannot be read.
    """
    if is_map_file(path):
        return "map"
    root = read_tree(path)
    keys = root.items if isinstance(root, Mapping) else {}
    if "positions" in keys or "machine" in keys or "pool" in keys:
        return "experiment"
    return "machine" if "arrangement" in keys else "map"


def fit_of_file(path: Path, readings: Path | None = None) -> Fit:
    """Return the fit of an experiment to a table of readings; default: the readings that the file
    names.

    :raises ExperimentError: the file is wrong, has variants or names no readings, or the estimate
        did not converge.
    """
    variants = load(path)
    if len(variants) > 1:
        raise refused(path, "the file has several variants; name their map files", "variants")
    experiment = variants[0]
    named = experiment.readings.named_files
    if not named and readings is None:
        text = (
            "names no readings, so that there is no fit; add readings: {files: […]}, or"
            " name a map that fit -o wrote"
        )
        raise refused(path, text, "readings")
    files = [experiment.source.parent / name for name in named] if readings is None else [readings]
    observed = read_readings(files, lay_out(experiment), settings=experiment.readings)
    fitted = fit(experiment, observed)
    if not fitted.converged:
        raise experiment.refused((), fitted.complaint)
    return fitted
