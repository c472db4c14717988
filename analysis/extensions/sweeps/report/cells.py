"""Experiments of cells, rebuilt from the files in a store."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ExperimentError, Trust

from ..bundle import Bundle, unpack
from ..load import experiment_of, load_sweep
from ..store import Store, StoreError, files
from .results import ReportedSweep


class NoExperimentError(Exception):
    """A cell's experiment cannot be rebuilt; the text states the reason."""


def experiments(
    store: Store, results: ReportedSweep, cells: Sequence[int], run_modules: bool = False
) -> list[Experiment]:
    """Return experiments of cells.

    A store is not trusted: code in Python runs only with `run_modules`, and no file outside the
    store is read.

    :raises NoExperimentError: files are missing, make other cells, name further files, or would run
        code.
    """
    try:
        stored_files = files(store, results.number)
    except StoreError as error:
        raise NoExperimentError(str(error).removeprefix(f"{store.path}: ")) from None
    bundle = Bundle(results.definition["source"], results.definition["base"], stored_files)
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
            # The stored experiment, even if the sweep file names another.
            base = Path(folder) / PurePosixPath(bundle.base)
            trust = Trust(run_modules, Path(folder), "add --run-modules if you trust the store")
            sweep = load_sweep(source, base, (Path(folder),), trust)
            if len(sweep.cells) != len(results.cells):
                raise NoExperimentError("the stored files make other cases than those stored")
            return [experiment_of(sweep, cell) for cell in cells]
        except ExperimentError as error:
            first = error.messages[0]
            text = ": ".join(part for part in (first.path, first.text) if part)
            raise NoExperimentError(text.replace(f"{folder}{os.sep}", "")) from None
