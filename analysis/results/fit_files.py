"""The fit of an experiment file that names its readings."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from ballplate.results.fits import Fit
from ballplate.results.study import fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.map_files import BINARY
from ballplate.simulator.inputs.messages import refused
from ballplate.simulator.inputs.yamltree import Mapping, read_tree
from ballplate.simulator.readings.reading_files import read_readings


def kind_of_file(path: Path) -> Literal["map", "machine", "experiment"]:
    """What a file is, a map where that cannot be told.

    :raises ExperimentError: it cannot be read.
    """
    if path.suffix.lower() == BINARY:
        return "map"
    root = read_tree(path)
    keys = root.items if isinstance(root, Mapping) else {}
    if "map" in keys:
        return "map"
    if "positions" in keys or "machine" in keys or "pool" in keys:
        return "experiment"
    return "machine" if "arrangement" in keys else "map"


def fit_of_file(path: Path) -> Fit:
    """The fit of an experiment to the readings that it names.

    :raises ExperimentError: the file is wrong, has variants or names no readings, or the estimate
        did not converge.
    """
    variants = load(path)
    if len(variants) > 1:
        raise refused(path, "the file has several variants; name their map files", "variants")
    experiment = variants[0]
    named = experiment.readings.named_files
    if not named:
        text = (
            "names no readings, so that there is no fit; add readings: {files: […]}, or"
            " name a map that fit -o wrote"
        )
        raise refused(path, text, "readings")
    files = [experiment.source.parent / name for name in named]
    observed = read_readings(files, lay_out(experiment), settings=experiment.readings)
    found = fit(experiment, observed)
    if not found.converged:
        raise experiment.refused((), found.complaint)
    return found
