"""What the page of a sweep answers first, from stores whose figures are made up."""

from __future__ import annotations

import csv
import itertools
import re
from pathlib import Path

import numpy as np
from ballplate.cli import main
from ballplate.extensions.sweeps.answer import answer
from ballplate.extensions.sweeps.curves import lines_along
from ballplate.extensions.sweeps.result import SweepResult

from tests.extensions.sweeps import wording
from tests.extensions.sweeps.stores import axis, done, failed, made_up_result

SIZES, BALLS, MODELS = (300.0, 400.0, 500.0), (4.0, 6.0), ("metric", "kinematic")


def average(size: float, balls: float, model: str) -> float:
    """An average uncertainty in metres: larger plates and more balls have less."""
    return 1e-6 * (300.0 / size) ** 2 * (4.0 / balls) * (2.0 if model == "kinematic" else 1.0)


def sweep(folder: Path, limit: float = 0.5e-6, open_: tuple[int, ...] = ()) -> SweepResult:
    """A sweep over size, balls and model of which settings below a limit meet the target."""
    listed = [
        axis("size", [f"{one:.0f} mm" for one in SIZES], [one / 1e3 for one in SIZES], "m"),
        axis("balls", [f"{one:.0f}" for one in BALLS], list(BALLS), "1"),
        axis("model", list(MODELS), [], ""),
    ]

    def rows():
        for k, setting in enumerate(itertools.product(SIZES, BALLS, MODELS)):
            is_open = k in open_
            size = np.nan if is_open else average(*setting)
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

    return made_up_result(folder / "made-up.sqlite", "made up", listed, rows())


def labels(result: SweepResult, row: int) -> tuple[str, ...]:
    """The axes' values in a row."""
    chosen = result.chosen[row].tolist()
    return tuple(axis.labels[k] for axis, k in zip(result.axes, chosen, strict=True))


def test_lines_are_of_cases_that_differ_in_one_axis(tmp_path: Path) -> None:
    result = sweep(tmp_path, open_=(0,))
    value = result.figure("U6_average_m")
    sizes = result.figure("size_m")
    lines, note = lines_along(result, 0, sizes, value)
    assert note == "" and [label for label, _ in lines] == [
        f"balls {balls:.0f}, model {model}" for balls in BALLS for model in MODELS
    ]
    for label, rows in lines:
        balls, model = (part.split()[1] for part in label.split(", "))
        expected = [average(1e3 * size, float(balls), model) for size in sizes[rows]]
        np.testing.assert_allclose(value[rows], expected, rtol=1e-12)
    # What the first case leaves undetermined is no point.
    assert [sizes[rows].tolist() for _, rows in lines] == [[0.4, 0.5]] + 3 * [[0.3, 0.4, 0.5]]


def test_of_many_lines_those_with_the_smallest_averages_are_drawn(tmp_path: Path) -> None:
    count = 9
    axes = [
        axis("a", ["1", "2"], [1.0, 2.0], "1"),
        axis("b", [str(k) for k in range(count)], [float(k) for k in range(count)], "1"),
    ]
    rows = [done(k, {"U6_average_m": 1e-6 * (1 + k % count)}) for k in range(2 * count)]
    result = made_up_result(tmp_path / "many.sqlite", "many", axes, rows)
    lines, note = lines_along(result, 0, result.figure("a"), result.figure("U6_average_m"))
    assert [label for label, _ in lines] == [f"b {k}" for k in range(6)]
    assert note == " Of 9 combinations of the other axes, the 6 with the smallest."
    # Against b, each line is of one value of a.
    (one, two), note = lines_along(result, 1, result.figure("b"), result.figure("U6_average_m"))
    assert note == "" and (one[0], two[0]) == ("a 1", "a 2") and len(one[1]) == count


def random_sweep(path: Path, seed: int) -> SweepResult:
    """A sweep whose settings have few different figures, some of them failed, left, without a
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
    return made_up_result(path, "random", axes, rows(), record=record)


def test_every_sentence_is_what_the_exported_table_says(tmp_path: Path) -> None:
    """Counts, the cheapest and ties, enumerated from the CSV of many sweeps."""
    said = set()
    for seed in range(25):
        path = tmp_path / f"{seed}.sqlite"
        results = random_sweep(path, seed)
        assert main(["sweep", "--export", str(path), "-o", str(path.with_suffix(".csv"))]) == 0
        with path.with_suffix(".csv").open(encoding="utf-8") as file:
            table = list(csv.DictReader(file))
        told = answer(results)
        every = results.summary.cells
        finished = [row for row in table if row["status"] == "done"]
        if not finished:
            assert told is None
            continue
        text = " ".join(told.sentences)
        said |= set(re.findall(r"[a-z]+(?= the| at| not| something|;|\.)", text))
        _assert_counts(text, table, finished, every)
        symbol = "U6" if "U6_average_m" in finished[0] else "U4"
        known = [row for row in finished if row[f"{symbol}_undetermined"] in ("0", "0.0")]
        _assert_first(text, labels(results, told.best[0]), symbol, finished, known)
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
