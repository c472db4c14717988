"""Simulated campaigns on machines of six kinds, whose numbers of coefficients are known."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import ballplate as bp
import numpy as np
from ballplate.extensions.judgement.rungs import (
    LadderModel,
    empirical_rung,
    kinematic_rung,
    with_model,
)
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.kinematic import KinematicModel
from ballplate.simulator.machines.protocol import ErrorModel
from ballplate.simulator.readings.observed_readings import ObservedReadings, observe
from ballplate.simulator.readings.simulated import noisy_readings
from ballplate.simulator.readings.true_artefacts import noisy_certificate
from numpy.typing import NDArray

Real = NDArray[np.float64]

# Positional and rotational coefficients, or those of an empirical model.
KINDS: tuple[tuple[int, int] | int, ...] = ((2, 1), (2, 2), (3, 3), (4, 4), (5, 5), 3)


@lru_cache
def quickstart(**changed: str) -> Experiment:
    return bp.quickstart().with_(changed) if changed else bp.quickstart()


@lru_cache
def laid_out() -> Design:
    return lay_out(quickstart())


@lru_cache
def true_model(kind: int) -> LadderModel:
    given = KINDS[kind]
    if isinstance(given, int):
        return empirical_rung(quickstart(), given)
    return kinematic_rung(quickstart(), *given)


@lru_cache
def uncertainties(kind: int) -> Real:
    at = linearise(with_model(laid_out(), true_model(kind).model))
    return np.sqrt((at.shared[at.layout.model] ** 2).sum(axis=1))


def last_ones(model: LadderModel) -> Real:
    """Which coefficients are the last of a function; of an empirical model all."""
    chain, last = model.model, np.zeros(model.count, bool)
    if not isinstance(chain, KinematicModel):
        return np.ones(model.count, bool)
    last[[own.stop - 1 for own in chain.slices.values() if own.stop > own.start]] = True
    return last


def campaign(kind: int, number: int, largest: float = 8.0) -> ObservedReadings:
    """Readings of a machine of a kind whose last coefficients are 5 to `largest` times their
    standard uncertainty, and the others ten times it, all drawn.
    """
    generator = np.random.default_rng(np.random.SeedSequence(20, spawn_key=(kind, number)))
    model, u = true_model(kind), uncertainties(kind)
    a = 10.0 * u * generator.standard_normal(len(u))
    sign = np.where(generator.random(len(u)) < 0.5, -1.0, 1.0)
    a = np.where(last_ones(model), sign * u * generator.uniform(5.0, largest, len(u)), a)
    return readings_of(model.model, a, generator)


def readings_of(
    model: ErrorModel, a: Real, generator: np.random.Generator, design: Design | None = None
) -> ObservedReadings:
    design = laid_out() if design is None else design
    on_truth = with_model(design, model)
    truth = replace(nominal_state(on_truth), a=a)
    drawn = noisy_certificate(design, truth, generator, model)
    return observe(drawn, *noisy_readings(on_truth, truth, generator))
