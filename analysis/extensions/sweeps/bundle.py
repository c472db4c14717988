"""The files that a sweep depends on, so that any machine can compute its cells and a store can tell
what changed.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath, PurePosixPath
from typing import Any

from ballplate.simulator.experiment import is_rooted, python_models
from ballplate.simulator.inputs import Node, read_tree, refused, to_list, to_python

from .model import Sweep
from .named_files import named_files

# Of all files together, as they are kept in the store and sent to workers.
MOST_BYTES = 100_000_000


@dataclass(frozen=True)
class Bundle:
    """Contents of files by their path below a common folder; `source` is the sweep file, `base` the
    experiment file.
    """

    source: str
    base: str
    files: tuple[tuple[str, bytes], ...]

    @property
    def digest(self) -> str:
        """A hash of all paths and contents."""
        found = hashlib.blake2b(digest_size=20)
        for name, content in self.files:
            found.update(f"{len(name)} {name} {len(content)} ".encode("utf-8", "surrogatepass"))
            found.update(content)
        return found.hexdigest()


def bundle_of(sweep: Sweep) -> Bundle:
    """The sweep file, its base, and the files that these name.

    :raises ExperimentError: as `files_of`, a file that cannot be read, or too much in all.
    """
    source, base = (Path(os.path.abspath(path)) for path in (sweep.source, sweep.base))
    paths = files_of(sweep)
    try:
        names = names_of(paths)
    except ValueError:
        text = f"{sweep.base} lies on another drive than the sweep file; put both on the same one"
        raise refused(sweep.source, text, "base") from None
    try:
        size = sum(path.stat().st_size for path in paths)
        if size > MOST_BYTES:
            text = (
                f"the files that the sweep names hold {size / 1e6:.0f} MB, and"
                f" {MOST_BYTES / 1e6:.0f} MB are the limit of what a store takes; name large files"
                " from the root of the file system"
            )
            raise refused(sweep.source, text)
        files = tuple((name, Path(path).read_bytes()) for path, name in names.items())
    except OSError as error:
        text = f"cannot be read ({error.strerror}); check its name and permissions"
        raise refused(error.filename, text) from None
    return Bundle(names[source], names[base], files)


def names_of(paths: Sequence[PurePath]) -> dict[PurePath, str]:
    """Names of absolute paths below the lowest folder that has them all, in the same order on every
    system.

    :raises ValueError: they lie on several drives.

    >>> from pathlib import PureWindowsPath
    >>> paths = [PureWindowsPath("C:/plan/b.yaml"), PureWindowsPath("c:/PLAN/tables/A.csv")]
    >>> list(names_of(paths).values())
    ['b.yaml', 'tables/A.csv']
    """
    top = next(
        (one for one in paths[0].parents if all(path.is_relative_to(one) for path in paths)), None
    )
    if top is None:
        raise ValueError("no folder has files of several drives")
    names = {path: path.relative_to(top).as_posix() for path in paths}
    # Paths of Windows are ordered whatever their case.
    return dict(sorted(names.items(), key=lambda item: PurePosixPath(item[1])))


def files_of(sweep: Sweep) -> list[Path]:
    """Absolute paths of the files of a sweep's bundle.

    :raises ExperimentError: a path that leads through a link and back, so that it means another
        file than it says, or a file outside the folders of the sweep.
    """
    source, base = (Path(os.path.abspath(path)) for path in (sweep.source, sweep.base))
    if not base.is_file() or not base.samefile(sweep.base):
        text = (
            f"{sweep.base} leads through a link to another folder and back; name the file from its"
            " real folder"
        )
        raise refused(sweep.source, text, "base")
    return sorted({source, base, *named_files(sweep)})


def unpack(bundle: Bundle, folder: Path) -> Path:
    """Write the files below a folder and return the sweep file there.

    :raises ValueError: a path that leads out of the folder, or two that are one file where case
        makes no difference.
    """
    for name, content in bundle.files:
        place = PurePosixPath(name)
        if is_rooted(name) or ".." in place.parts or "\\" in name:
            raise ValueError(f'"{name}" leads out of the folder')
        path = folder / place
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with path.open("xb") as stream:
                stream.write(content)
        except FileExistsError:
            raise ValueError(
                f'"{name}" is the same file here as one whose name differs in case only'
            ) from None
    return folder / PurePosixPath(bundle.source)


def has_code(tree: Node) -> bool:
    """Whether an experiment may have an error model written in Python."""
    return any(True for _ in python_models(tree))


def code_digest(bundle: Bundle) -> str:
    """A hash of everything but the YAML files: what a model written in Python may read or
    import.
    """
    kept = tuple(item for item in bundle.files if item[0] not in (bundle.source, bundle.base))
    return Bundle("", "", kept).digest


def definition(sweep: Sweep, bundle: Bundle) -> dict[str, Any]:
    """What a store keeps of a sweep as plain data: by it a changed file is told from the same
    one.
    """
    return {
        "title": sweep.title,
        "source": bundle.source,
        "base": bundle.base,
        "sweep": to_list(to_python(read_tree(sweep.source))),
        "experiment": to_list(to_python(read_tree(sweep.base))),
        "files": {
            name: hashlib.blake2b(content, digest_size=20).hexdigest()
            for name, content in bundle.files
            if name not in (bundle.source, bundle.base)
        },
        "axes": [
            {
                "name": axis.name,
                "column": axis.column,
                "unit": axis.unit,
                "labels": [choice.label for choice in axis.choices],
                "values": [choice.value for choice in axis.choices] if axis.unit else [],
            }
            for axis in sweep.axes
        ],
        "cells": [list(cell) for cell in sweep.cells],
        "trials": sweep.trials,
        "seed": sweep.seed,
        "record": list(sweep.record),
    }


# What may change without changing a figure.
WORDS = ("title", "description")


def changes(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """Differences of two definitions that matter, each in a line."""
    found = []
    for part, name in (("sweep", new["source"]), ("experiment", new["base"])):
        before, after = (dict(_flat(one[part], "")) for one in (old, new))
        for path in dict.fromkeys([*before, *after]):
            if path in WORDS or json.dumps(before.get(path)) == json.dumps(after.get(path)):
                continue
            if path not in after:
                found.append(f"{name}: {path}: {before[path]!r} is gone")
            elif path not in before:
                found.append(f"{name}: {path}: {after[path]!r} is new")
            else:
                found.append(f"{name}: {path}: {before[path]!r} has become {after[path]!r}")
    for path in dict.fromkeys([*old["files"], *new["files"]]):
        if old["files"].get(path) != new["files"].get(path):
            found.append(f"{path}: another content")
    return found


def _flat(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and value:
        for key, item in value.items():
            yield from _flat(item, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list) and value:
        for k, item in enumerate(value):
            yield from _flat(item, f"{path}[{k}]")
    else:
        yield path, value
