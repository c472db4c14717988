"""Time for one linearised estimate, from a design to U1 to U6 and the rank, against other means.

Run with

    pip install -e '.[benchmark]'
    python -m pytest benchmarks/bench_rivals.py

It takes about ten minutes and 8 GB of memory. The table is printed at the end. Experiment 6.2.1 of
NPL Report CISE 15/98 is taken on grids of n x n balls with the sides between the corners
calibrated. All tools get the threads that they take by themselves; they take turns, round by round,
and a ratio is the median over rounds of the ratio within a round, so that a change of the machine's
pace touches both alike.
"""

from __future__ import annotations

import gc
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.uncertainty.summaries import uncertainties

from tests.reference.designs import grid_experiment

from .linear_problem import Figures, figures, linear_problem
from .rivals import RIVALS, Rival

ROUNDS = {5: 15, 9: 15, 20: 7, 40: 3}
LONGEST = 120.0
AGREEMENT = 1e-9
SYMBOLS = ("U1", "U2", "U3", "U4", "U5", "U6")


@dataclass(frozen=True)
class Line:
    """One line of the table: seconds in all, to construct, to factorise with covariances; or why
    there are none.
    """

    n: int
    tool: str
    total: float = np.nan
    construct: float = np.nan
    solve: float = np.nan
    ratio: float = np.nan
    reason: str = ""


TABLE: list[Line] = []


def ballplate(design: Design) -> tuple[Figures, int]:
    """What is measured."""
    found = linearise(design)
    quantities = uncertainties(found)
    return {s: (quantities[s].maximum, quantities[s].average) for s in SYMBOLS}, found.deficiency


def attempt(rival: Rival, design: Design) -> tuple[Figures, int, tuple[float, float, float]]:
    """One estimate by a rival, with seconds in all, to construct, and to factorise with
    covariances.
    """
    gc.collect()
    start = time.perf_counter()
    if rival.whole is not None:
        whole, deficiency = rival.whole(design)
        return whole, deficiency, (time.perf_counter() - start, np.nan, np.nan)
    problem = linear_problem(design)
    linear = time.perf_counter()
    constructed = rival.construct(problem)
    ready = time.perf_counter()
    found = rival.solve(problem, constructed)
    solved = time.perf_counter()
    result = figures(problem, found)
    end = time.perf_counter()
    return result, found.deficiency, (end - start, ready - linear, solved - ready)


@pytest.mark.parametrize("n", ROUNDS)
def test_one_estimate(benchmark: Any, n: int) -> None:
    design = grid_experiment(n)
    expected, deficiency = ballplate(design)
    present: list[Rival] = []
    for rival in RIVALS:
        if not rival.is_installed:
            TABLE.append(Line(n, rival.name, reason=f"{rival.module} is not installed"))
            continue
        try:
            result, found, (seconds, _, _) = attempt(rival, design)
        except MemoryError:
            TABLE.append(Line(n, rival.name, reason="not delivered: out of memory"))
            continue
        assert found == deficiency, rival.name
        for symbol in SYMBOLS:
            assert result[symbol] == pytest.approx(expected[symbol], rel=AGREEMENT), (
                rival.name,
                symbol,
            )
        if seconds > LONGEST:
            TABLE.append(
                Line(n, rival.name, reason=f"not delivered within {LONGEST:.0f} s: {seconds:.0f} s")
            )
        else:
            present.append(rival)

    rounds: list[dict[str, tuple[float, float, float]]] = []

    def others() -> None:
        rounds.append({rival.name: attempt(rival, replace(design))[2] for rival in present})
        gc.collect()

    def fresh() -> tuple[tuple[Design], dict[str, Any]]:
        others()
        # Nothing that an earlier round has left with the design helps; the error model serves all.
        return (replace(design),), {}

    benchmark.pedantic(ballplate, setup=fresh, rounds=ROUNDS[n])
    own = np.array(benchmark.stats.stats.data)
    TABLE.append(Line(n, "ballplate", float(np.median(own)), ratio=1.0))
    for rival in present:
        times = np.array([entry[rival.name] for entry in rounds])
        total, construct, solve = np.median(times, axis=0)
        ratio = float(np.median(times[:, 0] / own))
        TABLE.append(Line(n, rival.name, total, construct, solve, ratio))


def test_table(capsys: pytest.CaptureFixture[str]) -> None:
    """Print what was measured; a line of Markdown each."""
    with capsys.disabled():
        print(
            "\n\n|  n | tool | seconds | of it construction | factorisation, covariances | ratio to"
            " ballplate |"
        )
        print(
            "|---:|------|--------:|-------------------:|---------------------------:|-------------------:|"
        )
        for line in sorted(TABLE, key=lambda entry: (entry.n, bool(entry.reason), entry.ratio)):
            start = f"| {line.n:2d} | {line.tool} |"
            if line.reason:
                print(f"{start} {line.reason} | | | |")
            elif line.tool == "ballplate":
                print(f"{start} {line.total:.4f} | | | 1 |")
            else:
                print(
                    f"{start} {line.total:.4f} | {line.construct:.4f} | {line.solve:.4f} |"
                    f" {line.ratio:.2f} |"
                )
