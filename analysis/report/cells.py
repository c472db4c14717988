"""Experiments of cells, made anew from the files in a store."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.yamltree import read_tree

from ..sweeps.bundle import Bundle, has_code, unpack
from ..sweeps.load import experiment_of, load_sweep
from ..sweeps.named_files import MODULE, YAML, axis_paths, leads_out, path_scalars
from ..sweeps.store import Store, StoreError, files
from .results import ReportedSweep


class NoExperimentError(Exception):
    """A cell's experiment cannot be had; the text says why."""


def experiments(
    store: Store, results: ReportedSweep, cells: Sequence[int], run_modules: bool = False
) -> list[Experiment]:
    """Experiments of cells.

    Error models of a user's own are Python code, which a store from elsewhere must not run unasked:
    only with `run_modules` are they loaded.

    Files outside the store are not read, whatever the experiment names.

    :raises NoExperimentError: the files are not there, have changed their meaning, name others, or
        would run code.
    """
    try:
        kept = files(store, results.number)
    except StoreError as error:
        raise NoExperimentError(str(error).removeprefix(f"{store.path}: ")) from None
    bundle = Bundle(results.definition["source"], results.definition["base"], kept)
    names = [name for name, _ in bundle.files]
    if bundle.source not in names or bundle.base not in names:
        raise NoExperimentError("the store does not hold the sweep's files")
    with tempfile.TemporaryDirectory(prefix="ballplate-") as folder:
        try:
            source = unpack(bundle, Path(folder))
        except ValueError as error:
            raise NoExperimentError(f"the store cannot be trusted: {error}") from None
        except OSError as error:
            raise NoExperimentError(
                f"the store's files cannot be unpacked ({error.strerror})"
            ) from None
        try:
            if _leads_out(bundle, Path(folder)):
                raise NoExperimentError("the experiment names files that are not in the store")
            if not run_modules and _has_code(bundle, Path(folder)):
                text = (
                    "the experiment has an error model in Python, which is run only with"
                    " --run-modules"
                )
                raise NoExperimentError(text)
            # The stored file, whichever the sweep file names.
            sweep = load_sweep(source, Path(folder) / PurePosixPath(bundle.base), (Path(folder),))
            if len(sweep.cells) != len(results.cells):
                raise NoExperimentError("the stored files make other cells than those stored")
            return [experiment_of(sweep, cell) for cell in cells]
        except ExperimentError as error:
            raise NoExperimentError(error.messages[0].text) from None


def _leads_out(bundle: Bundle, folder: Path) -> bool:
    """Whether a file of the store names one that is not in it."""
    base = folder / PurePosixPath(bundle.base)
    axes = axis_paths(read_tree(folder / PurePosixPath(bundle.source)))
    if leads_out(axes, base.parent, folder):
        return True
    paths = [
        base,
        *(folder / PurePosixPath(name) for name, _ in bundle.files if name.lower().endswith(YAML)),
    ]
    source = folder / PurePosixPath(bundle.source)
    return any(
        leads_out(path_scalars(read_tree(path), ""), path.parent, folder)
        for path in paths
        if path != source
    )


def _has_code(bundle: Bundle, folder: Path) -> bool:
    """Whether anything that is loaded may run a module, from the store or elsewhere."""
    if any(name.endswith(MODULE) for name, _ in bundle.files):
        return True
    roots = [read_tree(folder / PurePosixPath(name)) for name in (bundle.source, bundle.base)]
    return any(map(has_code, roots))
