"""Changes of meaning that the tests have to notice: those that are known, and the score of random
ones.
"""

from __future__ import annotations

import ast
import os
from pathlib import Path

import pytest

from tests.mutation.mutants import KINDS, mutants, mutated
from tests.mutation.score import ROOMS, Outcome, passes, scored, summary
from tests.reference.package_copies import package_copy

SOURCE = """
def share(values: list[float], limit: float) -> float:
    if limit > 0.0 and values:
        return 2.0 * max(values) - limit
    return 0.0
"""
SECONDS = float(os.environ.get("BALLPLATE_MUTATION_SECONDS", "1200"))
COUNT = int(os.environ.get("BALLPLATE_MUTANTS", "3"))


def test_each_change_is_one_change(tmp_path: Path) -> None:
    path = tmp_path / "source.py"
    path.write_text(SOURCE, encoding="utf-8")
    every = mutants(path, "source.py")
    assert {one.kind for one in every} == set(KINDS)
    texts = [mutated(path, one) for one in every]
    assert len(set(texts)) == len(texts) and ast.unparse(ast.parse(SOURCE)) not in texts
    wanted = ("limit <= 0.0", "or values", "min(values)", "+ limit", "return max(values)")
    for text in wanted:
        assert sum(text in one for one in texts) == 1, text


def test_a_summary_names_what_was_not_noticed() -> None:
    outcomes = [Outcome("rank", "a.py:1: sum 3", "noticed", 1.0)]
    outcomes.append(Outcome("rank", "a.py:2: sum 9", "survived", 2.0))
    assert summary(outcomes) == [
        "rank: 1 of 2 noticed, 0 took too long",
        "  survived: a.py:2: sum 9",
        "all rooms: 1 of 2 noticed",
    ]


@pytest.mark.long
def test_the_score_of_random_changes(tmp_path: Path) -> None:
    """The score by room of three mutants each, or as many as BALLPLATE_MUTANTS says, in twenty
    minutes or BALLPLATE_MUTATION_SECONDS.
    """
    copy = tmp_path / "copy"
    package_copy(copy)
    assert passes("rank", copy), "without a change the tests have to pass"
    outcomes = scored(list(ROOMS), COUNT, tmp_path / "mutants.jsonl", copy, SECONDS)
    print("\n".join(summary(outcomes)))
    assert outcomes
    noticed = sum(one.ended == "noticed" for one in outcomes)
    # What is left are figures that another test would notice, and changes without any effect.
    assert 2 * noticed > len(outcomes)
