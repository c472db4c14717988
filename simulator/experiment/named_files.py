"""Files that an experiment or a machine file names: values of the keys that hold paths, and the
modules of error models in Python.

Other text is never interpreted as a path: a title that spells the name of a private key is a
title.
"""

from __future__ import annotations

import ast
import os
from collections.abc import Iterator, Sequence
from pathlib import Path, PureWindowsPath

from ballplate.simulator.inputs.messages import ExperimentError, Steps
from ballplate.simulator.inputs.yamltree import (
    Mapping,
    Node,
    Scalar,
    Sequence as Entries,
    read_tree,
    walk,
)


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


MODULE = ".py"
YAML = (".yaml", ".yml")

# Keys of experiment, machine and part files whose text is a path, as their schemas say.
PATH_KEYS = ("file", "files", "values", "covariance", "points", "random_part")


def named_by(source: Path) -> list[Path]:
    """Return existing files that an experiment or machine file names, those that these name, and
    its modules.

    Empty if the file cannot be read: loading reports why.
    """
    try:
        root = read_tree(source)
    except ExperimentError:
        return []
    return named_in([("", root)], source.parent)


def named_in(nodes: Sequence[tuple[str, Node]], folder: Path) -> list[Path]:
    """Return existing files that nodes at paths of an experiment name, as seen from a folder,
    those that these name, and modules.
    """
    paths = set()
    for key, node in nodes:
        for scalar in path_scalars(node, key):
            text = str(scalar.value)
            named = [Path(text)] if Path(text).is_absolute() else existing_file(folder, text)
            for path in named:
                paths |= {path, *files_of_machine(path)}
    for place, scalar in model_modules(nodes, folder):
        paths |= module_files(place, str(scalar.value).partition(":")[0])
    return sorted(paths)


def _last(path: str) -> str:
    """The last key of a path such as those of variants and axes."""
    return path.rpartition(".")[2].partition("[")[0]


def path_scalars(node: Node, key: str) -> Iterator[Scalar]:
    """Texts below a node that are paths by the last key above them."""
    return (scalar for _, scalar in keyed_paths(node, key))


def keyed_paths(node: Node, key: str) -> Iterator[tuple[str, Scalar]]:
    """The same with all keys above them, joined by points."""
    if isinstance(node, Mapping):
        for inner, item in node.items.items():
            yield from keyed_paths(item, f"{key}.{inner}")
    elif isinstance(node, Entries):
        for item in node.items:
            yield from keyed_paths(item, key)
    elif isinstance(node, Scalar) and isinstance(node.value, str) and _last(key) in PATH_KEYS:
        yield key, node


def is_rooted(text: str) -> bool:
    """True if a path begins at the root of a file system or of a drive, or at a home."""
    windows = PureWindowsPath(text)
    return text.startswith("~") or Path(text).is_absolute() or bool(windows.anchor or windows.drive)


def existing_file(folder: Path, text: str) -> Iterator[Path]:
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


def files_of_machine(path: Path) -> Iterator[Path]:
    if path.suffix.lower() not in YAML:
        return
    try:
        root = read_tree(path)
    except ExperimentError:
        # Who uses the file is told about it when it is loaded.
        return
    for scalar in path_scalars(root, ""):
        yield from existing_file(path.parent, str(scalar.value))


def model_modules(nodes: Sequence[tuple[str, Node]], folder: Path) -> Iterator[tuple[Path, Scalar]]:
    """Objects of error models in Python, each with the folder of its module."""
    for path, node in nodes:
        for _, mapping in python_models(node):
            name, module_folder = mapping.items.get("object"), mapping.items.get("folder")
            if isinstance(name, Scalar):
                inner = (
                    str(module_folder.value)
                    if isinstance(module_folder, Scalar) and module_folder.value is not None
                    else "."
                )
                yield Path(os.path.abspath(folder / inner)), name
        if isinstance(node, Scalar) and _last(path) == "object":
            yield folder, node


def module_files(folder: Path, module: str) -> set[Path]:
    """Files in a folder that make up a module, and those that it imports from there, by what their
    text says.
    """
    paths = set()
    waiting = [module]
    while waiting:
        top = waiting.pop().partition(".")[0]
        if not top.isidentifier():
            continue
        files = [folder / f"{top}{MODULE}"]
        if (folder / top).is_dir():
            files += sorted((folder / top).rglob(f"*{MODULE}"))
        for path in files:
            if path not in paths and path.is_file():
                paths.add(path)
                waiting += _imports(path)
    return paths


def _imports(path: Path) -> Iterator[str]:
    """Return names of the modules that a file of Python imports; loading reports its faults."""
    try:
        tree = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError, RecursionError):
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            yield node.module
