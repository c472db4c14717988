"""How often a fit names the right cause, a wrong one, or says that it is the model, and the table
that tells so.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest
from scipy.stats import binom

from tests.extensions.diagnosis.naming import (
    MISTAKES,
    MODEL_ERRORS,
    OUTCOMES,
    World,
    counts,
)

PAGE = Path("docs/reference/validation.md")


@cache
def world() -> World:
    return World()


def table() -> dict[str, dict[str, float]]:
    """Shares by kind and outcome as the page has them, in per cent."""
    page = PAGE.read_text(encoding="utf-8").replace("| – |", "| 0.0 |")
    rows = re.findall(r"^\| ([^|]+?) \|" + r" ([\d.]+) \|" * 4 + "$", page, re.MULTILINE)
    return {kind: dict(zip(OUTCOMES, map(float, shares), strict=True)) for kind, *shares in rows}


def sets() -> int:
    """Data sets of each kind, as the page says."""
    found = re.search(r"naming --sets (\d+)", PAGE.read_text(encoding="utf-8"))
    assert found is not None
    return int(found[1])


def test_the_table_has_every_kind_and_keeps_the_limits() -> None:
    shown = table()
    assert set(shown) == {"nothing wrong", *MODEL_ERRORS, *MISTAKES}
    assert all(abs(sum(shares.values()) - 100.0) < 0.3 for shares in shown.values())
    assert all(shares["wrong"] < 5.0 for shares in shown.values())
    assert all(shown[kind]["right"] >= 80.0 for kind in MISTAKES)


@pytest.mark.parametrize("kind", [*MODEL_ERRORS, *MISTAKES])
def test_one_data_set_of_each_kind(kind: str) -> None:
    (found,) = counts(world(), kind, 1)
    assert found in (("model", "nothing") if kind in MODEL_ERRORS else ("right", "model"))


@pytest.mark.long
@pytest.mark.parametrize("kind", ["nothing wrong", *MODEL_ERRORS, *MISTAKES])
def test_the_rates_are_those_of_the_table(kind: str) -> None:
    """Verdicts at the limits may change with the rounding of another processor."""
    found, shown = counts(world(), kind, sets()), table()[kind]
    for name in OUTCOMES:
        assert abs(100 * found[name] / sets() - shown[name]) <= 1.0, (kind, name)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["a reading", "a certified distance", "expansion in a position"])
def test_mistakes_of_the_size_by_fit_are_found_four_times_of_five(kind: str) -> None:
    """Something is told of them, though not always their cause."""
    found = counts(World(times=1.0), kind, 100)
    assert binom.cdf(100 - found["nothing"], 100, 0.8) > 1e-3
    assert found["right"] > 60
