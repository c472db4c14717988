"""Files of a sweep, so that any machine can compute its cells and changes are detected."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath, PurePosixPath
from typing import Any

from ballplate.simulator.experiment import is_rooted
from ballplate.simulator.inputs import read_tree, refused, to_list, to_python

from .model import Sweep
from .named_files import named_files

# All files together, which workers receive.
MOST_BYTES = 100_000_000


@dataclass(frozen=True)
class Bundle:
    """Contents of files by path below a common folder; `source` is the sweep file, `base` the
    experiment.
    """

    source: str
    base: str
    files: tuple[tuple[str, bytes], ...]

    @property
    def digest(self) -> str:
        """Hash of all paths and contents."""
        total = hashlib.blake2b(digest_size=20)
        for name, content in self.files:
            total.update(f"{len(name)} {name} {len(content)} ".encode("utf-8", "surrogatepass"))
            total.update(content)
        return total.hexdigest()


def bundle_of(sweep: Sweep) -> Bundle:
    """Return the sweep file, its base, and the files that these name.

    :raises ExperimentError: a file is missing, forbidden or unreadable, or the files are too large.
    """
    source, base = (Path(os.path.abspath(path)) for path in (sweep.source, sweep.base))
    paths = files_of(sweep)
    try:
        names = names_of(paths)
    except ValueError:
        text = f"{sweep.base} is on another drive than the sweep file; move one"
        raise refused(sweep.source, text, "base") from None
    try:
        size = sum(path.stat().st_size for path in paths)
        if size > MOST_BYTES:
            text = (
                f"the files of the sweep have {size / 1e6:.0f} MB; {MOST_BYTES / 1e6:.0f} MB are"
                " the limit of a sweep; name large files from the root of the file system"
            )
            raise refused(sweep.source, text)
        files = tuple((name, Path(path).read_bytes()) for path, name in names.items())
    except OSError as error:
        text = f"cannot be read ({error.strerror}); check its name and permissions"
        raise refused(error.filename, text) from None
    return Bundle(names[source], names[base], files)


def names_of(paths: Sequence[PurePath]) -> dict[PurePath, str]:
    """Return names of absolute paths below their lowest common folder, in the same order on every
    system.

    :raises ValueError: the paths are on several drives.

    >>> from pathlib import PureWindowsPath
    >>> paths = [PureWindowsPath("C:/plan/b.yaml"), PureWindowsPath("c:/PLAN/tables/A.csv")]
    >>> list(names_of(paths).values())
    ['b.yaml', 'tables/A.csv']
    """
    top = next(
        (
            folder
            for folder in paths[0].parents
            if all(path.is_relative_to(folder) for path in paths)
        ),
        None,
    )
    if top is None:
        raise ValueError("no folder has files of several drives")
    names = {path: path.relative_to(top).as_posix() for path in paths}
    # Windows paths would be sorted regardless of case.
    return dict(sorted(names.items(), key=lambda item: PurePosixPath(item[1])))


def files_of(sweep: Sweep) -> list[Path]:
    """Return the absolute paths of the files of a sweep's bundle.

    :raises ExperimentError: a path leads through a link and back, so that it means another file, or
        a file is outside the folders of the sweep.
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

    :raises ValueError: a path leads out of the folder, or two are the same file because case makes
        no difference.
    """
    for name, content in bundle.files:
        relative = PurePosixPath(name)
        if is_rooted(name) or ".." in relative.parts or "\\" in name:
            raise ValueError(f'"{name}" leads out of the folder')
        path = folder / relative
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with path.open("xb") as stream:
                stream.write(content)
        except FileExistsError:
            raise ValueError(
                f'"{name}" is the same file here as one whose name differs in case only'
            ) from None
    return folder / PurePosixPath(bundle.source)


def code_digest(bundle: Bundle) -> str:
    """Return a hash of all files that a model in Python may read or import."""
    # The fingerprint covers the two YAML files.
    files = tuple(item for item in bundle.files if item[0] not in (bundle.source, bundle.base))
    return Bundle("", "", files).digest


def definition(sweep: Sweep, bundle: Bundle) -> dict[str, Any]:
    """Return a sweep as the plain data that a store keeps, by which it detects changes."""
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


# Keys without influence on the results.
WORDS = ("title", "description")


def changes(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """Return the differences of two definitions that influence results, one line each."""
    lines = []
    for part, name in (("sweep", new["source"]), ("experiment", new["base"])):
        before, after = (dict(_flat(defined[part], "")) for defined in (old, new))
        for path in dict.fromkeys([*before, *after]):
            if path in WORDS or json.dumps(before.get(path)) == json.dumps(after.get(path)):
                continue
            if path not in after:
                lines.append(f"{name}: {path}: {before[path]!r} is gone")
            elif path not in before:
                lines.append(f"{name}: {path}: {after[path]!r} is new")
            else:
                lines.append(f"{name}: {path}: {before[path]!r} has become {after[path]!r}")
    for path in dict.fromkeys([*old["files"], *new["files"]]):
        if old["files"].get(path) != new["files"].get(path):
            lines.append(f"{path}: another content")
    return lines


def _flat(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and value:
        for key, item in value.items():
            yield from _flat(item, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list) and value:
        for k, item in enumerate(value):
            yield from _flat(item, f"{path}[{k}]")
    else:
        yield path, value
