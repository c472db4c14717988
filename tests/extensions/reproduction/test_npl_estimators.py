"""NPL Report CISE 15/98, section 6.2.7: the distances-only estimator against the full one, over 100
data sets.

The report gives one data set's differences for each plate. It does not say whether distances
between balls read with different probes in the same position were used. With them the report's root
mean square and maximum stand above 87 and 79 % of the data sets with 5 x 5 balls, and above 9 and
61 % with 7 x 7. Without them the root mean squares stand above 11 and 1 %, and the maxima above a
tenth and fewer than 5 %: most data sets differ by more than the report's.
"""

from __future__ import annotations

import statistics
from pathlib import Path
from typing import Any

import pytest
from ballplate.extensions.estimators import compare_estimators
from ballplate.extensions.reproduction import compare
from ballplate.extensions.reproduction.published import npl
from ballplate.extensions.reproduction.shipped import Shipped


@pytest.mark.parametrize(
    ("difference", "trials"),
    [
        (npl().differences[0], 30),
        *(pytest.param(one, 100, marks=pytest.mark.long) for one in npl().differences),
    ],
    ids=lambda value: getattr(value, "design", value),
)
def test_the_reports_differences_lie_in_the_distribution(  # type: ignore[no-untyped-def]
    difference, trials: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []

    def estimated(*arguments: Any, **options: Any) -> Any:
        made.append(compare_estimators(*arguments, **options))
        return made[-1]

    monkeypatch.setattr(compare, "compare_estimators", estimated)
    found = compare.compare_difference(
        npl(), Shipped(Path("designs/npl")), difference, trials, lambda *_: None
    )
    assert len(found) == 5 and all(row.agrees for row in found), found
    assert [row.computed for row in found] == [
        0,
        statistics.median(made[0].rms),
        sum(one < difference.rms for one in made[0].rms) / trials,
        statistics.median(made[0].maximum),
        sum(one < difference.maximum for one in made[0].maximum) / trials,
    ]
    # The published one is neither the least nor the largest.
    assert found[1].within == found[3].within == (1 / npl().limits.median, npl().limits.median)
    assert found[2].within == found[4].within == pytest.approx((1 / trials, 1 - 1 / trials))
