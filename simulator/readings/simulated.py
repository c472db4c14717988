"""Readings of an experiment's true machine."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.design.arrays import Design, Readings, State
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.protocol import Array, ErrorModel
from ballplate.simulator.machines.truth import true_machine

from .generate import (
    NoReadingError,
    exact_readings,
    noisy_readings,
    on_true_machine,
    true_artefacts,
    true_influences,
)


@dataclass(frozen=True)
class Simulated:
    """Scale readings `x` (readings, d) in metres of the true artefacts on the true machine, `truth`
    on `model`.

    `generator` continues after the readings; None without noise.
    """

    design: Design
    truth: State
    model: ErrorModel
    readings: Readings
    x: Array
    seed: int
    generator: np.random.Generator | None


def on_stated_machine(experiment: Experiment, design: Design) -> tuple[Design, State]:
    """Return an experiment's nominal design on the true machine that its file states."""
    machine = true_machine(experiment.true_machine, design.model, *design.machine.volume.corners)
    return on_true_machine(design, machine)


def too_large(experiment: Experiment, error: Exception) -> ExperimentError:
    """Return the error of a true machine whose errors prevent readings or a fit."""
    return experiment.refused(("true_machine",), f"{error}; state smaller ones")


def simulated_readings(
    experiment: Experiment, seed: int | None = None, exact: bool = False
) -> Simulated:
    """Return noisy readings of the true machine, of artefacts that differ from their certificates.

    `seed` replaces that of the experiment. `exact` omits all noise and uses nominal artefacts.

    :raises ExperimentError: the true machine's errors are too large for a reading to exist.
    """
    design = lay_out(experiment)
    on_truth, truth = on_stated_machine(experiment, design)
    chosen = experiment.seed if seed is None else seed
    generator = None if exact else np.random.default_rng(np.random.SeedSequence(chosen))
    try:
        if generator is None:
            readings, x = exact_readings(on_truth, truth)
        else:
            balls = true_artefacts(design, generator)
            truth = replace(truth, balls=balls, influences=true_influences(design, generator))
            readings, x = noisy_readings(on_truth, truth, generator)
    except NoReadingError as error:
        raise too_large(experiment, error) from None
    return Simulated(design, truth, on_truth.model, readings, x, chosen, generator)
