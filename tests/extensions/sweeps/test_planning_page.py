"""What the page of a sweep says of hours, axes and designs, against enumerations."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.sweeps.answer import answer
from ballplate.extensions.sweeps.axis_effects import effects, frontier
from ballplate.extensions.sweeps.result import SweepResult

from tests.extensions.sweeps.stores import Page, axis, done, failed, made_up_result
from tests.extensions.sweeps.test_page import assert_accessible, cells_of

HOURS, SIZES, PROBES = (4.0, 8.0, 12.0), (0.4, 0.2, 0.3), ("down", "a star of five styli")
FAILED, MISSING, OPEN = 5, 7, 10


def drawing(count: int) -> str:
    """A design with plates at some levels."""
    corners = np.array([[0.1, 0.1], [0.1, 0.6], [0.6, 0.6], [0.6, 0.1]])
    plates = [
        [f"level <{k}>", np.insert(corners, 2, 0.1 * (k + 1), axis=1).tolist()]
        for k in range(count)
    ]
    return json.dumps({"volume": [[0.0, 1.0]] * 3, "positions": plates})


def planned(path: Path, limit: float = 1.0e-6, seed: int = 0) -> SweepResult:
    """A sweep over hours, size and probe with random averages: one case failed, one is missing, one
    undetermined. Rows are out of order.
    """
    draw = np.random.default_rng(seed)
    axes = [
        axis("hours limit", [f"{one:g}" for one in HOURS], HOURS, "h"),
        axis("size", [f"{1e3 * one:.0f} mm" for one in SIZES], SIZES, "m"),
        axis("probe", PROBES),
    ]
    rows, costs = [], {}
    for cell, (hours, _, _) in enumerate(product(HOURS, SIZES, PROBES)):
        value = np.nan if cell == OPEN else 1e-6 * draw.integers(5, 15) / 10
        figures = {"U6_average_m": value, "U6_undetermined": 3.0 * (cell == OPEN)}
        figures |= {"U6_within_target": 1.0 if value <= limit else 0.4, "observations": 90.0 - cell}
        if cell != MISSING:
            row = done(cell, figures | {"rank_deficiency": float(cell == OPEN)})
            rows.append(failed(cell, "outside") if cell == FAILED else row)
        costs[cell] = hours - draw.integers(0, 3) / 10, drawing(int(hours // 4))
    result = made_up_result(path, "plans", axes, rows)
    table = result.table.sample(frac=1.0, random_state=seed).reset_index(drop=True)
    is_done = table["status"] == "done"
    table["hours"] = [costs[cell][0] for cell in table["cell"]]
    table["drawing"] = [costs[cell][1] for cell in table["cell"]]
    table.loc[~is_done, ["hours", "drawing"]] = [np.nan, ""]
    return replace(result, table=table)


@pytest.mark.parametrize("seed", range(4))
def test_effects_of_axes_and_frontier_are_those_of_an_enumeration(
    tmp_path: Path, seed: int
) -> None:
    result = planned(tmp_path / "s.sqlite", seed=seed)
    value, hours = result.figure("U6_average_m"), result.figure("hours")
    labels = [
        [one.labels[i] for i in at] for one, at in zip(result.axes, result.chosen.T, strict=True)
    ]
    for k, row in enumerate(effects(result, value)):
        groups: dict[tuple[str, ...], dict[str, float]] = {}
        for i in np.flatnonzero(np.isfinite(value)):
            others = tuple(each[i] for j, each in enumerate(labels) if j != k)
            groups.setdefault(others, {})[labels[k][i]] = round(1e7 * value[i])
        compared = [group for group in groups.values() if len(group) > 1]
        ratios = [max(group.values()) / min(group.values()) for group in compared]
        told = [float(text) for text in row[1:4]]
        assert told == pytest.approx([np.median(ratios), min(ratios), max(ratios)], rel=5e-3)
        wins = [
            sum(g.get(one) == min(g.values()) for g in compared) for one in result.axes[k].labels
        ]
        best = [
            one for one, won in zip(result.axes[k].labels, wins, strict=True) if won == max(wins)
        ]
        assert row[4] == f"{' or '.join(best)}, in {max(wins)}"
        combinations = 18 // len(result.axes[k].labels)
        whole = sum(len(group) == len(result.axes[k].labels) for group in compared)
        assert row[5:] == [f"{len(compared)} of {combinations}", str(whole)]
    cases = list(zip(hours, np.round(1e7 * value), strict=True))
    unbeaten = {
        one
        for one in cases
        if np.isfinite(one).all()
        and not any(a <= one[0] and b <= one[1] and (a, b) != one for a, b in cases)
    }
    assert [cases[i] for i in frontier(result, value)] == sorted(unbeaten)


def test_the_cheapest_case_is_that_of_known_hours(tmp_path: Path) -> None:
    result = planned(tmp_path / "s.sqlite")
    share, hours = result.figure("U6_within_target"), result.figure("hours")
    told = answer(result)
    least = hours[share == 1.0].min()
    assert told is not None and told.best[0] in told.outstanding
    assert hours[told.best[0]] == least and f"hours {least:.3f};" in told.outstanding[told.best[0]]
    assert result.lines()[2:5][0].endswith("the target uncertainty with all lengths.")
    # Hours that are unknown are no fewest ones.
    table = result.table.copy()
    table.loc[hours == least, "hours"] = np.nan
    known = answer(replace(result, table=table))
    assert known is not None and table["hours"][known.best[0]] > least
    assert "fewest known laboratory hours" in known.outstanding[known.best[0]]
    # No case that meets a target is the cheapest of them.
    none = answer(planned(tmp_path / "none.sqlite", limit=0.0))
    assert none is not None and not none.is_good
    assert not any("ewest" in text for text in none.outstanding.values())
    # An axis of an earlier store is no cost.
    old = [axis("hours", ["day", "night"]), axis("k", ["1"], [1.0], "1")]
    rows = [done(k, {"U6_average_m": 1e-6, "U6_within_target": 1.0}) for k in range(2)]
    told = answer(made_up_result(tmp_path / "old.sqlite", "old", old, rows))
    assert told is not None and "one of 2): case 0: hours day; k 1; " in told.sentences[1]


def test_dots_lead_to_designs_that_are_drawn_once(tmp_path: Path) -> None:
    result = planned(tmp_path / "s.sqlite")
    text = result.page_text()
    found = assert_accessible(text)
    dots = re.findall(r'<a (?:href="#(case-\d+)" )?tabindex="-1"><title>([^<]*)</title>', text)
    value = result.figure("U6_average_m")
    # Hours and three axes.
    assert len(dots) == 4 * np.isfinite(value).sum() and len(found.of("figure")) >= 4 + 3
    for target, words in dots:
        row = int(np.flatnonzero(result.table["cell"] == int(target.removeprefix("case-")))[0])
        chosen = zip(result.axes, result.chosen[row], strict=True)
        told = "; ".join(f"{one.name} {one.labels[k]}" for one, k in chosen)
        assert words.startswith(f"case {target[5:]}: {told}; hours ")
        assert f"U6 average {1e6 * value[row]:.3g}" in words
    ids = [one["id"] for one in found.of("p") if "id" in one]
    assert sorted(ids) == sorted(f"case-{cell}" for cell in result.table["cell"][result.done])
    assert text.count('class="design"') == 3 and "level &lt;0&gt;" in text
    shown = [row[0] for row in cells_of(text, "frontier")[1:]]
    best = [result.table["cell"][row] for row in frontier(result, value)]
    assert [re.sub("<[^>]*>", "", one) for one in shown] == [str(cell) for cell in best]
    # Hours that do not differ draw none.
    table = result.table.assign(hours=8.0)
    assert (
        "Uncertainty against hours"
        not in Page(replace(result, table=table).page_text()).texts["h2"]
    )


def test_a_sweep_as_a_data_set_is_joined_by_values(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("xarray")
    result = planned(tmp_path / "s.sqlite")
    found = result.to_xarray()
    assert found["U6_average_m"].dims == ("hours limit", "size_m", "probe")
    for cell, (hours, size, probe) in enumerate(product(HOURS, SIZES, PROBES)):
        there = found["U6_average_m"].sel({"hours limit": hours, "size_m": size, "probe": probe})
        stated = result.table.loc[result.table["cell"] == cell, "U6_average_m"]
        np.testing.assert_equal(float(there), float(stated.iloc[0]) if len(stated) else np.nan)
    empty = made_up_result(
        tmp_path / "one.sqlite", "one", [axis("k", ["1", "2"], [1.0, 2.0], "1")], [done(1, {})]
    )
    assert empty.to_xarray()["k"].values.tolist() == [1.0, 2.0]
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(ImportError, match=re.escape("install 'ballplate[xarray]'")):
        result.to_xarray()


def test_a_sweep_draws_itself_against_hours_or_its_axes(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    result = planned(tmp_path / "s.sqlite")
    (axes,) = result.plot(tmp_path / "s.svg").axes
    drawn = np.concatenate(
        [line.get_xydata() for line in axes.lines if line.get_marker() != "None"]
    )
    cases = np.stack([result.figure("hours"), 1e6 * result.figure("U6_average_m")], axis=1)
    assert sorted(drawn.tolist()) == sorted(cases[np.isfinite(cases).all(axis=1)].tolist())
    assert (tmp_path / "s.svg").exists() and axes.get_xlabel() == "laboratory time, h"
    assert len(replace(result, table=result.table.drop(columns="hours")).plot().axes) == 3
    nothing = made_up_result(
        tmp_path / "no.sqlite", "no", [axis("k", ["1", "2"], [1.0, 2.0], "1")], []
    )
    with pytest.raises(ValueError, match="has no averages to compare"):
        nothing.plot()
