"""Expansion of file patterns, also on systems whose shell does not expand them."""

from __future__ import annotations

import glob
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path

# Folders whose YAML files are no experiments.
OTHERS = ("sweeps", "machines")


def matching_files(patterns: Sequence[Path]) -> list[Path]:
    """Return files of names and patterns, each once; patterns omit folders of sweeps and machines.

    A pattern without a match is kept and reported as a missing file.
    """
    paths: dict[Path, None] = {}
    for path in patterns:
        matches = (
            [Path(name) for name in sorted(glob.glob(str(path), recursive=True))]
            if is_pattern(path)
            else []
        )
        # Folders that the pattern names itself are meant.
        named = sum(1 for _ in takewhile(lambda part: not glob.has_magic(part), path.parts))
        chosen = [
            match
            for match in matches
            if match.is_file() and not set(match.parts[named:-1]) & set(OTHERS)
        ]
        paths |= dict.fromkeys(chosen or [path])
    return list(paths)


def is_pattern(path: Path) -> bool:
    """True if a path is a pattern, and not the name of a file."""
    return glob.has_magic(str(path)) and not path.exists()
