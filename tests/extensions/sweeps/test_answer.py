"""What the page of a sweep answers first, from stores whose figures are made up."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
from ballplate.cli import main
from ballplate.extensions.sweeps.answer import answer
from ballplate.extensions.sweeps.result import SweepResult

from tests.extensions.sweeps import wording
from tests.extensions.sweeps.stores import axis, done, failed, made_up_result


def labels(result: SweepResult, row: int) -> tuple[str, ...]:
    """The axes' values in a row."""
    chosen = result.chosen[row].tolist()
    return tuple(axis.labels[k] for axis, k in zip(result.axes, chosen, strict=True))


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
        assert wording.WITHIN_TARGET in text
    else:
        assert re.match(rf"{len(meeting)} of {len(shares)} cases? meets? the target", text)
        fewest = min(float(row["observations"]) for row in meeting)
        cheapest = [row for row in meeting if float(row["observations"]) == fewest]
        best = min(float(row[average]) for row in cheapest)
        (said,) = re.findall(rf"{wording.FEWEST}([^:]*): .*?; observations (\d+);", text)
        assert said == (_one_of(len(cheapest)), f"{fewest:.0f}")
        chosen = [row for row in cheapest if float(row[average]) == best]
        assert first in [_labels(row) for row in chosen]
    if shares:
        apart = len(finished) - len(shares)
        assert (wording.NO_TARGET_TO_BE_COMPARED in text) == (apart > 0)
    elif known:
        best = min(float(row[average]) for row in known)
        tied = sum(float(row[average]) == best for row in known) - 1
        said = f"Smallest average of {symbol}{_one_of(tied + 1)}: case"
        assert said in text and f"{symbol} average {1e6 * best:.3f} µm" in text
        assert first in [_labels(row) for row in known if float(row[average]) == best]
    else:
        assert f"Every case leaves some of {symbol} undetermined" in text


def _one_of(count: int) -> str:
    return f" (one of {count})" if count > 1 else ""


def _labels(row: dict[str, str]) -> tuple[str, ...]:
    """A setting of the exported table as the page writes it."""
    told = [f"{1e3 * float(row['size_m']):.0f} mm"]
    told += [row["model"]] if "model" in row else []
    return (*told, *([f"{float(row['balls']):.0f}"] if "balls" in row else []))
