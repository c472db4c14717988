"""Whatever command lines, files and stores say, there is a result or what is wrong, soon and in bounded memory.

`cases` says what is tried, and how to try one case alone.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random

import pytest

from tests.robustness.cases import case, lay_out, trial, warm_up
from tests.robustness.command_lines import drawn, grammar
from tests.robustness.kit import make_kit
from tests.robustness.recipes import RECIPES
from tests.robustness.worker import Worker

# Where a test ends, as the next may fail for the same reason.
ENOUGH = 10
FEW, MANY = range(500), range(20_000)


@pytest.fixture(scope="module")
def kit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("kit")
    make_kit(folder)
    return folder


def faults(kit: Path, folder: Path, numbers: Iterable[int]) -> list[str]:
    """What goes wrong with cases; the folder of each of these is kept."""
    folder.mkdir()
    found = []
    with Worker(trial, warm_up(kit, folder)) as worker:
        for number in numbers:
            one = case(kit, number)
            place = folder / f"case-{number}"
            lay_out(kit, one, place)
            fault = worker((one.arguments, str(place)), one.seconds)
            if fault is None:
                shutil.rmtree(place)
                continue
            alone = f"{sys.executable} -m tests.robustness {number}"
            found.append(f"{one}\nkept in {place}; alone: {alone}\n{fault}")
            if len(found) == ENOUGH:
                break
    return found


def test_every_command_and_option_comes_up(kit: Path) -> None:
    """As the parser lists them; a new command needs a recipe, a new option nothing."""
    assert {recipe.split()[0] for recipe in RECIPES} == set(grammar())
    assert {case(kit, number).arguments[0] for number in range(len(RECIPES))} >= set(grammar())
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


def test_the_same_number_is_the_same_case(kit: Path, tmp_path: Path) -> None:
    make_kit(tmp_path)
    assert all(case(kit, number) == case(tmp_path, number) for number in range(0, FEW.stop, 3))


def test_some_cases(kit: Path, tmp_path: Path) -> None:
    found = faults(kit, tmp_path / "cases", FEW)
    assert not found, "\n\n".join(found)


@pytest.mark.slow
@pytest.mark.long
def test_many_cases(kit: Path, tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as pool:
        parts = pool.map(lambda k: faults(kit, tmp_path / f"cases-{k}", MANY[k::2]), range(2))
        found = [one for part in parts for one in part]
    assert not found, "\n\n".join(found)
