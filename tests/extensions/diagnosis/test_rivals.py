"""No cause is named whose fit is no better than the file's, or worse than that of a rival.

Figures are those of fits of files that state the causes, made by the public interface.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ballplate.results.fitting import fit
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from scipy.stats import chi2

from tests.extensions.diagnosis.rivals import (
    DESIGNS,
    ERRORS,
    Refit,
    campaign,
    loaded,
    named_causes,
    random_designs,
    refit_of,
)

# Twice the logarithm of odds of a thousand, and two units for what is linearised.
CLEARLY = 2.0 * np.log(1000.0) + 2.0


def check(given: Experiment, error: str, seed: int) -> int:
    """Compare all that is named with the file and, of a single cause, with its rivals; return how
    many names were compared.
    """
    case = campaign(given, error, seed)
    found = fit(given, case.observed)
    named = named_causes(found)
    first = {one[0] for one in named}
    refits = {
        words: refit
        for words in dict.fromkeys(words for one in named for words in one)
        if (refit := refit_of(given, case, words)) is not None
    }
    total, freedom = found.sum_of_squares, found.degrees_of_freedom
    for words, refit in refits.items():
        # The noise is as stated.
        fallen = total - refit.sum_of_squares
        assert chi2.sf(fallen, refit.parameters) < 1e-3, (case.words, words, fallen)
    if len(named) == 1 and refits:
        chains = [f"the arrangement of the axes is {name}" for name in ARRANGEMENTS]
        probes = [f"offset of probe {name}" for name in case.observed.design.probes.names]
        fits = [refit_of(given, case, words) for words in chains + probes]
        rivals = [one for one in [*fits, *refits.values()] if one is not None]
        variance = max(min(one.sum_of_squares for one in rivals) / freedom, 1.0)

        def criterion(one: Refit) -> float:
            return one.sum_of_squares / variance + 2.0 * one.parameters

        least = min(criterion(one) for one in rivals)
        for words in first & set(refits):
            assert criterion(refits[words]) <= least + CLEARLY, (case.words, words)
    return len(refits)


@pytest.mark.parametrize(
    ("name", "error"),
    list(zip(DESIGNS, ("tip", "tip 8 µm in z", "reading", "chain", "wave"), strict=True)),
)
def test_what_is_named_beats_the_file_and_its_rivals(name: str, error: str, tmp_path: Path) -> None:
    check(loaded(tmp_path, DESIGNS[name]), error, 3)


@pytest.mark.long
@pytest.mark.parametrize("error", ERRORS)
@pytest.mark.parametrize("name", DESIGNS)
def test_each_error_in_each_design(name: str, error: str, tmp_path: Path) -> None:
    for seed in range(4):
        check(loaded(tmp_path, DESIGNS[name]), error, seed)


@pytest.mark.long
@pytest.mark.parametrize("number", range(4))
def test_what_is_named_in_random_designs(number: int, tmp_path: Path) -> None:
    ((_, given),) = random_designs(tmp_path, 1, 100 * number)
    assert sum(check(given, error, number) for error in ERRORS) > 0
