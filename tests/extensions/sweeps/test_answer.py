"""What the page of a sweep answers first, from stores whose figures are made up."""

from __future__ import annotations

import csv
import itertools
import re
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.sweeps.report.answer import answer
from ballplate.extensions.sweeps.report.heatmaps import BLANK, DEFICIENT, heat_maps
from ballplate.extensions.sweeps.report.results import ReportedSweep, read_results
from ballplate.extensions.sweeps.report.series import plots
from ballplate.extensions.sweeps.report.store_comparison import IncomparableError, compared
from ballplate.extensions.sweeps.store import open_store

from tests.extensions.sweeps import wording
from tests.extensions.sweeps.stores import axis, done, failed, made_up

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
            is_open = k in open_
            size = np.nan if is_open else worse * average(*setting)
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
    assert found.sentences[0].startswith(f"{len(meeting)} of 12 cases meet")
    # Of the fewest balls the smallest average.
    size, balls, model = min(meeting, key=lambda one: (one[1], average(*one)))
    assert f"size {size:.0f} mm, balls {balls:.0f}, model {model}: 400 obs" in found.sentences[1]
    first = found.settings.blocks[0].rows[0]
    assert first.headings == (f"{size:.0f} mm", f"{balls:.0f}", model)


def test_none_that_meets_the_target_is_said_with_the_nearest(tmp_path: Path) -> None:
    found = answer(sweep(tmp_path, limit=0.0))
    assert found.sentences[0].startswith(wording.NONE_OF_THE_SETTINGS_MEETS)
    assert "size 500 mm, balls 6, model metric, with 40 %" in found.sentences[0]


def test_what_is_undetermined_never_meets_the_target(tmp_path: Path) -> None:
    """The setting of the smallest average leaves lengths undetermined."""
    best = 2 * 2 * 2 + 2
    found = answer(sweep(tmp_path, open_=(best,)))
    assert wording.OF_SETTINGS_LEAVES_SOMETHING_UNDETERMINED in found.sentences
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
        assert plot.measure.statistic == "average" and len(plot.lines) > 1
        every = {1e6 * average(*one) for one in itertools.product(SIZES, BALLS, MODELS)}
        for line in plot.lines:
            assert all(np.isclose(y, list(every)).any() for y in line.y)


def test_cells_that_leave_something_undetermined_are_hatched(tmp_path: Path) -> None:
    results = sweep(tmp_path, open_=(0,))
    (heat,) = [
        one for one in heat_maps(results) if (one.rows.name, one.columns.name) == ("size", "balls")
    ]
    assert heat.shades[0][0] == DEFICIENT and "Hatched" in heat.note
    assert wording.MODEL_METRIC_AS_IN_THE_BEST in heat.note
    flat = [shade for line in heat.shades for shade in line]
    assert flat.count(DEFICIENT) == 1 and BLANK not in flat
    expected = [[1e6 * average(size, balls, "metric") for balls in BALLS] for size in SIZES]
    expected[0][0] = np.nan
    shown = [[1e6 * entry.value for entry in line] for line in heat.entries]
    assert np.allclose(shown, expected, equal_nan=True)


