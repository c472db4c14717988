"""One wrong offset, sign or exchange of probes is named, before patterns of
micrometres.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.laboratory.wrong_offsets import (
    WrongOffsets,
    offset_shifts,
    with_offsets,
)
from ballplate.extensions.reliability import refits
from ballplate.extensions.reliability.refits import diagnosis_with_refits
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit

from tests.extensions.reliability.offsets import (
    DESIGNS,
    Mistake,
    Plan,
    drawn,
    mistakes,
    outcome,
    plan,
    rates,
    sentences,
)

OBLIQUE = "three probes in each position"


def mistake(given: Plan, words: str) -> Mistake:
    (found,) = (one for one in mistakes(given.design) if one.words == words)
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("designs")


@pytest.mark.parametrize(
    ("name", "is_uncertain", "words"),
    [
        ("few balls", False, "z of left by 0.3 mm"),
        ("few balls", False, "x of right by -2 mm"),
        ("few balls", False, "z of right by 10 mm"),
        ("few balls", True, "right and back"),
        (OBLIQUE, True, "sign of y of c"),
    ],
)
def test_a_mistake_in_the_offsets_is_named(
    name: str, is_uncertain: bool, words: str, folder: Path
) -> None:
    given = plan(name, is_uncertain, folder)
    wrong = mistake(given, words)
    assert outcome(wrong, sentences(given, wrong, 5)) == "right"


@pytest.mark.parametrize("is_uncertain", [False, True], ids=["exact", "uncertain"])
def test_what_offsets_leave_is_what_an_estimate_with_them_leaves(
    is_uncertain: bool, folder: Path
) -> None:
    """The quadratic form of all offsets, against an estimate with others."""
    given = plan("few balls", is_uncertain, folder)
    generator = np.random.default_rng(2)
    true = generator.uniform(-1e-3, 1e-3, given.design.probes.offsets.shape)
    design, x = drawn(given.design, true, 3)
    free = refits._free_offsets(design, x)
    assert free is not None
    for size in (0.0, 1e-6, 1e-4):
        change = true + size * generator.standard_normal(true.shape)
        expected = estimate(with_offsets(design, change), x)
        assert expected.status == "converged"
        left = free.remaining(WrongOffsets((1, 2), change))
        assert left == pytest.approx(expected.factor.sum_of_squares, rel=5e-3)
        assert left > free.least


def test_differences_of_offsets_are_those_of_the_readings(folder: Path) -> None:
    given = plan(OBLIQUE, False, folder)
    change = np.random.default_rng(1).uniform(-0.05, 0.05, given.design.probes.offsets.shape)
    design, x = drawn(given.design, change, 4)
    expected = change - change.mean(axis=0)
    shifts = offset_shifts(design, x)
    np.testing.assert_allclose(shifts - shifts.mean(axis=0), expected, atol=1e-4)


def test_nothing_is_estimated_anew_where_nothing_is_unexplained(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = plan("few balls", False, folder)
    monkeypatch.setattr(refits, "estimate", None)
    change = np.zeros(given.design.probes.offsets.shape)
    for size in (0.0, 5e-6):
        change[1, 2] = size
        design, x = drawn(given.design, change, 6)
        at = linearised_fit(design, estimate(design, x))
        found = diagnosis_with_refits(at, x, at.degrees_of_freedom, True)
        assert len(found.suspects) == (size > 0.0) and not found.refit


@pytest.mark.long
@pytest.mark.parametrize("is_uncertain", [False, True], ids=["exact", "uncertain"])
@pytest.mark.parametrize("name", DESIGNS)
def test_rates_of_naming_one_wrong_offset(
    name: str, is_uncertain: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = rates(name, is_uncertain, tmp_path)
    with capsys.disabled():
        print("", name, *found.lines(), *found.failures, sep="\n")
    assert found.every["wrong"] <= 0.02 * found.every.total()
    assert found.large["right"] >= 0.9 * found.large.total() > 0.0
