"""What check and run print of designs, against the dense reference."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.oracle.campaigns import Expected, campaign_file, planned, random_file
from tests.oracle.null_words import Directions, judge, resolved, sentences
from tests.oracle.possible_words import is_possible
from tests.oracle.printed import agrees, output_of
from tests.oracle.uncertainties import judge_data, judge_target, judge_text

# One of full rank, which has U4 and U6, and others with plates and a bar that leave one to fourteen
# directions open; of 30, some have parts that are too small to be printed.
DRAWN = (0, 2, 5, 8, 18, 30)
MORE = [seed for seed in range(66) if seed not in DRAWN]


@pytest.mark.parametrize("seed", [*DRAWN, *(pytest.param(k, marks=pytest.mark.long) for k in MORE)])
def test_a_drawn_design(seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = random_file(seed, tmp_path)
    expected = planned(path)
    deficiency = expected.spread.deficiency
    text = output_of(capsys, "run", path, status=int(deficiency > 0))
    judge_text(text, expected)
    rank = re.search(
        r"^(?:full rank|rank deficiency (\d+)).*; (\d+) parameters, (\d+) observations", text, re.M
    )
    assert rank is not None
    rows = expected.rows
    count = rows.shape[1], len(rows)
    assert (int(rank[1] or 0), int(rank[2])) == (deficiency, count[0])
    data = json.loads(output_of(capsys, "run", path, "--json", status=int(deficiency > 0)))
    judge_data(data["quantities"], expected)
    assert data["rank_deficiency"] == deficiency
    assert (data["parameters"], data["observations"]) == (count[0], int(rank[3]))
    judge_sentences(text, expected)
    # check says the same of the rank, and U6 in words.
    checked = output_of(capsys, "check", path, status=int(deficiency > 0))
    assert [line for line in checked.splitlines() if "undetermined" in line] == [
        line for line in text.splitlines() if re.match("undetermined", line)
    ] or "all are undetermined" in checked
    together = re.search(r"U6 (\S+) µm on average, (\S+) µm at most$", checked, re.M)
    if together is not None:
        values = expected.quantities["U6"] * 1e6
        assert agrees(together[1], np.nanmean(values)) and agrees(together[2], np.nanmax(values))


def judge_sentences(text: str, expected: Expected) -> None:
    """Each sentence on an undetermined direction is true, and none follows from others."""
    told, more = sentences(text)
    assert len(told) + more == expected.spread.deficiency
    directions, found = Directions(expected), []
    for sentence in told:
        described = resolved(directions, sentence) if sentence.is_whole else None
        if described is None:
            assert is_possible(directions, sentence), sentence
        else:
            judge(directions, sentence, described)
            change = described.direction * directions.size
            found.append(change / np.linalg.norm(change))
    assert not found or np.linalg.matrix_rank(np.array(found), 1e-4) == len(found)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_design_with_a_target(
    seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = campaign_file(seed, tmp_path)
    expected = planned(path)
    text = output_of(capsys, "run", path)
    judge_text(text, expected)
    judge_target(text, expected, 0.3e-6, 1e-6)
    judge_data(json.loads(output_of(capsys, "run", path, "--json"))["quantities"], expected)
