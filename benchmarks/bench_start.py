"""Processor time of short commands from start to end, and of a sweep's cell in its process.

Run with

    python -m pytest benchmarks/bench_start.py

Processes take turns, round by round; what is printed is the least time that each took of the
processor, its own and the system's for it, and the same less that of a Python that does nothing.
`import numpy, pydantic, yaml` is what no command can do without. Compiled modules are there from a
first round, as they are of anything that is installed.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import pytest
from ballplate.extensions.sweeps.load import load_sweep
from ballplate.extensions.sweeps.task import CellTask, compute

from .bench_sweep import written

ROOT = Path(__file__).parents[1]
ROUNDS = 10
CELLS = 100
COMMANDS = {
    "nothing": ["-c", "pass"],
    "import numpy, pydantic, yaml": ["-c", "import numpy, pydantic, yaml"],
    "the same and ballplate": ["-c", "import numpy, pydantic, yaml, ballplate"],
    "the same and ballplate.run": ["-c", "import numpy, pydantic, yaml, ballplate; ballplate.run"],
    "ballplate --help": ["-m", "ballplate", "--help"],
    "ballplate check": ["-m", "ballplate", "check", "designs/quickstart.yaml"],
}
LINES: list[str] = []


def processor_time(arguments: list[str], compiled: Path) -> float:
    """Seconds of a processor that a Python process takes."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    environment |= {"PYTHONPYCACHEPREFIX": str(compiled), "OPENBLAS_NUM_THREADS": "1"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, *arguments]
    subprocess.run(command, cwd=ROOT, env=environment, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def test_commands(tmp_path: Path) -> None:
    times: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for number in range(ROUNDS + 1):
        for name, arguments in COMMANDS.items():
            seconds = processor_time(arguments, tmp_path)
            times[name] += [seconds] if number else []
    nothing = min(times["nothing"])
    for name, own in times.items():
        LINES.append(f"| {name} | {min(own):.3f} | {min(own) - nothing:.3f} |")


def test_a_cell(tmp_path: Path) -> None:
    sweep = load_sweep(written(tmp_path, CELLS))
    seconds = []
    for number in range(CELLS):
        start = time.process_time()
        row = compute(sweep, CellTask(number))
        seconds.append(time.process_time() - start)
        assert row.status == "done"
    LINES.append(f"| a cell of a sweep of the quickstart | {min(seconds):.4f} | |")


def test_lines(capsys: pytest.CaptureFixture[str]) -> None:
    with capsys.disabled():
        print("\n\n| process | s | less nothing, s |\n" + "\n".join(LINES))
