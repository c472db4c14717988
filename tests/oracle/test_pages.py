"""Figures and sentences of the pages of `run` and `fit`, against the dense reference."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.oracle.campaigns import AXES, Expected, campaign_file, fitted, planned, random_file
from tests.oracle.pages import page_of
from tests.oracle.printed import FACTORS, NUMBER, agrees, output_of, step_of, within
from tests.oracle.test_campaigns import OF_TURNS
from tests.oracle.uncertainties import UNITS, judge_name
from tests.reference import dense


def judge_quantities(tables: dict[str, list[list[str]]], expected: Expected, k: float) -> None:
    """Every figure of the table of U1 to U6, which has a head."""
    head, *rows = tables["quantities"]
    assert f"U maximum, k = {k:g}" in head and len(rows) == len(expected.split)
    for row, (symbol, (values, names, unit)) in zip(rows, expected.split.items(), strict=True):
        assert row[0] == symbol[:2] and row[6] == UNITS[unit]
        open_ = int(np.isnan(values).sum())
        assert row[7] == (f"{len(values)} ({open_} undetermined)" if open_ else str(len(values)))
        if open_:
            assert row[2:6] == ["undetermined"] * 4, row
            continue
        sizes = np.nanmax(values), np.nanmean(values)
        right = [factor * size / FACTORS[row[6]] for factor in (1.0, k) for size in sizes]
        assert all(agrees(told, one) for told, one in zip(row[2:6], right, strict=True)), row
        judge_name(row[8], values, names)


def judge_lengths(words: str, expected: Expected) -> None:
    values = expected.quantities["U6"]
    told = re.search(rf"({NUMBER}) µm on average and ({NUMBER}) µm at most", words)
    if open_ := int(np.isnan(values).sum()):
        part = "All" if open_ == len(values) else f"{open_} of {len(values)}"
        assert words == f"{part} distances between corrected points are undetermined."
        return
    assert told is not None, words
    assert agrees(told[1], 1e6 * np.nanmean(values), 3)
    assert agrees(told[2], 1e6 * np.nanmax(values), 3)


@pytest.mark.parametrize("seed", [23, None])
def test_a_page_of_run(
    seed: int | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = campaign_file(1, tmp_path) if seed is None else random_file(seed, tmp_path)
    expected, page = planned(path), path.with_suffix(".html")
    deficiency = expected.spread.deficiency
    text = output_of(capsys, "run", path, "--report", page, status=int(deficiency > 0))
    tables, words = page_of(page)
    judge_quantities(tables, expected, 2.0)
    first, second = words[1:3]
    counts = f"{expected.rows.shape[1]} parameters from {len(expected.rows)} observations"
    if deficiency:
        assert first.startswith(f"Rank deficiency {deficiency}, which the file does not expect:")
        assert f"leave {deficiency} changes of {counts} undetermined" in first
        # The same sentences as in the text, which the test of designs judges.
        told = re.findall(r"^undetermined \d+: (.*)$", text, re.M)
        assert told and all(any(one in each for each in words) for one in told)
    else:
        assert first == f"Full rank: the readings determine all {counts}."
    judge_lengths(second, expected)


def test_a_page_of_fit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = campaign_file(1, tmp_path)
    readings, page = tmp_path / "r.csv", tmp_path / "fit.html"
    output_of(capsys, "simulate", path, "-o", readings, "--seed", 3, "-q")
    output_of(capsys, "fit", path, readings, "--report", page, "-q")
    expected = fitted(path, readings)
    tables, words = page_of(page)
    judge_quantities(tables, expected, 2.0)
    told = re.search(rf"\(sigma = ({NUMBER}), estimated from the residuals\)", words[1])
    assert words[1].startswith("Full rank; the residuals are no larger") and told is not None
    assert agrees(told[1], expected.sigma, 3)
    judge_lengths(words[2], expected)
    rows, count = expected.rows, expected.degrees_of_freedom
    sizes = f"{rows.shape[1]} parameters, {len(rows)} observations, {count} degrees of freedom."
    assert sizes in words
    for name in ("balls", "estimates-rotation", "estimates-origin"):
        for what, value, u, expanded, unit in tables[name][1:]:
            right = expected.standard_uncertainties[what] / FACTORS[unit]
            assert agrees(u, right, 3) and agrees(expanded, 2.0 * right, 3), what
            slack = 2.0 * OF_TURNS * right if "rotation" in what else 0.0
            estimate = expected.estimates[what] / FACTORS[unit]
            assert within(value, estimate, step_of(right, 3) + slack), what
    for what, _, value, expanded, unit in tables["error-functions"][1:]:
        curve, u = expected.curve(what, np.linspace(0.0, 1.0, 1001)[1:])
        # The page has the largest of fewer places.
        at = int(np.abs(curve).argmax())
        assert abs(float(value)) == pytest.approx(abs(curve[at]) / FACTORS[unit], rel=2e-3), what
        assert float(expanded) == pytest.approx(2.0 * u[at] / FACTORS[unit], rel=2e-2), what
    design = expected.problem.design
    left = dense.residuals(expected.problem, np.zeros(expected.problem.parameters))
    of_readings = left[: 3 * len(design.readings)].reshape(-1, 3)
    metres = of_readings * design.machine.repeatability
    for axis, (letter, n, size, relative) in enumerate(tables["residuals-axis"][1:]):
        assert (letter, n) == (AXES[axis], str(len(metres)))
        assert agrees(size, 1e6 * np.sqrt((metres[:, axis] ** 2).mean()))
        right = np.sqrt((of_readings[:, axis] ** 2).mean()) / expected.sigma
        assert agrees(relative, right)
