"""Changes of meaning that the tests have to notice: those that are known, and the score of random
ones.
"""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.extensions.diagnosis import wording
from ballplate.simulator.design.observations import calibration
from ballplate.simulator.experiment import calibrations

from tests.mutation.forks import change, in_fork, probed
from tests.mutation.mutants import KINDS, mutants, mutated, source_of
from tests.mutation.score import Outcome, summary
from tests.reference.installed_extension import TOP

SOURCE = """
LIMIT = 3.0 * 2

def share(values: list[float], limit: float) -> float:
    if limit > 0.0 and values:
        return 2.0 * max(values) - limit
    return 0.0
"""
COUNT = os.environ.get("BALLPLATE_MUTANTS", "3")


def test_each_change_is_one_change(tmp_path: Path) -> None:
    path = tmp_path / "source.py"
    path.write_text(SOURCE, encoding="utf-8")
    every = mutants(path, "source.py")
    assert {one.kind for one in every} == set(KINDS)
    assert {one.setting for one in every} == {"", "LIMIT"}
    texts = [mutated(path, one) for one in every]
    assert len(set(texts)) == len(texts) and ast.unparse(ast.parse(SOURCE)) not in texts
    wanted = (
        "limit <= 0.0",
        "or values",
        "min(values)",
        "+ limit",
        "return max(values)",
        "LIMIT = 6.0 * 2",
    )
    for text in wanted:
        assert sum(text in one for one in texts) == 1, text


def test_a_summary_names_what_was_not_noticed() -> None:
    outcomes = [Outcome("rank", "a.py:1: sum 3", "noticed", 1.0, "test_a")]
    outcomes.append(Outcome("rank", "a.py:2: sum 9", "survived", 2.0))
    outcomes.append(Outcome("rank", "a.py:7: sum 9", "unreached", 0.0))
    outcomes.append(Outcome("extensions/ci", "b.py:1: sum 3", "too long", 9.0))
    of_rank = "1 of 3 noticed, 0 of them since tests took too long, 1 not reached"
    of_ci = "1 of 1 noticed, 1 of them since tests took too long, 0 not reached"
    assert summary(outcomes) == [
        f"rank: {of_rank}",
        "  survived: a.py:2: sum 9",
        "  unreached: a.py:7: sum 9",
        f"extensions/ci: {of_ci}",
        "  too long: b.py:1: sum 3",
        f"kernel: {of_rank}",
        f"extensions: {of_ci}",
        "all rooms: 2 of 4 noticed, 1 of them since tests took too long, 1 not reached",
    ]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs os.fork, which is missing here")
def test_a_change_is_made_in_a_fork_only() -> None:
    """Also where another module imported the function by name before."""
    name = "simulator/inputs/settings.py"
    of_last = [one for one in mutants(source_of(name), name) if one.kind == "comparison"][-1]

    def changed() -> str:
        change(of_last)
        return wording.listed(["a", "b"])

    assert in_fork(changed, 60.0) == "a"
    assert wording.listed(["a", "b"]) == "a and b"
    assert in_fork(lambda: 1 / 0, 60.0) is None


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs os.fork, which is missing here")
def test_a_setting_is_changed_where_it_is_imported() -> None:
    """Its uses there are places where a test reaches it."""
    name = "simulator/design/observations/calibration.py"
    every = [one for one in mutants(source_of(name), name) if one.setting == "FAR_FROM_DRAWING"]

    def changed() -> list[float]:
        change(every[0])
        return [calibration.FAR_FROM_DRAWING, calibrations.FAR_FROM_DRAWING]

    assert len(every) == 1
    assert in_fork(changed, 60.0) == [2.0 * calibration.FAR_FROM_DRAWING] * 2

    def reached() -> list[int]:
        places = probed(every)
        bp.check(bp.quickstart())
        before = len(places)
        bp.load(TOP / "designs" / "hurt_foss" / "bryan-gauge.yaml", variant="radius known")
        return [before, len(places)]

    assert in_fork(reached, 120.0) == [0, 1]


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs os.fork, which is missing here")
def test_the_score_of_random_changes(tmp_path: Path) -> None:
    """The score by room of three mutants each, or as many as BALLPLATE_MUTANTS states, among the
    tests of two rooms, or all with BALLPLATE_MUTATION_TESTS=tests.
    """
    tests = os.environ.get("BALLPLATE_MUTATION_TESTS", "tests/estimation tests/analysis").split()
    line = [sys.executable, "-m", "tests.mutation", "--count", COUNT, "--seconds", "1800"]
    line += ["--store", str(tmp_path / "mutants.jsonl"), "--tests", *tests]
    done = subprocess.run(line, cwd=TOP, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    print(done.stdout)
    ended = re.search(r"all rooms: (\d+) of (\d+) noticed", done.stdout)
    assert ended is not None
    # What is left are figures that a slower test would notice, and changes without any effect.
    assert 4 * int(ended[1]) > 3 * int(ended[2]) > 0
