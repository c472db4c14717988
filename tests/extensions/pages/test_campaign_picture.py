"""The picture of a planned campaign."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.campaign.campaign_picture import draw_curve
from ballplate.extensions.planning.constraints import Budget, Spent, with_chosen
from ballplate.extensions.planning.schedule import run_sheet
from ballplate.extensions.planning.selection import Campaign, CurvePoint, Gain
from ballplate.results.prediction import predict
from ballplate.simulator.experiment.loading import load

pytest.importorskip("matplotlib", reason="pictures need matplotlib")


@pytest.fixture(scope="module")
def found() -> Campaign:
    """A campaign with figures that were not searched for, so that drawing it takes no search."""
    (experiment,) = load("designs/planning/campaign.yaml", planning=True)
    pool = experiment.pool
    assert pool is not None
    by_name = {one.name: one for one in pool.candidates}
    chosen = tuple(pool.candidates[k] for k in (0, 1, 5, 30, 55))
    values = (math.inf, 9e-7, 8e-7, 7e-7, 6.5e-7)
    gains = tuple(Gain(one, value, 6e-7) for one, value in zip(chosen, values, strict=True))
    left_out = (Gain(by_name["better sides"], 6e-7, 5e-7),)
    curve = tuple(
        CurvePoint(
            Budget(3600.0 * hours), Spent(3500.0 * hours, 50, 2), chosen, 2.4e-6 / hours, bound
        )
        for hours, bound in ((2.0, 6e-7), (4.0, 4e-7), (6.0, math.nan))
    )
    return Campaign(
        experiment, pool, "U6", "m", 0, Budget(4 * 3600.0), chosen, (), Spent(14000.0, 175, 5), 6e-7, 4e-7, 1.2e-6,
        "as drawn", Spent(4440.0, 75, 2), 5.7e-6, gains, left_out, predict(with_chosen(experiment, chosen)),
        run_sheet(chosen, pool.changes), curve,
    )  # fmt: skip


def texts(campaign: Campaign, folder: Path) -> list[str]:
    """The letters of a picture, which matplotlib tells in comments of a drawing whose letters are
    outlines.
    """
    path = folder / "picture.svg"
    draw_curve(campaign, path)
    return re.findall(r"<!-- (.*?) -->", path.read_text(encoding="utf-8"))


def test_a_picture_with_a_curve_has_all_that_is_compared(found: Campaign) -> None:
    """In hours, and in micrometres."""
    (axes,) = draw_curve(found).axes
    lines = {str(line.get_label()): np.array(line.get_ydata(), float) for line in axes.lines}
    wanted = {"best choice found": [1.2, 0.6, 0.4], "bound of any choice": [0.6, 0.4, math.nan]}
    wanted |= {"as drawn": [1.2, 1.2], "target": [5.7, 5.7]}
    assert set(lines) == set(wanted)
    for name, y in wanted.items():
        np.testing.assert_allclose(lines[name], y)
    assert list(axes.lines[0].get_xdata()) == [2.0, 4.0, 6.0] and axes.get_ylim()[0] == 0.0
    assert axes.get_xlabel() == "hours allowed"


def test_without_a_curve_the_positions_are_drawn(found: Campaign, tmp_path: Path) -> None:
    replace(found, curve=()).plot(tmp_path / "picture.svg")
    text = (tmp_path / "picture.svg").read_text(encoding="utf-8")
    found.prediction.plot(tmp_path / "design.svg")
    assert text == (tmp_path / "design.svg").read_text(encoding="utf-8")


def test_what_is_undetermined_or_missing_is_not_drawn(found: Campaign, tmp_path: Path) -> None:
    assert "as drawn" not in texts(replace(found, drawn=math.inf), tmp_path)
    bare = replace(found, drawn=None, drawn_spent=None, target=None)
    assert not {"as drawn", "target"} & set(texts(bare, tmp_path))


def test_a_ratio_has_no_unit(found: Campaign, tmp_path: Path) -> None:
    ratio = replace(found, criterion="condition", unit="1", drawn=900.0, target=None)
    assert not any("µm" in text for text in texts(ratio, tmp_path))
    (line,) = (one for one in draw_curve(ratio).axes[0].lines if one.get_label() == "as drawn")
    assert set(np.array(line.get_ydata())) == {900.0}
