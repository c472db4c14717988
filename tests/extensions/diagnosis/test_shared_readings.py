"""Mistakes in readings that several lengths share, and in their certificates, against the dense
covariance.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ballplate.extensions.diagnosis.cause_search import searched
from ballplate.extensions.diagnosis.names import name
from ballplate.extensions.diagnosis.redundancy import reliability_of
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.observations.readings import expected_readings
from ballplate.simulator.estimation.gauss_newton import iterate, linearised_fit
from ballplate.simulator.experiment.layout import lay_out
from numpy.typing import NDArray

from tests.extensions.diagnosis.test_against_dense import distances_of, orthonormal
from tests.reference import dense
from tests.reference.standards import bar, experiment, flat

Real = NDArray[np.float64]

KNOWN = {"pairs": "all", "standard_uncertainty": "0.2 um + L/200000"}
COARSE: dict[str, Any] = {
    "error_model": {
        "kind": "kinematic",
        "arrangement": "MB2",
        "position_coefficients": 3,
        "rotation_coefficients": 2,
    }
}


def bias_of_lengths(design: Design, kind: str, subject: int, axis: int) -> Real:
    """What a bias of a metre changes lengths less certified ones by (m,), by a loop over them."""
    given = design.of(Lengths)
    change = np.zeros(len(given))
    for i in range(len(given)):
        if kind == "length value":
            change[i] = -1.0 if given.certificate[i] == given.certificate[subject] else 0.0
        if kind == "end" and given.first[i] == subject:
            change[i] += given.direction[i, axis]
        if kind == "end" and given.second[i] == subject:
            change[i] -= given.direction[i, axis]
    return change


@pytest.mark.parametrize("standard", [bar(3), bar(5), flat(3)], ids=["three", "five", "plate"])
def test_detectable_biases_are_those_of_the_full_covariance(
    standard: dict[str, Any], tmp_path: Path
) -> None:
    design = lay_out(experiment(tmp_path, standard, KNOWN, **COARSE))
    result = reliability_of(design)
    problem = dense.planned(design, 3, 2)
    basis = orthonormal(
        dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters), 0
    )
    start = len(basis) - len(problem.length_root)
    tried = set()
    given = result.patterns
    for k in given.of_kind("end", "length value").tolist():
        kind, subject, axis = str(given.kind[k]), int(given.subject[k]), int(given.axis[k])
        pattern = np.zeros(len(basis))
        pattern[start:] = problem.length_root @ bias_of_lengths(design, kind, subject, axis)
        left = pattern - basis @ (basis.T @ pattern)
        assert result.information[k] == pytest.approx(left @ left, rel=1e-7), name(given, k)
        tried.add(kind)
    assert tried == {"end", "length value"} and not len(given.of_kind("length"))
    # Every certificate and every reading of a ball, along the axes that differ.
    assert len(given.of_kind("length value")) == len(np.unique(design.of(Lengths).certificate))
    of_standard = np.setdiff1d(np.arange(len(design.readings)), design.plate_readings)
    np.testing.assert_array_equal(np.unique(given.subject[given.of_kind("end")]), of_standard)
    total = result.redundancy.sum() + result.among_repeats
    assert total == pytest.approx(result.degrees_of_freedom, rel=1e-9)
    assert result.degrees_of_freedom == len(basis) - problem.parameters


def test_a_bar_along_an_axis_shows_a_ball_along_that_axis_alone(tmp_path: Path) -> None:
    design = lay_out(experiment(tmp_path, bar(3), KNOWN))
    given = reliability_of(design).patterns
    axes: dict[str, set[int]] = {}
    for k in given.of_kind("end").tolist():
        place = design.positions.names[design.readings.position[given.subject[k]]]
        axes.setdefault(place, set()).add(int(given.axis[k]))
    assert [axes[f"standard {k}"] for k in range(3)] == [{0}, {1}, {2}]
    # In the others the three are multiples of one another, and the largest stands for all.
    assert all(len(found) == 1 for found in axes.values())


def test_effects_are_those_of_an_estimate_with_the_bias_put_in(tmp_path: Path) -> None:
    design = lay_out(experiment(tmp_path, bar(4), KNOWN))
    result, start = reliability_of(design), nominal_state(design)
    exact = expected_readings(design, start, design.readings)
    before = distances_of(design, iterate(design, exact, start).state)
    size = 1e-6
    for k in result.patterns.of_kind("end")[::7]:
        x = exact.copy()
        x[result.patterns.subject[k], result.patterns.axis[k]] += size
        after = distances_of(design, iterate(design, x, start).state)
        for symbol, was, now in zip(("U5", "U6"), before, after, strict=True):
            largest = np.abs(now - was).max() / size
            np.testing.assert_allclose(
                result.effects[symbol].change[k], largest, rtol=2e-3, atol=2e-6
            )


def test_a_wrong_reading_of_a_shared_ball_is_named(tmp_path: Path) -> None:
    """It is in several lengths, and one reading is told, not these."""
    made = experiment(tmp_path, bar(4), KNOWN)
    design, start = lay_out(made), nominal_state(lay_out(made))
    x = expected_readings(design, start, design.readings)
    x = x + design.machine.repeatability * np.random.default_rng(3).standard_normal(x.shape)
    wrong = int(np.setdiff1d(np.arange(len(x)), design.plate_readings)[1])
    x[wrong, 0] += 3e-5
    solution = iterate(design, x, start)
    search = searched(linearised_fit(design, solution), x, sigma_is_estimated=False)
    assert search is not None
    (found,), ((values, u),) = search.found, search.sizes()
    given, k = search.patterns, int(found.columns[0])
    assert (given.kind[k], int(given.subject[k])) == ("end", wrong)
    along_x = next(i for i, column in enumerate(found.columns) if given.axis[column] == 0)
    assert values[along_x] == pytest.approx(3e-5, abs=4 * u[along_x])


def test_tables_hold_the_readings_of_standards(tmp_path: Path) -> None:
    result = reliability_of(lay_out(experiment(tmp_path, bar(3), KNOWN)))
    rows = [row for row in csv.DictReader(io.StringIO(result.to_csv())) if row["kind"] == "end"]
    told = [one for one in result.to_dict()["observations_by_name"] if one["kind"] == "end"]
    ends = result.patterns.of_kind("end")
    assert len(rows) == len(told) == len(ends) == 15
    for row, one, k in zip(rows, told, ends.tolist(), strict=True):
        share = result.information[k] / result.patterns.matrix[:, [k]].power(2).sum()
        assert float(row["redundancy"]) == pytest.approx(one["redundancy"]) == pytest.approx(share)
        assert row["name"] == one["name"] == name(result.patterns, k)
