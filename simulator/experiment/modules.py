"""Modules that an experiment runs: an error model, or a calibration, in Python is code that loading
the file runs.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..inputs.messages import Message, Steps, format_path
from ..inputs.yamltree import Mapping, Node, Scalar, walk


def python_models(root: Node) -> Iterator[tuple[Steps, Mapping]]:
    """Settings of error models and calibrations in Python in a tree, each with its path."""
    for steps, node in walk(root):
        if isinstance(node, Mapping):
            kind = node.items.get("kind")
            if isinstance(kind, Scalar) and kind.value == "python":
                yield steps, node


def refused_modules(root: Node) -> list[Message]:
    """A message for each error model or calibration in Python, for files that nobody has looked
    at.
    """
    text = (
        "is code that loading the file would run, and modules are not allowed here; allow them if"
        " you trust the file"
    )
    return [
        model.items["kind"].mark.message(
            format_path((*steps, "kind")),
            f"{'a calibration' if 'calibration' in steps else 'an error model'} in Python {text}",
        )
        for steps, model in python_models(root)
    ]
