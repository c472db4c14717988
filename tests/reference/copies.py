"""Copies of files of the checkout that can be written even where the checkout cannot."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any


def copy_file(source: Path | str, target: Path | str) -> Path:
    """Copy a file into a folder or under a name, without its mode."""
    target = Path(target)
    path = target / Path(source).name if target.is_dir() else target
    return Path(shutil.copyfile(source, path))


def copy_tree(source: Path | str, target: Path, **options: Any) -> Path:
    """Copy a folder, as `shutil.copytree` does, without the modes of what is in it."""
    shutil.copytree(source, target, copy_function=shutil.copyfile, **options)
    for path in (target, *target.rglob("*")):
        if path.is_dir() and not path.is_symlink():
            path.chmod(0o755)
    return target
