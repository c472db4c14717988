"""Modules that an experiment runs: an error model, or a calibration, in Python is code that loading
the file runs.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..inputs.messages import ExperimentError, Message, Steps, format_path
from ..inputs.yamltree import Mapping, Node, Scalar, walk


def python_models(root: Node) -> Iterator[tuple[Steps, Mapping]]:
    """Settings of error models and calibrations in Python in a tree, each with its path."""
    for steps, node in walk(root):
        if isinstance(node, Mapping):
            kind = node.items.get("kind")
            if isinstance(kind, Scalar) and kind.value == "python":
                yield steps, node


def refused_modules(root: Node, folder: Path) -> list[Message]:
    """A message for each error model or calibration in Python, also of a map, for files that nobody
    has looked at; names of maps begin in `folder`.
    """
    text = (
        "is code that loading the file would run, and modules are not allowed here; allow them if"
        " you trust the file"
    )
    of_maps = [
        node.mark.message(
            format_path(steps), f"is the map of an error model in Python, which {text}"
        )
        for steps, node in _named_maps(root)
        if _has_model_in_python(folder / str(node.value))
    ]
    return of_maps + [
        model.items["kind"].mark.message(
            format_path((*steps, "kind")),
            f"{'a calibration' if 'calibration' in steps else 'an error model'} in Python {text}",
        )
        for steps, model in python_models(root)
    ]


def _named_maps(root: Node) -> Iterator[tuple[Steps, Scalar]]:
    """Names of files with maps in a tree, each with its path."""
    for steps, node in walk(root):
        if isinstance(node, Mapping):
            kind, file = node.items.get("kind"), node.items.get("file")
            if isinstance(kind, Scalar) and kind.value == "map" and isinstance(file, Scalar):
                yield (*steps, "file"), file


def _has_model_in_python(path: Path) -> bool:
    # Loaded where a map is named: few experiments have any.
    from .map_files import map_tree

    try:
        return any(python_models(map_tree(path, [])[0]))
    except ExperimentError:
        # Told when it is loaded.
        return False
