"""Whatever command lines, files and stores say, there is a result or what is wrong, soon and in
bounded memory.

`cases` says what is tried, and how to try one case alone.
"""

from __future__ import annotations

import os
import shlex
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random

import pytest

from tests.robustness import cases
from tests.robustness.cases import STATUS, STATUSES, Case, case, lay_out, trial, warm_up
from tests.robustness.command_lines import drawn, grammar, quick
from tests.robustness.kit import make_kit
from tests.robustness.recipes import RECIPES
from tests.robustness.worker import Worker

# Where a test ends, as the next may fail for the same reason.
ENOUGH = 10
FEW, MANY = range(0, len(RECIPES), 2), range(20_000)


@pytest.fixture(scope="module")
def kit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("kit")
    make_kit(folder)
    return folder


Outcomes = Counter[tuple[str, str]]
"""How many cases of a command ended with a status, by both."""


def faults(kit: Path, folder: Path, tried: Iterable[Case], outcomes: Outcomes) -> list[str]:
    """What goes wrong with cases; the folder of each of these is kept, and outcomes are counted."""
    folder.mkdir()
    found = []
    with Worker(trial, warm_up(kit, folder)) as worker:
        for one in tried:
            place = folder / f"case-{one.number}"
            lay_out(kit, one, place)
            fault = worker((one.arguments, str(place)), one.seconds)
            status = "" if fault else (place / STATUS).read_text()
            if not one.changes and status not in ("0", "1"):
                fault = fault or f"status {status} of a line that is right"
            if fault is None:
                command = next((word for word in one.arguments if word in grammar()), "none")
                outcomes[command, status] += 1
                shutil.rmtree(place)
                continue
            alone = f"{sys.executable} -m tests.robustness {one.number}"
            found.append(f"{one}\nkept in {place}; alone: {alone}\n{fault}")
            if len(found) == ENOUGH:
                break
    return found


def idle(outcomes: Outcomes) -> list[str]:
    """Commands most of whose cases end as wrong usage, or none of whose cases gives a result."""
    return [
        name
        for name in grammar()
        if 2 * outcomes[name, "2"] > sum(outcomes[name, str(status)] for status in STATUSES)
        or not outcomes[name, "0"] + outcomes[name, "1"]
    ]


def table(outcomes: Outcomes) -> Iterator[str]:
    yield f"{'cases by status':<16}" + "".join(f"{status:>7}" for status in STATUSES)
    for name in sorted({name for name, _ in outcomes}):
        counts = (outcomes[name, str(status)] for status in STATUSES)
        yield f"{name:<16}" + "".join(f"{count:>7}" for count in counts)


def test_every_command_and_option_comes_up() -> None:
    """As the parser lists them; a new command needs a recipe, a new option nothing."""
    assert {shlex.split(recipe)[0] for recipe in RECIPES} == set(grammar())
    tried = {name: set[str]() for name in grammar()}
    for number in range(4000):
        command, *rest = drawn(Random(number))
        tried[command].update(text.partition("=")[0] for text in rest)
    missing = [
        f"{command} {action.option_strings[-1]}"
        for command, actions in grammar().items()
        for action in actions
        if action.option_strings and not tried[command].intersection(action.option_strings)
    ]
    assert not missing


def nothing(folder: Path) -> None:
    """What a command does that does nothing."""


def leave_behind(folder: Path) -> None:
    (folder / "folder" / "rest.tmp").touch()


def write_outside(folder: Path) -> None:
    (folder.parent / "intruder").touch()


@pytest.mark.parametrize(
    ("status", "out", "err", "done", "told"),
    [
        (1, "", "Traceback (most recent call last):\n", nothing, "a traceback"),
        (3, "", "small.yaml:1:1: is wrong\n", nothing, "not in the stated form"),
        (3, "", "small.yaml:1:1: is \x1b[31mwrong; mend it\n", nothing, "control characters"),
        (0, "", "", nothing, "nothing is said or done"),
        (0, "well\n", "", leave_behind, "rest.tmp has been left behind"),
        (0, "well\n", "", write_outside, "intruder"),
    ],
)
def test_what_is_wrong_is_noticed(
    kit: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    status: int,
    out: str,
    err: str,
    done: Callable[[Path], None],
    told: str,
) -> None:
    def pretended(arguments: Sequence[str], folder: Path) -> tuple[int, str, str]:
        done(folder)
        return status, out, err

    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(cases, "outcome", pretended)
    lay_out(kit, Case(0, (), ()), tmp_path / "case")
    found = trial((("check", "small.yaml"), str(tmp_path / "case")))
    assert found is not None and told in found


def odd(what: str) -> None:
    """Something that takes no end, or too much memory, or ends the process."""
    if what == "die":
        os._exit(1)
    while what == "spin":
        pass
    assert len(bytes(2**31)) == 2**31


def test_bounds_of_time_and_memory_hold() -> None:
    told = {"spin": "more than 0.5 s of processor time", "die": "the process has died"}
    if sys.platform == "linux":
        told["fill"] = "MemoryError"
    with Worker(odd, [], seconds=0.5) as worker:
        # The next is tried all the same.
        for what in (*told, "spin"):
            assert told[what] in (worker(what) or "")


def test_some_cases(kit: Path, tmp_path: Path, record_property: Callable[..., None]) -> None:
    """Every other recipe with a change."""
    outcomes = Outcomes()
    found = faults(kit, tmp_path / "cases", (case(kit, number) for number in FEW), outcomes)
    assert not found, "\n\n".join(found)
    record_property("report", "\n".join(table(outcomes)))


@pytest.mark.long
def test_every_recipe_gives_a_result(kit: Path, tmp_path: Path) -> None:
    outcomes = Outcomes()
    tried = [Case(-k, tuple(quick(shlex.split(line))), ()) for k, line in enumerate(RECIPES, 1)]
    found = faults(kit, tmp_path / "cases", tried, outcomes)
    assert not found, "\n\n".join(found)
    assert not idle(outcomes), "\n".join(table(outcomes))


@pytest.mark.slow
@pytest.mark.long
def test_many_cases(kit: Path, tmp_path: Path, record_property: Callable[..., None]) -> None:
    outcomes = [Outcomes(), Outcomes()]

    def part(k: int) -> list[str]:
        tried = (case(kit, number) for number in MANY[k::2])
        return faults(kit, tmp_path / f"cases-{k}", tried, outcomes[k])

    with ThreadPoolExecutor(2) as pool:
        found = [one for half in pool.map(part, range(2)) for one in half]
    lines = "\n".join(table(outcomes[0] + outcomes[1]))
    record_property("report", lines)
    assert not found, "\n\n".join(found)
    assert not idle(outcomes[0] + outcomes[1]), lines
