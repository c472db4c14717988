"""The basic commands work where a room that they do not need is missing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

# What the basic commands do without.
ROOMS = (
    "ballplate.extensions.judgement",
    "ballplate.extensions.judgement",
    "ballplate.extensions.maps",
    "ballplate.extensions.certificates",
    "ballplate.extensions.laboratory.formats",
    "ballplate.extensions.compensation",
    "ballplate.extensions.repair",
    "ballplate.extensions.requirements",
    "ballplate.extensions.pages",
    "ballplate.error_maps",
    "ballplate.extensions.sweeps",
    "ballplate.extensions.sweeps.report",
    "ballplate.extensions.reproduction",
    "ballplate.extensions.studio",
)
WITHOUT = """
import sys
from importlib.abc import MetaPathFinder

class Missing(MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name.startswith(tuple(sys.argv[3:])):
            raise ModuleNotFoundError(f"{name} is hidden")

sys.meta_path.insert(0, Missing())
from ballplate.cli import main

quickstart = "designs/quickstart.yaml"
for line in (
    ["check", quickstart],
    ["run", quickstart],
    ["simulate", quickstart, "-o", sys.argv[1]],
    ["simulate", quickstart, "-o", sys.argv[1], "--force"],
    ["plan", sys.argv[2], "--positions", "6", "--workers", "1"],
    ["compare", quickstart, "--trials", "2"],
    ["fit", quickstart, sys.argv[1]],
):
    assert main([*line, "--quiet"]) == 0, line
"""


POOL = """
pool:
  candidates:
    - {name: low, plane: z, level: 100 mm, corner: {x: 0 mm, y: 0 mm}, probes: [down]}
"""


@pytest.mark.parametrize(
    "rooms",
    [ROOMS, *(pytest.param((room,), marks=pytest.mark.long) for room in ROOMS)],
    ids=["every one", *ROOMS],
)
def test_basic_commands_work_without(rooms: tuple[str, ...], tmp_path: Path) -> None:
    quickstart = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
    (tmp_path / "pool.yaml").write_text(quickstart + POOL, encoding="utf-8")
    files = (str(tmp_path / "readings.csv"), str(tmp_path / "pool.yaml"))
    command = [sys.executable, "-c", WITHOUT, *files, *rooms]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
