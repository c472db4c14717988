"""The share of random mutants that tests notice, by room.

Each test runs once to learn which mutants it reaches. The fast tests that reach a mutant then run
with it, the fastest first, until one of them fails. Both are kept in files, a line each, so that a
run that was stopped goes on where it was.
"""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import pytest

from tests.mutation.forks import change, collected, first_failure, in_fork, reached
from tests.mutation.mutants import Mutant, drawn, mutants, source_of
from tests.reference.installed_extension import TOP


def _rooms() -> dict[str, str]:
    """All folders of the kernel and of the extensions that have modules, by name."""
    below = {"simulator": "simulator/", "analysis": "", "analysis/extensions": "extensions/"}
    return {
        f"{prefix.removeprefix('simulator/')}{path.name}": f"{prefix}{path.name}"
        for folder, prefix in below.items()
        for path in sorted((TOP / folder).iterdir())
        if (path / "__init__.py").is_file() and path.name != "extensions"
    }


ROOMS = _rooms()
# Tests of what runs as a process or in a browser, or would run all others, do not see a mutant.
BLIND = ("docs", "mutation", "robustness")


@dataclass(frozen=True)
class Outcome:
    """What the tests did with a mutant: "noticed", "survived", "unreached" or "too long"; the test
    that failed, if any.
    """

    room: str
    mutant: str
    ended: str
    seconds: float
    test: str = ""


def sample(room: str, count: int, seed: int = 1) -> list[Mutant]:
    """So many mutants of a room at random."""
    folder = source_of(ROOMS[room])
    every: list[Mutant] = []
    for path in sorted(folder.rglob("*.py")):
        every += mutants(path, f"{ROOMS[room]}/{path.relative_to(folder).as_posix()}")
    return drawn(every, count, seed)


def files_of_tests() -> list[str]:
    """The folders and files of tests that may notice a mutant."""
    top = Path(__file__).parents[1]
    every = [*top.iterdir(), *(top / "extensions").iterdir()]
    folders = [path for path in sorted(every) if path.name not in (*BLIND, "extensions")]
    return [str(path) for path in folders if path.is_dir() or path.name.startswith("test_")]


def scored(
    rooms: list[str],
    count: int,
    seed: int,
    store: Path,
    seconds: float,
    each: float,
    paths: list[str],
) -> list[Outcome]:
    """Outcomes of `count` mutants of each room, those in the store first; no mutant is begun after
    so many `seconds`, and the tests that run for one take at most `each` without it.
    """
    samples = {room: sample(room, count, seed) for room in rooms}
    turns = [
        (room, samples[room][k]) for k in range(count) for room in rooms if k < len(samples[room])
    ]
    kept = {one.mutant: one for one in stored(store)}
    end = time.monotonic() + seconds

    def try_each(items: list[pytest.Item]) -> None:
        runs = _runs(items, list(chain(*samples.values())), store.with_suffix(".reach"))
        for room, mutant in turns:
            if mutant.name not in kept and time.monotonic() < end:
                outcome = _tried(room, mutant, _reaching(mutant, items, runs, each), each)
                kept[mutant.name] = outcome
                _append(store, [asdict(outcome)])

    collected(paths, try_each)
    return [kept[mutant.name] for _, mutant in turns if mutant.name in kept]


def stored(store: Path) -> list[Outcome]:
    """The outcomes so far."""
    return [Outcome(**line) for line in _lines(store)]


def summary(outcomes: list[Outcome]) -> list[str]:
    """The score of each room, of kernel and extensions, and the place of each mutant not noticed."""
    lines = []
    for room in dict.fromkeys(one.room for one in outcomes):
        of_room = [one for one in outcomes if one.room == room]
        lines.append(f"{room}: {_score(of_room)}")
        lines += [f"  {one.ended}: {one.mutant}" for one in of_room if one.ended != "noticed"]
    for name, inside in (("kernel", False), ("extensions", True)):
        some = [one for one in outcomes if one.room.startswith("extensions/") is inside]
        lines.append(f"{name}: {_score(some)}")
    return [*lines, f"all rooms: {_score(outcomes)}"]


def _score(outcomes: list[Outcome]) -> str:
    """What no test reaches is not noticed; what makes tests run for ever is."""
    count = Counter(one.ended for one in outcomes)
    return (
        f"{count['noticed'] + count['too long']} of {len(outcomes)} noticed,"
        f" {count['too long']} of them since tests took too long, {count['unreached']} not reached"
    )


def _runs(items: list[pytest.Item], every: list[Mutant], store: Path) -> dict[str, dict[str, Any]]:
    """What each test reaches; those that the store has not are run first."""
    of_these = {"mutants": sorted(one.name for one in every)}
    if next(_lines(store), None) != of_these:
        store.write_text(json.dumps(of_these) + "\n", encoding="utf-8")
    known = {line["test"] for line in _lines(store) if "test" in line}
    new = [item for item in items if item.nodeid not in known]
    if new:
        in_fork(lambda: _append(store, reached(new, every)), 7200.0)
    return {line["test"]: line for line in _lines(store) if "test" in line}


def _reaching(
    mutant: Mutant, items: list[pytest.Item], runs: dict[str, dict[str, Any]], each: float
) -> list[pytest.Item]:
    """The tests that reach a mutant and pass without it, those first that cost least."""
    some = [
        item
        for item in items
        if item.nodeid in runs
        and runs[item.nodeid]["passes"]
        and mutant.name in runs[item.nodeid]["reaches"]
    ]
    # Tests that reach little else are about the mutant's place.
    some.sort(key=lambda item: _cost(runs[item.nodeid]))
    total, few = 0.0, []
    for item in some:
        more = total + runs[item.nodeid]["seconds"]
        if more < each or not few:
            total, few = more, [*few, item]
    return few


def _cost(run: dict[str, Any]) -> float:
    return float((run["seconds"] + 0.05) * len(run["reaches"]))


def _tried(room: str, mutant: Mutant, items: list[pytest.Item], each: float) -> Outcome:
    if not items:
        return Outcome(room, mutant.name, "unreached", 0.0)

    def try_it() -> list[str | None]:
        change(mutant)
        return [first_failure(items)]

    start = time.monotonic()
    ended = in_fork(try_it, 3 * each)
    spent = round(time.monotonic() - start, 1)
    if ended is None:
        return Outcome(room, mutant.name, "too long", spent)
    return Outcome(room, mutant.name, "noticed" if ended[0] else "survived", spent, ended[0] or "")


def _lines(store: Path) -> Iterable[Any]:
    """The lines of a store; the last one of a run that was killed may be half a line."""
    text = store.read_text(encoding="utf-8") if store.exists() else ""
    return map(json.loads, text[: text.rfind("\n") + 1].splitlines())


def _append(store: Path, lines: Iterable[Any]) -> None:
    text = store.read_bytes() if store.exists() else b""
    with store.open("ab") as stream:
        stream.truncate(text.rfind(b"\n") + 1)
        for line in lines:
            stream.write(json.dumps(line).encode() + b"\n")
            stream.flush()
