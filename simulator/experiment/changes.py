"""Experiments written or changed in Python, where a file would hold text."""

from __future__ import annotations

from collections.abc import Mapping as AnyMapping
from collections.abc import Sequence as AnySequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .messages import ExperimentError, Message
from .variants import override, removed
from .yamltree import Mapping, Mark, Node, Scalar, Sequence

if TYPE_CHECKING:
    from .model import Experiment


def changed(experiment: Experiment, changes: AnyMapping[str, Any]) -> Experiment:
    """The experiment with new values at some paths of what was written; None removes what stands there.

    :raises ExperimentError: a path that does not exist, a value that no file could hold, or an experiment that is
        wrong so.
    """
    from .load import build

    mark = Mark(f"{experiment.source} as changed", 0, 0)
    tree, messages = experiment.tree, []
    for path, value in changes.items():
        try:
            tree = removed(tree, path) if value is None else override(tree, path, node_of(value, mark), mark)
        except ValueError as error:
            messages.append(mark.message(path, str(error)))
    if messages:
        raise ExperimentError(messages)
    found, messages = build(tree, experiment.source, experiment.name, experiment.pool is not None)
    if found is None:
        raise ExperimentError(sorted(messages))
    return found


def written_in_python(sections: AnyMapping[str, Any], folder: Path, planning: bool = False) -> Experiment:
    """The experiment of a mapping that holds what a file would, with paths relative to a folder.

    :raises ExperimentError: it is wrong; holds everything that was found.
    """
    from .load import build

    source = folder / "experiment.yaml"
    mark = Mark("experiment", 0, 0)
    try:
        tree = node_of(sections, mark)
    except ValueError as error:
        raise ExperimentError([mark.message("", str(error))]) from None
    if "variants" in sections:
        text = "are for files; make one experiment of each with with_()"
        raise ExperimentError([Message(mark.file, 0, 0, "variants", text)])
    found, messages = build(tree, source, None, planning)
    if found is None:
        raise ExperimentError(sorted(messages))
    return found


def node_of(value: object, mark: Mark) -> Node:
    """What a file would hold: text, numbers, lists and mappings, arrays and paths among them.

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
    raise ValueError(f"a {type(value).__name__} cannot be written; give text, a number, a list or a mapping")
