"""Each option of each command does what it promises: with it, the outcome of a small command has
something that it has not without it.
"""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest

from tests.cli.option_table import READING, TABLE, TABLES
from tests.cli.outcomes import are_alike, changes, kept
from tests.cli.shown import filled, lines_of, written
from tests.cli.walk import WALK, commands

# Progress bars are all that they print beside their results, and only on a terminal.
SILENT = (
    *("check", "compare", "correct", "diff", "map", "map --curves", "part", "reach", "reproduce"),
    *("run", "run --errors", "run --reliability", "schema", "spline", "studio"),
    *("sweep", "sweep --export", "sweep --report"),
)
# Shown by other tests, as the page and what needs files of its own; or what no small command shows: a
# search ends alike from any seed.
ELSEWHERE = {
    "studio --variant",
    "studio --port",
    "studio --no-browser",
    "studio --verbose",
    "sweep --scheduler",
    "sweep --folder",
    "check --no-modules",
    *(f"import --{name}" for name in ("unit", "circles", "uncertainty")),
    "plan --seed",
    *(f"{name} --workers" for name in ("run", "plan", "sweep")),
}


@pytest.fixture(scope="module")
def kit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return filled(tmp_path_factory.mktemp("options") / "kit")


def options() -> Iterator[tuple[str, argparse.Action]]:
    """Each option of each command, other than help."""
    for name, command in commands().items():
        for action in command._actions:
            if action.option_strings and action.dest != "help":
                yield name, action


# A line of each command in the table, of a file without variants, and the commands that write data
# in JSON.
FIRST = {
    shlex.split(line)[0]: line
    for line, *_ in reversed(TABLE)
    if not {"pair.yaml", "twice.yaml"} & {*line.split()}
}
FIRST |= {
    "run --errors": "'run --errors' plate.yaml",
    "reach": "reach plate.yaml --by repeatability",
}
FIRST["compare"] = "compare plate.yaml --trials 2"
AS_DATA = [name for name, action in options() if "--json" in action.option_strings]
LATER = pytest.mark.long
ALL: list[Any] = [
    *TABLE,
    *((FIRST[name], "--json", '{\n  "') for name in AS_DATA),
    # The commands take tables of readings in the same way.
    *(
        pytest.param(f"{name} plate.yaml {file}", option, text, marks=[LATER] * (name != "fit"))
        for name, text in READING.items()
        for file, option in TABLES
    ),
    *(
        (f"{name} plate.yaml unitless.csv --unit mm", "--quiet", "without: unitless.csv: read as")
        for name in READING
    ),
    *((f"{name} pair.yaml plate.csv", "--variant coarse", text) for name, text in READING.items()),
    *(
        pytest.param(line, "--verbose", "\nnumpy ", marks=[LATER] * (name not in ("check", "map")))
        for name, line in FIRST.items()
        if name != "schema"
    ),
]

# Lines alone whose outcomes are kept.
WITH_OPTIONS = {getattr(row, "values", row)[0] for row in ALL}
KEPT = [line for line in kept() if "  with  " not in line and line not in WITH_OPTIONS]


def outcomes(line: str, option: str, kit: Path) -> dict[str, list[str]]:
    """What is kept of a line, and of the line with an option."""
    if "--verbose" in option:
        return {}
    without = lines_of(line, kit)
    added = changes(without, lines_of(f"{line} {option}", kit))
    return {line: without, f"{line}  with  {option}": added}


def every_outcome(kit: Path) -> dict[str, list[str]]:
    return {line: lines_of(line, kit) for line in KEPT} | {
        name: lines
        for line, option, _ in (getattr(row, "values", row) for row in ALL)
        for name, lines in outcomes(line, option, kit).items()
    }


@pytest.mark.parametrize(("line", "option", "text"), ALL)
def test_option(line: str, option: str, text: str, kit: Path) -> None:
    without, with_it = written(line, kit), written(f"{line} {option}", kit)
    if text.startswith("without: "):
        with_it, without = without, with_it
        text = text.removeprefix("without: ")
    assert text in with_it and text not in without
    # A change of any other line is one that someone saw.
    for name, lines in outcomes(line, option, kit).items():
        ensure_kept(name, lines)


def ensure_kept(name: str, lines: list[str]) -> None:
    for found, was in zip_longest(lines, kept()[name], fillvalue=""):
        assert are_alike(found, was), name


@pytest.mark.parametrize("line", KEPT)
def test_recipe(line: str, kit: Path) -> None:
    ensure_kept(line, lines_of(line, kit))


def test_every_option_is_in_the_table() -> None:
    rows = [getattr(row, "values", row) for row in ALL]
    stated = {(shlex.split(line)[0], shlex.split(option)[0]) for line, option, _ in rows}
    missing = [
        f"{name} {action.option_strings[-1]}"
        for name, action in options()
        if not any((name, form) in stated for form in action.option_strings)
    ]
    silent = {f"{name} --quiet" for name in SILENT}
    # Whatever is written, it is by the same function, and tested beside it.
    force = {f"{name} --force" for name, walk in WALK.items() if walk.writes}
    assert sorted(missing) == sorted(silent | force | ELSEWHERE)
