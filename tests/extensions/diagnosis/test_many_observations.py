"""More observations than there is memory to test for mistakes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.diagnosis import effects
from ballplate.extensions.diagnosis.bias_patterns import patterns
from ballplate.extensions.diagnosis.redundancy import reliability
from ballplate.extensions.diagnosis.remainders import entries, leftover
from ballplate.extensions.diagnosis.response import responses
from ballplate.results.fitting import fit
from ballplate.simulator.estimation.functions import BallPlaces, Distances, displacements
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.readings.reading_files import read_readings

QUICKSTART = Path("designs/quickstart.yaml")
CERTIFIED = Path("designs/certified")


def test_the_entries_are_those_that_are_kept() -> None:
    """Of 25 balls, read ten times in three dimensions, four have calibrated distances: 754
    observations.
    """
    (experiment,) = load(QUICKSTART)
    design = lay_out(experiment)
    assert entries(design)[0] == 25 * 10 * 3 + 4
    # Of full rank, so that each parameter makes a column: those of the machine, of five poses, and
    # of four balls.
    assert entries(design) == leftover(linearise(design), None, 1).common.shape


def test_reliability_of_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    (experiment,) = load(QUICKSTART)
    rows, columns = entries(lay_out(experiment))
    monkeypatch.setattr(
        "ballplate.extensions.diagnosis.remainders.MOST_ENTRIES", rows * columns - 1
    )
    with pytest.raises(ExperimentError) as caught:
        reliability(experiment)
    assert (
        str(caught.value)
        == f"{QUICKSTART}:39:1: positions: {rows} observations, each co-ordinate counted, are too"
        f" many to test for gross errors; at most {rows - 1} are possible with {columns} parameters"
        " of machine, poses and tied balls: read fewer balls, or in fewer positions"
    )
    monkeypatch.setattr("ballplate.extensions.diagnosis.remainders.MOST_ENTRIES", rows * columns)
    reliability(experiment)


def test_fit_of_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    (experiment,) = load(CERTIFIED / "three-planes.yaml")
    observed = read_readings(CERTIFIED / "three-planes.csv", lay_out(experiment))
    rows, columns = entries(observed.design)
    monkeypatch.setattr("ballplate.extensions.diagnosis.remainders.MOST_ENTRIES", rows * columns)
    tested = fit(experiment, observed)
    assert tested.untested == "" and tested.cautions == ()
    monkeypatch.setattr(
        "ballplate.extensions.diagnosis.remainders.MOST_ENTRIES", rows * columns - 1
    )
    found = fit(experiment, observed)
    assert (
        f"at most {rows - 1} are possible" in found.cautions[0]
        and "fit the means of repeated" in found.cautions[0]
    )
    assert found.estimates == tested.estimates and not found.diagnosis


def test_time_is_in_proportion_to_readings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a large plate a batch of observations moves the balls of its distances, and no others;
    what a result has of all biases is computed once.
    """
    (experiment,) = load(QUICKSTART)
    monkeypatch.setattr(effects, "MOST_PLACES", 5)
    at = linearise(lay_out(experiment))
    given = patterns(at.design, at.state, None)
    places = BallPlaces(np.arange(25))
    changes = effects.changes_of(at, Distances(places), given)(np.array([3, 7]))
    assert len(changes.common) == 3 * len({0, 6, 12, 18, 24, 3, 7})
    every = displacements(at, places, narrow=False)
    apart = every.places[changes.first] - every.places[changes.second]
    unit = apart / np.linalg.norm(apart, axis=1)[:, None]
    for response in responses(at, given):
        own = np.einsum("nde,kne->knd", every.own, response.own.toarray().reshape(-1, 25, 3))
        moved = np.einsum("ndr,kr->knd", every.common, response.common) + own
        change = np.einsum("fd,kfd->kf", unit, moved[:, changes.first] - moved[:, changes.second])
        expected = np.abs(change).max(axis=1)
        np.testing.assert_allclose(changes.largest(response).change, expected, rtol=1e-7, atol=1e-9)
    found = reliability(experiment)
    assert found.minimal_detectable is found.minimal_detectable
    assert found.found_by_fit is found.found_by_fit
