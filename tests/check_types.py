"""Checks the types of the whole package: `python -m tests.check_types`.

The folders `analysis`, `simulator` and `designs` are parts of one package, as pyproject.toml says.
A type checker that reads no package mappings finds it below build/types, where its parts are linked
together.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).parents[1]
LINKED = TOP / "build" / "types" / "ballplate"


def main() -> int:
    """Link the package together and run mypy over it."""
    shutil.rmtree(LINKED, ignore_errors=True)
    LINKED.mkdir(parents=True)
    parts = [path for path in sorted((TOP / "analysis").iterdir()) if path.name != "__pycache__"]
    for part in [*parts, TOP / "simulator", TOP / "designs"]:
        _link(part, LINKED / part.name)
    return subprocess.run([sys.executable, "-m", "mypy"], cwd=TOP).returncode


def _link(part: Path, place: Path) -> None:
    try:
        place.symlink_to(part, target_is_directory=part.is_dir())
    except OSError:
        # Windows allows links to administrators and developers only.
        (shutil.copytree if part.is_dir() else shutil.copy)(part, place)


if __name__ == "__main__":
    sys.exit(main())