def test_the_same_settings_of_two_stores_are_compared(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    here, there = sweep(tmp_path / "a"), sweep(tmp_path / "b", worse=1.25, open_=(5,))
    found = compared(here, there, "b.sqlite")
    assert found.sentences[0].startswith(wording.SETTINGS_ARE_DONE_IN_BOTH_IN_THIS_STORE)
    assert found.sentences[1].startswith(wording.SETTING_IS_NOT_COMPARED)
    assert wording.SMALLER_THAN_IN_SQLITE in found.sentences[2]
    assert wording.SETTINGS_ARE_RANK_DEFICIENT_ONLY in found.sentences
    same = compared(here, here, "a.sqlite")
    assert same.sentences[1:] == (wording.ALL_AVERAGES_ARE_THE_SAME,) and same.settings is None


def test_sweeps_over_other_axes_are_not_compared(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    other = [
        axis("edge", [f"{one:.0f} mm" for one in SIZES], [one / 1e3 for one in SIZES], "m"),
        axis("balls", [f"{one:.0f}" for one in BALLS], list(BALLS), "1"),
        axis("model", list(MODELS), [], ""),
    ]
    with pytest.raises(IncomparableError, match=wording.SWEPT_OVER_BALLS):
        compared(sweep(tmp_path / "a"), sweep(tmp_path / "b", axes=other), "b.sqlite")


def test_settings_are_the_same_in_whichever_unit_they_are_written(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    metres = [
        axis("balls", ["6", "4"], [6.0, 4.0], "1"),
        axis("size", [f"{one / 1e3} m" for one in SIZES], [one / 1e3 for one in SIZES], "m"),
        axis("model", list(MODELS), [], ""),
    ]
    here = sweep(tmp_path / "a")
    there = made_up(
        tmp_path / "b" / "b.sqlite",
        "metres",
        metres,
        (
            done(k, {"U6_average_m": average(size, balls, model), "observations": 1.0})
            for k, (balls, size, model) in enumerate(itertools.product((6.0, 4.0), SIZES, MODELS))
        ),
    )
    found = compared(here, read_results(there, 1), "b.sqlite")
    assert found.sentences[0].startswith(wording.SETTINGS_ARE_DONE_IN_BOTH)
    assert found.sentences[1] == wording.ALL_AVERAGES_ARE_THE_SAME


def test_values_that_differ_in_late_digits_are_settings_of_their_own(tmp_path: Path) -> None:
    """Each of three close lengths is found in the other sweep, which has them in another order and
    rounded as by another unit, with an average of its own.
    """
    lengths = {-0.05: 2.0, -0.050000000001: 3.0, -0.05000000001: 5.0}

    def store(name: str, values: list[float], factor: float) -> ReportedSweep:
        labels = [f"{one * 1e3:.9f} mm" for one in values]
        rows = (
            done(k, {"U6_average_m": factor * 1e-6 * lengths[one], "observations": 1.0})
            for k, one in enumerate(values)
        )
        written = [float(np.nextafter(one, 3.0 - 2.0 * factor)) for one in values]
        axes = [axis("x", labels, written, "m")]
        return read_results(made_up(tmp_path / name, name, axes, rows), 1)

    here = store("a.sqlite", list(lengths), 1.0)
    for count in (3, 2, 1):
        there = store(f"b{count}.sqlite", list(lengths)[: -count - 1 : -1], 2.0)
        found = compared(here, there, "b")
        cases, are = ("1 case", "is") if count == 1 else (f"{count} cases", "are")
        assert found.sentences == (
            f"{cases} {are} done in both; {3 - count} in this store alone, 0 in b alone.",
            f"The average of U6 is smaller than in b in {cases}, by a factor of 0.500.",
        )
        assert len(found.settings.blocks[0].rows) == count
    alone = compared(there, there, "b")
    assert alone.sentences[1:] == (wording.AVERAGE_IS_THE_SAME,)


def random_sweep(path: Path, seed: int) -> None:
    """A store whose settings have few different figures, some of them failed, left, without a
    target, undetermined, or undetermined in part.
    """
    draw = np.random.default_rng(seed)
    numbers = draw.permutation(5)[: draw.integers(1, 5)] + 1.0
    axes = [
        axis("size", [f"{one:.0f} mm" for one in numbers], [one / 1e3 for one in numbers], "m"),
        axis("model", list("abc")[: draw.integers(1, 4)]),
        axis("balls", ["3", "4"], [3.0, 4.0], "1"),
    ][: draw.integers(1, 4)]
    count = int(np.prod([len(one["labels"]) for one in axes]))
    has_target, recorded = draw.random() < 0.8, draw.random() < 0.85

    def rows():
        for cell in range(count):
            kind = draw.random()
            if kind < 0.1:
                yield failed(cell, "outside the volume")
            if kind < 0.2:
                continue
            open_ = 0.0 if kind < 0.7 else 9.0 if kind > 0.9 else 4.0
            figures = {"rank_deficiency": float(open_ > 0), "as_expected": 1.0}
            figures["observations"] = float(draw.choice([10, 20]))
            if recorded:
                size = np.nan if open_ else 1e-6 * draw.choice([1.0, 2.0, 3.0, 4.0])
                figures |= {"U6_average_m": size, "U6_maximum_m": size, "U6_undetermined": open_}
                if has_target and draw.random() < 0.9:
                    figures["U6_within_target"] = float(
                        draw.choice([0.25, 1.0]) if open_ == 0.0 else 0.25
                    )
            else:
                size = 1e-6 * draw.choice([1.0, 2.0])
                figures |= {"U4_average_m": size, "U4_maximum_m": size, "U4_undetermined": 0.0}
            yield done(cell, figures)

    record = ("U4", "U6") if recorded else ("U4",)
    made_up(path, "random", axes, rows(), record=record).close()


def test_every_sentence_is_what_the_exported_table_says(tmp_path: Path) -> None:
    """Counts, the cheapest, ties and worths, enumerated from the CSV of many sweeps."""
    said = set()
    for seed in range(25):
        path = tmp_path / f"{seed}.sqlite"
        random_sweep(path, seed)
        assert main(["sweep", "--export", str(path), "-o", str(path.with_suffix(".csv"))]) == 0
        with path.with_suffix(".csv").open(encoding="utf-8") as file:
            table = list(csv.DictReader(file))
        with closing(open_store(path)) as store:
            results = read_results(store, 1)
        told = answer(results)
        names = [one["column"] for one in results.definition["axes"]]
        every = len(results.cells)
        finished = [row for row in table if row["status"] == "done"]
        if not finished:
            assert told is None
            continue
        text = " ".join(told.sentences)
        said |= set(re.findall(r"[a-z]+(?= the| at| not| something|;|\.)", text))
        _assert_counts(text, table, finished, every)
        symbol = "U6" if "U6_average_m" in finished[0] else "U4"
        known = [row for row in finished if row[f"{symbol}_undetermined"] in ("0", "0.0")]
        _assert_first(text, told.settings.blocks[0].rows[0].headings, symbol, finished, known)
        for one in told.worth:
            _assert_worth(one, names, known, f"{symbol}_average_m")
    # All kinds of sentences have come up.
    assert {"meet", "meets", "failed", "lengths", "undetermined"} <= said


def _assert_counts(
    text: str, table: list[dict[str, str]], finished: list[dict[str, str]], every: int
) -> None:
    deficient = sum(float(row["rank_deficiency"]) > 0 for row in finished)
    found = re.search(r"(\d+) of (\d+) cases? leaves? something undetermined", text)
    assert (deficient > 0) == (found is not None)
    if found:
        assert [int(one) for one in found.groups()] == [deficient, len(finished)]
    for count, words in (
        (len(table) - len(finished), "failed"),
        (every - len(table), "not computed yet"),
    ):
        assert (f"{count} {words}" in text) == (count > 0)


def _assert_first(
    text: str,
    first: tuple[str, ...],
    symbol: str,
    finished: list[dict[str, str]],
    known: list[dict[str, str]],
) -> None:
    """The first sentences, and the first setting of the table."""
    shares = [row for row in finished if row.get("U6_within_target")]
    meeting = [row for row in shares if float(row["U6_within_target"]) == 1.0]
    average = f"{symbol}_average_m"
    if symbol == "U4":
        assert text.startswith(wording.IS_NOT_RECORDED)
    elif not shares:
        assert text.startswith("No case has a target")
    elif not meeting:
        assert text.startswith(("None of the", wording.THE_ONLY_SETTING_DOES_NOT_MEET))
        assert wording.OF_THE_LENGTHS in text
    else:
        assert re.match(rf"{len(meeting)} of {len(shares)} cases? meets? the target", text)
        fewest = min(float(row["observations"]) for row in meeting)
        cheapest = [row for row in meeting if float(row["observations"]) == fewest]
        best = min(float(row[average]) for row in cheapest)
        if len(cheapest) == 1:
            assert (
                f": {fewest:.0f} observations" in text and wording.THE_ONE_WITH_THE_FEWEST in text
            )
        else:
            assert f"observations are {fewest:.0f}, in {len(cheapest)} of these cases" in text
            tied = sum(float(row[average]) == best for row in cheapest) - 1
            assert f"{1e6 * best:.2f} µm" in text and (f"{tied} more." in text) == (tied > 0)
        chosen = [row for row in cheapest if float(row[average]) == best]
        assert first in [_labels(row) for row in chosen]
    if shares:
        apart = len(finished) - len(shares)
        assert (wording.NO_TARGET_TO_BE_COMPARED in text) == (apart > 0)
    elif known:
        best = min(float(row[average]) for row in known)
        tied = sum(float(row[average]) == best for row in known) - 1
        assert f"{symbol}, {1e6 * best:.2f} µm" in text and ("the same." in text) == (tied > 0)
        assert first in [_labels(row) for row in known if float(row[average]) == best]
    else:
        assert f"Every case leaves some of {symbol} undetermined" in text


def _labels(row: dict[str, str]) -> tuple[str, ...]:
    """A setting of the exported table as the page writes it."""
    told = [f"{1e3 * float(row['size_m']):.0f} mm"]
    told += [row["model"]] if "model" in row else []
    return (*told, *([f"{float(row['balls']):.0f}"] if "balls" in row else []))


def _assert_worth(one, names: list[str], known: list[dict[str, str]], average: str) -> None:
    column = {"size": "size_m"}.get(one.axis, one.axis)
    groups: dict[tuple[str, ...], dict[str, float]] = {}
    for row in known:
        others = tuple(row[name] for name in names if name != column)
        groups.setdefault(others, {})[row[column]] = float(row[average])
    values = sorted({row[column] for row in known}, key=lambda text: (len(text), text))
    if column == "model":
        several = [group for group in groups.values() if len(group) > 1]
        ratios = [max(group.values()) / min(group.values()) for group in several]
        best = [
            label
            for label in "abc"
            if several
            and all(label in group and group[label] == min(group.values()) for group in several)
        ]
        assert one.best == (best[0] if len(best) == 1 else "")
    else:
        ends = (min(values, key=float), max(values, key=float)) if values else ("", "")
        several = [
            group for group in groups.values() if ends[0] != ends[1] and set(ends) <= set(group)
        ]
        ratios = [group[ends[1]] / group[ends[0]] for group in several]
        inside = [min(group.values()) < min(group[ends[0]], group[ends[1]]) for group in several]
        assert one.between == sum(inside)
    assert one.settings == len(ratios)
    if ratios:
        assert (one.low, one.high) == (pytest.approx(min(ratios)), pytest.approx(max(ratios)))
