"""Files that appear in a folder, once they are whole."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

# What tables of readings end in; other files in the folder are none of its business.
TABLES = (".csv", ".tsv", ".txt", ".dat", ".asc")


def settled(folder: Path, wait: Callable[[], object]) -> Iterator[list[Path]]:
    """The tables in a folder in the order in which they were last written, each time that has
    changed.

    A file counts as whole when it is not empty and the same, by time and size, before and after a
    `wait`; others are left out until they are.

    :raises OSError: the folder cannot be read.
    """
    before: dict[Path, tuple[int, int]] = {}
    sizes: dict[Path, tuple[int, int]] = {}
    while True:
        now = _tables(folder)
        whole = {path: stamp for path, stamp in now.items() if before.get(path) == stamp}
        if whole and whole != sizes:
            sizes = whole
            yield sorted(whole, key=lambda path: (whole[path][0], path.name))
        before = now
        wait()


def _tables(folder: Path) -> dict[Path, tuple[int, int]]:
    tables = {}
    with os.scandir(folder) as entries:
        for entry in entries:
            path = Path(entry.path)
            if path.suffix.lower() not in TABLES or path.name.startswith((".", "~")):
                continue
            try:
                status = entry.stat()
            except FileNotFoundError:
                # Gone, or renamed, since the folder was listed.
                continue
            if status.st_size and entry.is_file():
                tables[path] = status.st_mtime_ns, status.st_size
    return tables
