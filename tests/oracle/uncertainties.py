"""Tables of U1 to U6, in text and in JSON, judged by the dense reference."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from tests.oracle.campaigns import Expected
from tests.oracle.printed import FACTORS, NUMBER, agrees, place, table

UNITS = {"m": "µm", "rad": "µrad"}


def judge_text(text: str, expected: Expected) -> None:
    """Every figure, count, unit and name of the table of `run` or `fit`, and where its points
    stand.
    """
    rows = table(text, "    standard uncertainty of")
    end = next(
        (
            k
            for k, row in enumerate(rows)
            if row[0].startswith(("within the target", "assumed:", "warning:"))
        ),
        len(rows),
    )
    of_table = rows[:end]
    assert len(of_table) == len(expected.split)
    for row, (symbol, (values, names, unit)) in zip(of_table, expected.split.items(), strict=True):
        figures = row[1:] if re.fullmatch(r"U\d", row[0]) else row
        assert row[0][:1] != "U" or row[0][:2] == symbol[:2], row
        first = next(k for k, cell in enumerate(figures) if re.fullmatch(f"-|{NUMBER}", cell))
        maximum, average, shown, *rest = figures[first:]
        assert UNITS[unit] == shown
        open_ = int(np.isnan(values).sum())
        assert rest[0] == (f"{len(values)} ({open_} undetermined)" if open_ else str(len(values)))
        if open_:
            assert (maximum, average, rest[1:]) == ("-", "-", [])
            continue
        factor = FACTORS[shown]
        assert agrees(maximum, np.nanmax(values) / factor), (symbol, row)
        assert agrees(average, np.nanmean(values) / factor), (symbol, row)
        judge_name(rest[1], values, names)
    told = dict(re.findall(r"point (\d+) at (\([^)]*\) mm)", text))
    named = {number for row in of_table for number in re.findall(r"point (\d+)", row[-1])}
    assert set(told) == named
    points = expected.problem.design.evaluation.points
    for number, where in told.items():
        assert np.abs(np.array(place(where)) - points[int(number) - 1]).max() < 0.051e-3


def judge_name(name: str, values: Any, names: list[str]) -> None:
    """The named one is as large as any, and the first of those that are equal but for rounding."""
    largest = np.nanmax(values)
    equal = [names[k] for k in np.flatnonzero(values > largest * (1 - 1e-5))]
    assert name in equal, (name, equal)


def judge_data(data: dict[str, Any], expected: Expected) -> None:
    """The same of JSON, in metres and radians, to nine digits."""
    whole = {"U2": "U2", "U3": "U3"}
    found = {symbol: one for symbol, one in data.items() if symbol not in whole}
    assert list(found) == list(expected.split)
    for symbol, (values, names, unit) in expected.split.items():
        one = found[symbol]
        assert one["unit"] == unit and one["count"] == len(values)
        assert one["undetermined"] == np.isnan(values).sum()
        if np.isnan(values).any():
            assert one["maximum"] is None and one["average"] is None
            assert not one.get("largest_at")
            continue
        np.testing.assert_allclose(one["maximum"], np.nanmax(values), rtol=1e-6)
        np.testing.assert_allclose(one["average"], np.nanmean(values), rtol=1e-6)
        judge_name(one["largest_at"], values, names)
        if symbol in ("U4", "U6"):
            numbers = re.findall(r"point (\d+)", one["largest_at"])
            assert [re.findall(r"point (\d+) at", told) for told in one["largest_places"]] == [
                [number] for number in numbers
            ]


def judge_target(text: str, expected: Expected, constant: float, share: float) -> None:
    """The share of U6 within constant + share x length, rounded down to a hundredth of a
    percent.
    """
    values = expected.quantities["U6"]
    points = expected.problem.design.evaluation.points
    first, second = np.triu_indices(len(points), 1)
    lengths = np.linalg.norm(points[first] - points[second], axis=1)
    within = int((values <= constant + share * lengths).sum())
    (line,) = [line for line in text.splitlines() if line.startswith("within the target")]
    told = re.search(rf"({NUMBER}) % of U6", line)
    assert told is not None
    exact = 100.0 * within / len(values)
    assert exact - 0.01 - 1e-9 <= float(told[1]) <= exact + 1e-9, (line, exact)
