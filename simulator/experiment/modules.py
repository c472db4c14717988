"""Modules that an experiment runs: an error model, or a calibration, in Python is code that loading
the file runs.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ballplate.simulator.inputs.messages import ExperimentError, Steps
from ballplate.simulator.inputs.yamltree import Mapping, Node, Scalar, read_tree, walk


def python_models(root: Node) -> Iterator[tuple[Steps, Mapping]]:
    """Return error models and calibrations in Python in a tree, each with its path."""
    for steps, node in walk(root):
        if isinstance(node, Mapping):
            kind = node.items.get("kind")
            if isinstance(kind, Scalar) and kind.value == "python":
                yield steps, node


def runs_code(root: Node, folder: Path) -> bool:
    """Return True if a tree, or a map that it names, contains code in Python.

    Names of maps are relative to `folder`.
    """
    return any(python_models(root)) or any(
        _has_model_in_python(folder / str(file.value)) for file in _named_maps(root)
    )


def _named_maps(root: Node) -> Iterator[Scalar]:
    """Names of files with maps in a tree."""
    for _, node in walk(root):
        if isinstance(node, Mapping):
            kind, file = node.items.get("kind"), node.items.get("file")
            if isinstance(kind, Scalar) and kind.value == "map" and isinstance(file, Scalar):
                yield file


def _has_model_in_python(path: Path) -> bool:
    try:
        return any(python_models(read_tree(path, [])))
    except ExperimentError:
        # Told when it is loaded.
        return False
