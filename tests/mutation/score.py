"""The share of random mutants that tests notice, by room.

Each mutant is made in a copy of the package, and the tests of its room are run against the copy, in
one process, until one of them fails. Results are kept in a file, a line each, so that a run that was
stopped goes on where it was.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from tests.mutation.mutants import Mutant, drawn, mutants, mutated
from tests.reference.package_copies import TOP, package_copy

# Folders of a room below the package, and fast tests of it; those of the oracle are of all.
ROOMS = {
    "estimation": (("simulator/estimation",), ("tests/estimation/test_against_dense.py",)),
    "design": (
        ("simulator/design",),
        ("tests/observations/test_joint_values.py", "tests/influences/test_temperature.py"),
    ),
    "geometry": (("simulator/geometry",), ("tests/geometry",)),
    "machines": (("simulator/machines",), ("tests/machines",)),
    "uncertainty": (
        ("uncertainty",),
        ("tests/analysis/test_tasks.py", "tests/analysis/test_scale.py"),
    ),
    "rank": (
        ("rank",),
        ("tests/analysis/test_bar_directions.py", "tests/analysis/test_canonical.py"),
    ),
    "montecarlo": (("montecarlo",), ("tests/montecarlo/test_noise.py",)),
    "results": (
        ("results",),
        ("tests/analysis/test_budget.py", "tests/maps/test_correct.py"),
    ),
    "planning": (
        ("planning",),
        ("tests/planning/test_smallest_budgets.py", "tests/planning/test_information.py"),
    ),
}
ORACLE = "tests/oracle"


@dataclass(frozen=True)
class Outcome:
    """Whether the tests noticed a mutant: "noticed", "survived", or "too long"."""

    room: str
    mutant: str
    ended: str
    seconds: float


def sample(room: str, count: int, seed: int = 1) -> list[Mutant]:
    """So many mutants of a room at random."""
    every: list[Mutant] = []
    for folder in ROOMS[room][0]:
        top, _, rest = folder.partition("/")
        source = TOP / folder if top == "simulator" else TOP / "analysis" / folder
        for path in sorted(source.rglob("*.py")):
            every += mutants(path, f"{folder}/{path.relative_to(source).as_posix()}")
    return drawn(every, count, seed)


def scored(
    rooms: list[str], count: int, store: Path, copy: Path, seconds: float, each: float = 120.0
) -> list[Outcome]:
    """Outcomes of `count` mutants of each room, those in the store first; no mutant is begun after
    so many `seconds`, and none may take longer than `each`.
    """
    # The last line of a run that was killed may be half a line.
    text = store.read_text(encoding="utf-8") if store.exists() else ""
    text = text[: text.rfind("\n") + 1]
    store.write_text(text, encoding="utf-8")
    kept = {one.mutant: one for one in (Outcome(**json.loads(line)) for line in text.splitlines())}
    package = copy / "ballplate"
    if not package.exists():
        package_copy(copy)
    end = time.monotonic() + seconds
    samples = {room: sample(room, count) for room in rooms}
    turns = [
        (room, samples[room][k]) for k in range(count) for room in rooms if k < len(samples[room])
    ]
    found = []
    for room, mutant in turns:
        if mutant.name not in kept:
            if time.monotonic() > end:
                continue
            outcome = _tried(room, mutant, package, min(each, seconds))
            kept[mutant.name] = outcome
            with store.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(asdict(outcome)) + "\n")
        found.append(kept[mutant.name])
    return found


def summary(outcomes: list[Outcome]) -> list[str]:
    """The score of each room, and the place of each mutant that was not noticed."""
    lines = []
    for room in dict.fromkeys(one.room for one in outcomes):
        of_room = [one for one in outcomes if one.room == room]
        noticed = sum(one.ended == "noticed" for one in of_room)
        late = sum(one.ended == "too long" for one in of_room)
        lines.append(f"{room}: {noticed} of {len(of_room)} noticed, {late} took too long")
        lines += [f"  {one.ended}: {one.mutant}" for one in of_room if one.ended != "noticed"]
    noticed = sum(one.ended == "noticed" for one in outcomes)
    return [*lines, f"all rooms: {noticed} of {len(outcomes)} noticed"]


def passes(room: str, copy: Path, each: float = 600.0) -> bool:
    """Whether the tests of a room pass with the copy of the package as it is."""
    return _run(room, copy, each) == "survived"


def _tried(room: str, mutant: Mutant, package: Path, each: float) -> Outcome:
    path = package / mutant.path
    source = path.read_text(encoding="utf-8")
    original = (
        TOP / mutant.path
        if mutant.path.startswith("simulator/")
        else TOP / "analysis" / mutant.path
    )
    start = time.monotonic()
    try:
        path.write_text(mutated(original, mutant), encoding="utf-8")
        ended = _run(room, package.parent, each)
    finally:
        path.write_text(source, encoding="utf-8")
    return Outcome(room, mutant.name, ended, round(time.monotonic() - start, 1))


def _run(room: str, copy: Path, each: float) -> str:
    line = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider"]
    line += ["-m", "not slow and not long and not browser", ORACLE, *ROOMS[room][1]]
    environment = {**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    environment["OPENBLAS_NUM_THREADS"] = "1"
    try:
        done = subprocess.run(
            line, cwd=TOP, env=environment, capture_output=True, timeout=each, check=False
        )
    except subprocess.TimeoutExpired:
        return "too long"
    # 2 is a module that cannot be loaded any more; a wrong line or no tests at all are faults of ours.
    ended = {0: "survived", 1: "noticed", 2: "noticed", 3: "noticed"}
    if done.returncode not in ended:
        raise RuntimeError(f"{' '.join(line)}: {done.stdout.decode()}{done.stderr.decode()}")
    return ended[done.returncode]
