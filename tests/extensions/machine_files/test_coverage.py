"""From simulated campaigns by way of map files to corrected lengths: their expanded uncertainties
hold the true lengths as often as they say.
"""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.machines.truth import true_machine

from tests.extensions.machine_files.kinds import IN_PLANE

POINTS, PAIRS = 40, 60
# Of a normal distribution within two standard deviations.
EXPECTED = 0.9545


def shares_covered(
    experiment: bp.Experiment, campaigns: int, folder: Path, with_repeatability: bool
) -> np.ndarray:
    """For each of so many campaigns the share of corrected lengths whose U holds the true one."""
    design = lay_out(experiment)
    truth = true_machine(experiment.true_machine, design.model, *experiment.machine.volume.corners)
    generator = np.random.default_rng(5)
    volume, offset = design.machine.volume, design.probes.offsets[:1]
    shares = []
    for seed in range(campaigns):
        fit = bp.fit(experiment, bp.simulate(experiment, seed))
        path = folder / f"map{seed % 2}.yaml"
        bp.write_map(fit.to_map(), path)
        x = generator.uniform(volume.lower, volume.upper, (POINTS, len(volume.lower)))
        pairs = generator.permuted(np.tile(np.arange(POINTS), (PAIRS, 1)), axis=1)[:, :2]
        places = x + truth.model.error(x, truth.a, np.repeat(offset, POINTS, axis=0))
        apart = places[pairs[:, 0]] - places[pairs[:, 1]]
        noise = generator.normal(size=x.shape) * design.machine.repeatability
        found = bp.correct(
            path,
            x + noise if with_repeatability else x,
            lengths=[(int(i), int(j)) for i, j in pairs],
            with_repeatability=with_repeatability,
        )
        assert found.coverage_factor == 2.0
        values = np.array([(one.value, 2.0 * one.standard_uncertainty) for one in found.lengths])
        errors = values[:, 0] - np.linalg.norm(apart, axis=1)
        shares.append(float((np.abs(errors) <= values[:, 1]).mean()))
    return np.array(shares)


def test_a_few_campaigns_cover_what_they_state(tmp_path: Path) -> None:
    experiment = bp.experiment(
        IN_PLANE
        | {
            "error_model": {"kind": "metric", "scale": "split"},
            "true_machine": {
                "kind": "coefficients",
                "values": {"alpha": "20 urad", "gamma": "-10 ppm"},
            },
        }
    )
    shares = shares_covered(experiment, 16, tmp_path, with_repeatability=False)
    error = shares.std(ddof=1) / np.sqrt(len(shares))
    # Four standard errors of the mean over campaigns, which the lengths of one have in common.
    assert abs(shares.mean() - EXPECTED) < 4.0 * max(error, 0.01)
    # Half the uncertainty would cover two thirds only.
    assert shares.mean() > 0.85


@pytest.mark.long
@pytest.mark.parametrize("with_repeatability", [False, True])
def test_a_thousand_campaigns_cover_what_they_state(
    with_repeatability: bool, tmp_path: Path
) -> None:
    shares = shares_covered(bp.quickstart(), 1000, tmp_path, with_repeatability)
    error = shares.std(ddof=1) / np.sqrt(len(shares))
    print(f"covered {shares.mean():.4f} +- {error:.4f}")
    assert abs(shares.mean() - EXPECTED) < 3.0 * error
    assert error < 0.005
