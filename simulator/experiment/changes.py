"""Experiments that are written or changed in Python."""

from __future__ import annotations

from collections.abc import Mapping as AnyMapping, Sequence as AnySequence
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.yamltree import Mapping, Mark, Node, Scalar, Sequence

from .variants import override, removed, steps_of


def changed_tree(tree: Node, file: str, changes: AnyMapping[str, Any]) -> Node:
    """Return the tree of a file with new values at some paths; ``None`` removes an entry.

    :raises ExperimentError: a path that does not exist, or a value that no file can hold.
    """
    mark = Mark(f"{file} as changed", 0, 0)
    messages = []
    written: dict[tuple[str, ...], str] = {}
    for path, value in changes.items():
        try:
            earlier = written.setdefault(tuple(steps_of(path)), path)
            if earlier != path:
                raise ValueError(f'is the same entry as "{earlier}"; replace it once')
            tree = (
                removed(tree, path)
                if value is None
                else override(tree, path, node_of(value, mark), mark)
            )
        except ValueError as error:
            messages.append(mark.message(path, str(error)))
    if messages:
        raise ExperimentError(messages)
    return tree


def node_of(value: object, mark: Mark) -> Node:
    """Return the node of a text, number, list, mapping, array or path.

    :raises ValueError: a value of another type.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Path):
        value = str(value)
    if value is None or isinstance(value, str | bool | int | float):
        return Scalar(mark, value)
    if isinstance(value, AnyMapping):
        items = {str(key): node_of(item, mark) for key, item in value.items()}
        return Mapping(mark, items, dict.fromkeys(items, mark))
    if isinstance(value, AnySequence) and not isinstance(value, bytes):
        return Sequence(mark, tuple(node_of(item, mark) for item in value))
    raise ValueError(
        f"a {type(value).__name__} cannot be written; give text, a number, a list or a mapping"
    )
