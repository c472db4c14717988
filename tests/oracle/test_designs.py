"""What check and run print of designs, against the dense reference."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.oracle.campaigns import campaign_file, planned, random_file
from tests.oracle.null_words import Directions, judge, resolved, sentences
from tests.oracle.printed import agrees, output_of
from tests.oracle.uncertainties import judge_data, judge_target, judge_text

# One of full rank, which has U4 and U6, and others with plates and a bar that leave one to twelve
# directions open.
DRAWN = (0, 2, 5, 8, 18, 23)


@pytest.mark.parametrize("seed", DRAWN)
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
    told, more = sentences(text)
    assert len(told) + more == deficiency
    directions = Directions(expected)
    found = []
    for sentence in told:
        direction = resolved(directions, sentence) if sentence.is_whole else None
        if direction is not None:
            judge(directions, sentence, *direction)
            found.append(direction[0] * directions.size)
    print(f"{len(found)} of {len(told)} sentences fix a direction")
    assert 2 * len(found) >= len(told)
    if found:
        sizes = np.array([one / np.linalg.norm(one) for one in found])
        assert np.linalg.matrix_rank(sizes, 1e-4) == len(found)
    # check says the same of the rank, and U6 in words.
    checked = output_of(capsys, "check", path, status=int(deficiency > 0))
    assert [line for line in checked.splitlines() if "undetermined" in line] == [
        line for line in text.splitlines() if re.match("undetermined", line)
    ] or "all are undetermined" in checked
    together = re.search(r"U6 (\S+) µm on average, (\S+) µm at most$", checked, re.M)
    if together is not None:
        values = expected.quantities["U6"] * 1e6
        assert agrees(together[1], np.nanmean(values)) and agrees(together[2], np.nanmax(values))


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
