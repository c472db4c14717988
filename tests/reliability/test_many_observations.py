"""More observations than there is memory to test for mistakes."""

from __future__ import annotations

from pathlib import Path

import pytest

from analysis.reliability.leftover import entries, leftover
from analysis.reliability.study import reliability
from analysis.study import fit
from simulator.design import nominal_state
from simulator.experiment.load import load
from simulator.experiment.messages import ExperimentError
from simulator.layout import lay_out
from simulator.readings import read_readings

QUICKSTART = Path("designs/quickstart.yaml")
CERTIFIED = Path("designs/certified")


def test_the_entries_are_those_that_are_kept() -> None:
    """Of 25 balls, read ten times in three dimensions, four have calibrated distances: 754 observations."""
    (experiment,) = load(QUICKSTART)
    design = lay_out(experiment)
    assert entries(design)[0] == 25 * 10 * 3 + 4
    # Of full rank, so that each parameter makes a column: those of the machine, of five poses, and of four balls.
    assert entries(design) == leftover(design, nominal_state(design), None, 1).common.shape


def test_reliability_of_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    (experiment,) = load(QUICKSTART)
    rows, columns = entries(lay_out(experiment))
    monkeypatch.setattr("analysis.reliability.leftover.MOST_ENTRIES", rows * columns - 1)
    with pytest.raises(ExperimentError) as caught:
        reliability(experiment)
    assert str(caught.value) == (
        f"{QUICKSTART}: positions: {rows} observations, each co-ordinate counted, are too many to test for mistakes; "
        f"at most {rows - 1} are possible with {columns} parameters of machine, poses and tied balls: "
        "read fewer balls, or in fewer positions"
    )
    monkeypatch.setattr("analysis.reliability.leftover.MOST_ENTRIES", rows * columns)
    reliability(experiment)


def test_fit_of_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    (experiment,) = load(CERTIFIED / "three-planes.yaml")
    observed = read_readings(CERTIFIED / "three-planes.csv", lay_out(experiment))
    rows, columns = entries(observed.design)
    monkeypatch.setattr("analysis.reliability.leftover.MOST_ENTRIES", rows * columns)
    assert fit(experiment, observed).solution.status == "converged"
    monkeypatch.setattr("analysis.reliability.leftover.MOST_ENTRIES", rows * columns - 1)
    with pytest.raises(
        ExperimentError, match=f"at most {rows - 1} are possible .*: fit the means of repeated readings"
    ):
        fit(experiment, observed)
