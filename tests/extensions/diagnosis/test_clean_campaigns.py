"""Readings of which nothing is wrong, of few positions in different planes: such designs hide much,
of which noise leaves a little.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.diagnosis.cause_search import Search
from ballplate.extensions.diagnosis.exact_values import searched_with_exact_values
from ballplate.extensions.diagnosis.tails import log_chance
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.truth import true_machine
from ballplate.simulator.readings.observed_readings import observe
from ballplate.simulator.readings.simulated import noisy_readings, on_true_machine
from ballplate.simulator.readings.true_artefacts import noisy_certificate
from numpy.typing import NDArray
from scipy.stats import beta, binom

from tests.extensions.diagnosis.designs import PLATE, experiment

QUICKSTART, CAMPAIGN = Path("designs/quickstart.yaml"), Path("designs/planning/campaign.yaml")

# Positions of an experiment, the standard uncertainty of its readings, and the machine's errors.
DESIGNS = [
    (QUICKSTART, ["z high", "x low"], "2 um", "2 um"),
    (QUICKSTART, ["z low", "y high"], "0.2 um", "2 um"),
    (QUICKSTART, ["x low", "y high"], "2 um", "2 um"),
    (QUICKSTART, ["x high", "y low"], "0.2 um", "20 um"),
    (QUICKSTART, ["z low", "x low", "y low"], "0.2 um", "2 um"),
    (QUICKSTART, ["z high", "x low", "y high"], "1 um", "5 um"),
    (QUICKSTART, ["z low", "z high", "x low", "y low"], "0.5 um", "2 um"),
    (CAMPAIGN, ["flat low", "upright"], "0.5 um", "0 um"),
    (None, ["low", "near"], "1 um", "2 um"),
    (None, ["low", "high", "near", "side"], "0.2 um", "2 um"),
]

Real = NDArray[np.float64]


def of_positions(
    file: Path | None, names: list[str], noise: str, machine: str, folder: Path
) -> Experiment:
    given = experiment(folder, PLATE) if file is None else load(file)[0]
    errors = {"kind": "random", "position": machine, "rotation": "4 urad", "seed": 3}
    if machine == "0 um":
        errors = {"kind": "zero"}
    changed = given.with_({"machine.repeatability": noise, "true_machine": errors})
    return replace(changed, positions=tuple(p for p in changed.positions if p.name in names))


def fits(given: Experiment, count: int) -> Iterator[tuple[Linearisation, Real]]:
    """Fits of faultless readings of an experiment, and the readings."""
    design = lay_out(given)
    corners = design.machine.volume.corners
    machine = true_machine(given.true_machine, design.model, *corners)
    on_truth, truth = on_true_machine(design, machine)
    for generator in np.random.default_rng(1).spawn(count):
        certificate = noisy_certificate(design, truth, generator)
        observed = observe(certificate, *noisy_readings(on_truth, truth, generator))
        solution = estimate(observed.design, observed.x)
        assert solution.status == "converged"
        yield linearised_fit(observed.design, solution), observed.x


def test_no_test_of_smooth_errors_is_significant_too_often(tmp_path: Path) -> None:
    """At a level of one in ten."""
    given, count = of_positions(*DESIGNS[0], tmp_path), 15
    significant: Counter[str] = Counter()
    for at, x in fits(given, count):
        search = Search(at, x, True)
        left = search.left
        for one, basis in zip(search.hypotheses, search.bases, strict=True):
            square, dimensions = ((basis.T @ left.residual) ** 2).sum(), basis.shape[1]
            log_p = log_chance(square, left.sum_of_squares, dimensions, left.freedom, False)
            significant[one.words] += int(log_p < np.log(0.1))
    assert significant
    for words, hits in significant.items():
        assert binom.sf(hits - 1, count, 0.1) > 1e-4, words


@pytest.mark.long
def test_faultless_campaigns_are_hardly_ever_suspected(tmp_path: Path) -> None:
    """Run with -s for the rates of the designs."""
    each, total = 200, 0
    for design in DESIGNS:
        count = 0
        for at, x in fits(of_positions(*design, tmp_path), each):
            found = searched_with_exact_values(at, x, True)
            count += bool(found and (found.found or found.scatter or found.model))
        total += count
        print(f"{', '.join(design[1])}, {design[2]}: {rate(count, each)}", flush=True)
        assert binom.sf(count - 1, each, 0.01) > 1e-3, design
    print(f"all: {rate(total, each * len(DESIGNS))}")
    assert total <= 0.01 * each * len(DESIGNS)


def rate(count: int, trials: int) -> str:
    """Suspected campaigns, with limits of 95 % confidence by Clopper and Pearson."""
    low = beta.ppf(0.025, count, trials - count + 1) if count else 0.0
    high = beta.ppf(0.975, count + 1, trials - count)
    return f"{count} of {trials}, {count / trials:.2%} ({low:.2%} to {high:.2%})"
