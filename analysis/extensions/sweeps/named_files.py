"""Files that a sweep names."""

from __future__ import annotations

import os
import re
from pathlib import Path

from ballplate.simulator.experiment import (
    existing_file,
    files_of_machine,
    keyed_paths,
    model_modules,
    module_files,
)
from ballplate.simulator.inputs import ExperimentError, Scalar

from .model import Sweep

# Where an experiment names tables of readings.
_READINGS = re.compile(r"(?:^|\.)readings\.files$")

MEND = "move it there, or allow its folder with --folder"


def named_files(sweep: Sweep) -> list[Path]:
    """Return the absolute paths of all existing files that the experiments of a sweep name.

    A file named from the root of the file system is not included: it must exist on every machine
    that computes.

    :raises ExperimentError: a file that, links resolved, is not below the folder of the sweep file,
        of its base, or one of the sweep's further folders.
    """
    base = Path(os.path.abspath(sweep.base))
    allowed = [
        folder.resolve() for folder in (sweep.source.parent, sweep.base.parent, *sweep.folders)
    ]

    def is_allowed(path: Path) -> bool:
        return any(path.resolve().is_relative_to(folder) for folder in allowed)

    nodes = [("", root) for root in sweep.trees.values()]
    for axis in sweep.axes:
        nodes += [(path, node) for choice in axis.choices for path, node, _ in choice.changes]
    naming: dict[Path, Scalar] = {}
    for start, node in nodes:
        for key, scalar in keyed_paths(node, start):
            # Cells fit no readings.
            if _READINGS.search(key):
                continue
            for path in existing_file(base.parent, str(scalar.value)):
                naming.setdefault(path, scalar)
                # A machine file names tables beside it.
                for table in files_of_machine(path) if is_allowed(path) else ():
                    naming.setdefault(table, scalar)
    for folder, scalar in model_modules(nodes, base.parent):
        for path in module_files(folder, str(scalar.value).partition(":")[0]):
            naming.setdefault(path, scalar)
    messages = [
        scalar.mark.message(
            "", f"names {path}, outside the folders of the sweep and its base; {MEND}"
        )
        for path, scalar in sorted(naming.items(), key=lambda item: item[0])
        if not is_allowed(path)
    ]
    if messages:
        raise ExperimentError(messages)
    return sorted(naming)
