"""Files that a sweep names: values of the keys that hold paths, and the modules of error models in
Python.

Text elsewhere is never taken for a path: a title that spells the name of a private key is a title.
"""

from __future__ import annotations

import ast
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path, PureWindowsPath

from ballplate.simulator.experiment.modules import python_models
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.yamltree import Mapping, Node, Scalar, read_tree
from ballplate.simulator.inputs.yamltree import Sequence as Entries

from .model import Sweep

MODULE = ".py"
YAML = (".yaml", ".yml")

# Keys of experiment and machine files whose text is a path, as their schemas say.
PATH_KEYS = ("file", "files", "values", "covariance")

# Where an experiment names tables of readings.
_READINGS = re.compile(r"(?:^|\.)readings\.files$")

MEND = "move it there, or allow its folder with --folder"


def named_files(sweep: Sweep) -> list[Path]:
    """Absolute paths of all files that the experiments of a sweep name and that are there.

    A file that is named by its place from the root of the file system is left out: it must be there
    wherever the sweep is computed.

    :raises ExperimentError: a file that is not, links resolved, below the folder of the sweep file,
        of its base, or of one of the sweep's further folders.
    """
    base = Path(os.path.abspath(sweep.base))
    allowed = [
        folder.resolve() for folder in (sweep.source.parent, sweep.base.parent, *sweep.folders)
    ]

    def is_allowed(path: Path) -> bool:
        return any(path.resolve().is_relative_to(folder) for folder in allowed)

    nodes: list[tuple[str, Node]] = [("", root) for root in sweep.trees.values()]
    for axis in sweep.axes:
        nodes += [(path, node) for choice in axis.choices for path, node, _ in choice.changes]
    found: dict[Path, Scalar] = {}
    for start, node in nodes:
        for key, scalar in _keyed_paths(node, start):
            # Cells fit no readings.
            if _READINGS.search(key):
                continue
            for path in _there(base.parent, str(scalar.value)):
                found.setdefault(path, scalar)
                # A machine file names tables beside it.
                for one in _of_machine_file(path) if is_allowed(path) else ():
                    found.setdefault(one, scalar)
    for folder, scalar in _modules(nodes, base.parent):
        for path in _imported(folder, str(scalar.value).partition(":")[0]):
            found.setdefault(path, scalar)
    messages = [
        scalar.mark.message(
            "", f"names {path}, outside the folders of the sweep and its base; {MEND}"
        )
        for path, scalar in sorted(found.items(), key=lambda item: item[0])
        if not is_allowed(path)
    ]
    if messages:
        raise ExperimentError(messages)
    return sorted(found)


def named_by(source: Path) -> list[Path]:
    """Files that an experiment or machine file names, those that they name, and its modules, as far
    as they are there.

    Empty where the file cannot be read: loading it tells why.
    """
    try:
        root = read_tree(source)
    except ExperimentError:
        return []
    return named_in([("", root)], source.parent)


def named_in(nodes: Sequence[tuple[str, Node]], folder: Path) -> list[Path]:
    """Files that nodes at paths of an experiment name, as seen from a folder, those that they name,
    and modules, as far as they are there.
    """
    found: set[Path] = set()
    for key, node in nodes:
        for scalar in path_scalars(node, key):
            text = str(scalar.value)
            named = [Path(text)] if Path(text).is_absolute() else _there(folder, text)
            for path in named:
                found |= {path, *_of_machine_file(path)}
    for place, scalar in _modules(nodes, folder):
        found |= _imported(place, str(scalar.value).partition(":")[0])
    return sorted(found)


def _last(path: str) -> str:
    """The last key of a path such as those of variants and axes."""
    return path.rpartition(".")[2].partition("[")[0]


def path_scalars(node: Node, key: str) -> Iterator[Scalar]:
    """Texts below a node that are paths by the last key above them."""
    return (scalar for _, scalar in _keyed_paths(node, key))


def _keyed_paths(node: Node, key: str) -> Iterator[tuple[str, Scalar]]:
    """The same with all keys above them, joined by points."""
    if isinstance(node, Mapping):
        for inner, item in node.items.items():
            yield from _keyed_paths(item, f"{key}.{inner}")
    elif isinstance(node, Entries):
        for item in node.items:
            yield from _keyed_paths(item, key)
    elif isinstance(node, Scalar) and isinstance(node.value, str) and _last(key) in PATH_KEYS:
        yield key, node


def is_rooted(text: str) -> bool:
    """Whether a path begins at the root of a file system or of a drive, or at a home."""
    windows = PureWindowsPath(text)
    return text.startswith("~") or Path(text).is_absolute() or bool(windows.anchor or windows.drive)


def _there(folder: Path, text: str) -> Iterator[Path]:
    """The file that a text means, if it is one and not named from the root of a file system or of a
    drive.
    """
    if not 0 < len(text) <= 4096 or "\0" in text or "\n" in text or is_rooted(text):
        return
    path = Path(os.path.abspath(folder / text))
    try:
        if path.is_file():
            yield path
    except OSError:
        return


def _of_machine_file(path: Path) -> Iterator[Path]:
    if path.suffix.lower() not in YAML:
        return
    try:
        root = read_tree(path)
    except ExperimentError:
        # Who uses the file is told about it when it is loaded.
        return
    for scalar in path_scalars(root, ""):
        yield from _there(path.parent, str(scalar.value))


def _modules(nodes: Sequence[tuple[str, Node]], folder: Path) -> Iterator[tuple[Path, Scalar]]:
    """Objects of error models in Python, each with the folder of its module."""
    for path, node in nodes:
        for _, mapping in python_models(node):
            name, own = mapping.items.get("object"), mapping.items.get("folder")
            if isinstance(name, Scalar):
                inner = str(own.value) if isinstance(own, Scalar) and own.value is not None else "."
                yield Path(os.path.abspath(folder / inner)), name
        if isinstance(node, Scalar) and _last(path) == "object":
            yield folder, node


def _imported(folder: Path, module: str) -> set[Path]:
    """Files in a folder that make up a module, and those that it imports from there, by what their
    text says.
    """
    found: set[Path] = set()
    waiting = [module]
    while waiting:
        top = waiting.pop().partition(".")[0]
        if not top.isidentifier():
            continue
        files = [folder / f"{top}{MODULE}"]
        if (folder / top).is_dir():
            files += sorted((folder / top).rglob(f"*{MODULE}"))
        for path in files:
            if path not in found and path.is_file():
                found.add(path)
                waiting += _imports(path)
    return found


def _imports(path: Path) -> Iterator[str]:
    """Names of the modules that a file of Python imports; what is wrong with the file is told when
    it is loaded.
    """
    try:
        tree = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError, RecursionError):
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            yield node.module
