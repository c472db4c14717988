"""Copies of the package, to which tests add what the documentation says that one may add."""

from __future__ import annotations

import json
import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path
from typing import Any

TOP = Path(__file__).parents[2]


def package_copy(folder: Path) -> Path:
    """The package, with what it is compiled to, copied into a folder; where it is."""
    package = folder / "ballplate"
    shutil.copytree(TOP / "analysis", package)
    for part in ("simulator", "designs"):
        # A copy of what cannot be written has to take more files.
        package.chmod(0o755)
        shutil.copytree(TOP / part, package / part)
    for path in (package, *package.rglob("*")):
        path.chmod(path.stat().st_mode | stat.S_IWUSR)
    return package


def documented(heading: str) -> tuple[str, str]:
    """The new file and the lines of registration that stand in the page below a heading."""
    page = (TOP / "docs" / "how-to" / "extend.md").read_text(encoding="utf-8")
    page = page.partition(heading)[2]
    file, entry = (part.split("```\n")[0] for part in page.split("```python\n")[1:3])
    return file, entry


def said_by_copy(folder: Path, script: str, *arguments: object) -> dict[str, Any]:
    """What a script that imports the copy in a folder prints as JSON; a warning is an error."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script, *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": str(folder)},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))
