"""Small sweeps, run as their user would."""

from __future__ import annotations

import signal
import sqlite3
import subprocess
import sys
from pathlib import Path
from typing import Any

import pandas
from ballplate.extensions.sweeps.running import stored_result
from ballplate.extensions.sweeps.store import open_store

from tests.reference.copies import copy_file

ROOT = Path(__file__).parents[3]

# The last cells are no valid experiments: the plate reaches out of the volume.
SWEEP = """\
title: many small cells
base: quickstart.yaml
axes:
  size: {paths: ["artefacts.plate.size[0]", "artefacts.plate.size[1]"], from: 700 mm, to: 1100 mm, count: COUNT}
  balls: {paths: ["artefacts.plate.balls[0]", "artefacts.plate.balls[1]"], values: [4, 5]}
seed: 3
"""


def small_sweep(folder: Path, count: int, more: str = "") -> Path:
    copy_file(ROOT / "designs" / "quickstart.yaml", folder)
    path = folder / "small.yaml"
    path.write_text(SWEEP.replace("COUNT", str(count)) + more, encoding="utf-8")
    return path


# Four plans of ten candidates each, all of whose choices are tried.
POOL = """\
pool:
  candidates:
    - {planes: [x], levels: [20 %], corners: {y: [low, high], z: [low]}, probes: [[right, left]]}
    - {planes: [y], levels: [20 %], corners: {x: [low, high], z: [low]}, probes: [[back, front]]}
"""
PLANNED = """\
title: plans of small pools
base: base.yaml
plan: {criterion: U6, hours: [4 h, 300 min], seed: 3}
axes:
  size: {paths: ["artefacts.plate.size[0]", "artefacts.plate.size[1]"], values: [600 mm, 750 mm]}
record: [U6]
"""


def planned_sweep(folder: Path) -> Path:
    text = (ROOT / "designs" / "quickstart.yaml").read_text(encoding="utf-8")
    text = text.replace("random: 200", "random: 20") + POOL
    (folder / "base.yaml").write_text(text, encoding="utf-8")
    path = folder / "plans.yaml"
    path.write_text(PLANNED, encoding="utf-8")
    return path


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "ballplate", *map(str, arguments)]


def hearing_interruptions() -> None:
    """For `preexec_fn`: what shells start in the background ignores interruptions, and so does all
    that it starts.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def run(*arguments: object, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command(*arguments), cwd=ROOT, capture_output=True, text=True, timeout=240, **options
    )


def stored(path: Path) -> int:
    """Rows on disk, 0 before there is a store."""
    if not path.exists():
        return 0
    try:
        connection = sqlite3.connect(f"file:{path}?mode=ro", uri=True, timeout=5.0)
        try:
            return int(connection.execute("SELECT count(*) FROM result").fetchone()[0])
        finally:
            connection.close()
    except sqlite3.Error:
        return 0


def rows(store: Path) -> pandas.DataFrame:
    """All rows but the time that they took."""
    opened = open_store(store)
    try:
        return stored_result(opened).table.drop(columns="duration_s")
    finally:
        opened.close()


def assert_same(one: pandas.DataFrame, other: pandas.DataFrame) -> None:
    """Bit for bit."""
    assert list(one.columns) == list(other.columns)
    assert one.equals(other)
    for name in one.select_dtypes("float"):
        assert one[name].to_numpy().tobytes() == other[name].to_numpy().tobytes(), name
