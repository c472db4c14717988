"""The extension of our laboratory, installed in a folder as pip does it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

TOP = Path(__file__).parents[2]
LABORATORY = TOP / "tests" / "extensions" / "installed" / "our-laboratory"
STARTED = """
import contextlib, io, json, sys
from pathlib import Path

import ballplate as bp
from ballplate.cli import main

def said(*words):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = main(list(map(str, words)))
        except SystemExit as end:
            status = end.code
    return [status, out.getvalue(), err.getvalue()]

folder = Path(sys.argv[1])
"""


def install(folder: Path, package: Path = LABORATORY) -> Path:
    """Copy a package into a folder, with what pip writes beside it; return the folder."""
    project = tomllib.loads((package / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    name = project["name"].replace("-", "_")
    shutil.copytree(package / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    about = folder / f"{name}-{project['version']}.dist-info"
    about.mkdir()
    stated = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    (about / "METADATA").write_text(stated, encoding="utf-8")
    lines = [
        line
        for group, points in project["entry-points"].items()
        for line in (f"[{group}]", *(f"{name} = {value}" for name, value in points.items()))
    ]
    (about / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def said_with(installed: Path | None, script: str, *arguments: object) -> dict[str, Any]:
    """What a script prints as JSON where the extensions in a folder are installed, or none."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", STARTED + script, *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": str(installed or "")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout.splitlines()[-1]))
