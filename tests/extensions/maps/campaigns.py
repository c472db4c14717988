"""Simulated campaigns of one machine with one plate: readings and certificates, each with its own
noise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from ballplate.extensions.maps.compared_maps import ComparedMap, map_of_fit
from ballplate.results.fits import Fit
from ballplate.results.fitting import fit as fit_observed
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.machines.truth import true_machine
from ballplate.simulator.readings.observed_readings import observe
from ballplate.simulator.readings.simulated import noisy_readings, on_true_machine
from ballplate.simulator.readings.true_artefacts import noisy_certificate


def simulated_fit(
    experiment: Experiment,
    seed: int,
    certificate_seed: int | None = None,
    changed: Array | None = None,
) -> Fit:
    """The fit of a campaign with the plate as drawn; `changed` is added to the true machine's
    parameters.
    """
    design = lay_out(experiment)
    volume = design.machine.volume.corners
    on_truth, truth = on_true_machine(
        design, true_machine(experiment.true_machine, design.model, *volume)
    )
    truth = truth if changed is None else replace(truth, a=truth.a + changed)
    readings, x = noisy_readings(on_truth, truth, _generator(seed))
    of_certificate = _generator(10**6 + (seed if certificate_seed is None else certificate_seed))
    certified = noisy_certificate(design, truth, of_certificate, on_truth.model)
    return fit_observed(experiment, observe(certified, readings, x))


def simulated_map(
    experiment: Experiment,
    seed: int,
    certificate_seed: int | None = None,
    changed: Array | None = None,
) -> ComparedMap:
    """The map of a simulated campaign."""
    return map_of_fit(simulated_fit(experiment, seed, certificate_seed, changed), str(seed))


def _generator(seed: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed))
