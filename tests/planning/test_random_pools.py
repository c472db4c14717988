"""Choices from pools at random: never better than their bound, worth what the written file is worth, best of all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analysis.planning.campaign import Campaign, Request, campaign
from analysis.planning.criteria import CriterionName
from analysis.planning.experiment_file import experiment_text
from analysis.planning.schedule import run_sheet
from analysis.study import plan
from simulator.design import nominal_state
from simulator.estimation.covariance import covariance, spectrum
from simulator.estimation.elimination import eliminate
from simulator.estimation.parameters import shared_layout
from simulator.experiment.load import load
from simulator.experiment.messages import ExperimentError
from simulator.experiment.model import Experiment
from simulator.layout import lay_out

from .random_pools import RandomPool, random_pool


def by_run(experiment: Experiment, name: CriterionName) -> float:
    """The criterion by what `run` computes, infinite where something is undetermined."""
    kind, _, largest = name.partition("-")
    if kind in ("U6", "U5", "tasks"):
        found = plan(experiment)
        if found.verdict.deficiency:
            return np.inf
        return getattr(found.quantities[kind], "maximum" if largest else "average")
    design = lay_out(experiment)
    layout = shared_layout(design)
    factor = eliminate(design, layout, nominal_state(design))
    values = spectrum(factor)
    if values.deficiency:
        return np.inf
    own = covariance(design, factor, values).shared[layout.model] / layout.scale[layout.model, None]
    variances = np.linalg.eigvalsh(own @ own.T)
    return {
        "A": np.sqrt(variances.mean()),
        "D": np.exp(0.5 * np.log(variances).mean()),
        "E": np.sqrt(variances[-1]),
        "condition": np.sqrt(variances[-1] / variances[0]),
    }[kind]
