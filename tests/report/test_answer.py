"""What the page of a sweep answers first, from stores whose figures are made up."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from ballplate.report.answer import answer
from ballplate.report.heatmaps import BLANK, DEFICIENT, heat_maps
from ballplate.report.results import ReportedSweep, read_results
from ballplate.report.series import plots
from ballplate.report.store_comparison import IncomparableError, compared

from tests.report.stores import axis, done, made_up

SIZES, BALLS, MODELS = (300.0, 400.0, 500.0), (4.0, 6.0), ("metric", "kinematic")


def average(size: float, balls: float, model: str) -> float:
    """An average uncertainty in metres: larger plates and more balls have less."""
    return 1e-6 * (300.0 / size) ** 2 * (4.0 / balls) * (2.0 if model == "kinematic" else 1.0)


def sweep(
    folder: Path, limit: float = 0.5e-6, worse: float = 1.0, open_: tuple[int, ...] = (), axes=None
) -> ReportedSweep:
    """A sweep over size, balls and model of which settings below a limit meet the target."""
    listed = axes or [
        axis("size", [f"{one:.0f} mm" for one in SIZES], [one / 1e3 for one in SIZES], "m"),
        axis("balls", [f"{one:.0f}" for one in BALLS], list(BALLS), "1"),
        axis("model", list(MODELS), [], ""),
    ]

    def rows():
        for k, setting in enumerate(itertools.product(SIZES, BALLS, MODELS)):
            size = worse * average(*setting)
            is_open = k in open_
            yield done(
                k,
                {
                    "U6_average_m": size,
                    "U6_maximum_m": 2 * size,
                    "U6_undetermined": 7.0 if is_open else 0.0,
                    "U6_within_target": 0.4 if is_open or size > limit else 1.0,
                    "rank_deficiency": 1.0 if is_open else 0.0,
                    "observations": 100.0 * setting[1],
                    "as_expected": 1.0,
                },
            )

    store = made_up(folder / "made-up.sqlite", "made up", listed, rows())
    return read_results(store, 1)


def test_settings_within_the_target_are_counted_and_the_cheapest_named(tmp_path: Path) -> None:
    found = answer(sweep(tmp_path))
    meeting = [one for one in itertools.product(SIZES, BALLS, MODELS) if average(*one) <= 0.5e-6]
    assert found.sentences[0].startswith(f"{len(meeting)} of 12 settings meet")
    # Of the fewest balls the smallest average.
    size, balls, model = min(meeting, key=lambda one: (one[1], average(*one)))
    assert f"size {size:.0f} mm, balls {balls:.0f}, model {model}: 400 obs" in found.sentences[1]
    first = found.settings.blocks[0].rows[0]
    assert first.headings == (f"{size:.0f} mm", f"{balls:.0f}", model)


def test_none_that_meets_the_target_is_said_with_the_nearest(tmp_path: Path) -> None:
    found = answer(sweep(tmp_path, limit=0.0))
    assert found.sentences[0].startswith("None of the 12 settings meets")
    assert "size 500 mm, balls 6, model metric, with 40 %" in found.sentences[0]


def test_what_is_undetermined_never_meets_the_target(tmp_path: Path) -> None:
    """The setting of the smallest average leaves lengths undetermined."""
    best = 2 * 2 * 2 + 2
    found = answer(sweep(tmp_path, open_=(best,)))
    assert "1 of 12 settings leave something undetermined." in found.sentences
    rows = [one.headings for one in found.settings.blocks[0].rows]
    assert ("500 mm", "6", "metric") not in rows[: int(found.sentences[0].split()[0])]


def test_the_worth_of_an_axis_is_that_of_single_settings(tmp_path: Path) -> None:
    size, balls, model = answer(sweep(tmp_path)).worth
    assert (size.low, size.high, size.settings) == (pytest.approx(0.36), pytest.approx(0.36), 4)
    assert size.ends == ("300 mm", "500 mm")
    assert balls.low == pytest.approx(4 / 6) and balls.settings == 6
    assert model.ends is None and model.high == pytest.approx(2.0)


def test_lines_are_of_single_cells_with_a_second_axis(tmp_path: Path) -> None:
    results = sweep(tmp_path)
    for plot in plots(results):
        for panel in plot.panels:
            for line in panel.lines:
                factor = {"average": 1.0, "maximum": 2.0}[panel.measure.statistic]
                every = {
                    factor * 1e6 * average(*one) for one in itertools.product(SIZES, BALLS, MODELS)
                }
                assert all(np.isclose(y, list(every)).any() for y in line.y)


def test_cells_that_leave_something_undetermined_are_hatched(tmp_path: Path) -> None:
    results = sweep(tmp_path, open_=(0,))
    (heat,) = [
        one for one in heat_maps(results) if (one.rows.name, one.columns.name) == ("size", "balls")
    ]
    assert heat.shades[0][0] == DEFICIENT and "Hatched" in heat.note
    assert "model metric, as in the best cell" in heat.note
    flat = [shade for line in heat.shades for shade in line]
    assert flat.count(DEFICIENT) == 1 and BLANK not in flat
    expected = [[1e6 * average(size, balls, "metric") for balls in BALLS] for size in SIZES]
    shown = [[1e6 * entry.value for entry in line] for line in heat.entries]
    assert np.allclose(shown, expected)


def test_the_same_settings_of_two_stores_are_compared(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    here, there = sweep(tmp_path / "a"), sweep(tmp_path / "b", worse=1.25, open_=(5,))
    found = compared(here, there, "b.sqlite")
    assert found.sentences[0].startswith("12 settings are done in both; 0 in this store alone")
    assert "smaller than in b.sqlite in 11 of them, by a factor of 0.800." in found.sentences[1]
    assert (
        "0 settings are rank-deficient only in this store, 1 only in b.sqlite." in found.sentences
    )
    same = compared(here, here, "a.sqlite")
    assert same.sentences[1:] == ("All averages are the same.",) and same.settings is None


def test_sweeps_over_other_axes_are_not_compared(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    other = [
        axis("edge", [f"{one:.0f} mm" for one in SIZES], [one / 1e3 for one in SIZES], "m"),
        axis("balls", [f"{one:.0f}" for one in BALLS], list(BALLS), "1"),
        axis("model", list(MODELS), [], ""),
    ]
    with pytest.raises(IncomparableError, match="swept over balls, edge, model and"):
        compared(sweep(tmp_path / "a"), sweep(tmp_path / "b", axes=other), "b.sqlite")
