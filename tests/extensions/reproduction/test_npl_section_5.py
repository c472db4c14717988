"""NPL Report CISE 15/98, section 5: exact readings of one machine, fitted with the model of the
same or another.

The report's sums of squares are in square metres, with weight 1 for a reading; those here are
brought to that form. Its readings are exact to about a nanometre only, those here to rounding, so
that sums of squares end lower.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest
from ballplate.extensions.reproduction import compare
from ballplate.extensions.reproduction.compare import compare_iterations
from ballplate.extensions.reproduction.published import npl
from ballplate.extensions.reproduction.shipped import (
    Shipped,
    fitted_exactly,
    shipped_experiment,
    sums_of_squares,
)
from ballplate.rank.verdicts import Verdict
from ballplate.results.fits import Fit
from ballplate.results.prediction import check
from ballplate.simulator.experiment.model import Experiment

# The tests below look at few fits, each of which is computed once.
SHIPPED = Shipped(Path("designs/npl"))
FITS: dict[str, Fit] = {}


def fitted_once(experiment: Experiment) -> Fit:
    if experiment.label not in FITS:
        FITS[experiment.label] = fitted_exactly(experiment)
    return FITS[experiment.label]


@cache
def planned(design: str) -> Verdict:
    return check(shipped_experiment(SHIPPED, design)).verdict


def fitted(name: str, variant: str) -> Fit:
    return fitted_once(shipped_experiment(SHIPPED, f"{name}[{variant}]"))


def steps(found: Fit) -> list[float]:
    return [iteration.step for iteration in found.solution.iterations[1:]]


# Those whose fits take seconds are left to the long tests.
QUICK = ("5.2", "5.3[empirical fit]", "5.4[kinematic machine, kinematic fit]")


@pytest.mark.parametrize(
    "published",
    [
        pytest.param(
            one, id=one.design, marks=[] if one.design.startswith(QUICK) else [pytest.mark.long]
        )
        for one in npl().convergence
    ],
)
def test_published_iterations(published, monkeypatch: pytest.MonkeyPatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setattr(compare, "fitted_exactly", fitted_once)
    found = compare_iterations(npl(), SHIPPED, published)
    assert found and all(row.agrees for row in found), found


NAMED = re.compile(r"E[XYZABC] \((error in|rotation about) [XYZ], .*along [XYZ] at")


def test_an_empirical_fit_of_sparse_readings_is_recognised_as_deficient() -> None:
    """Section 5.4: planned, on a machine without errors, twelve directions are wholly open."""
    verdict = planned("5.4[kinematic machine, empirical fit]")
    assert verdict.as_expected
    assert verdict.deficiency == len(verdict.null) == 12 and verdict.gap > 1e8
    assert all(NAMED.search(str(direction)) for direction in verdict.null)


@pytest.mark.parametrize(
    "machine", ["kinematic", pytest.param("empirical", marks=pytest.mark.long)]
)
def test_what_the_sparse_readings_leave_open_is_named_after_a_fit_too(machine: str) -> None:
    """Tables 3 and 4: steps that stay at 1e-3. The machine's errors tilt the twelve open directions
    just so much out of the way that they are seen through products of errors; the iteration wanders
    along them. They are open all the same.
    """
    found = fitted("5.4", f"{machine} machine, empirical fit")
    assert found.verdict.deficiency == found.solution.spectrum.deficiency == 12
    assert found.verdict.null == planned(f"5.4[{machine} machine, empirical fit]").null
    first, second, *_ = steps(found)
    assert second > 1e-4 and second / first > 0.1
    assert sums_of_squares(found)[1] < 1e-15
