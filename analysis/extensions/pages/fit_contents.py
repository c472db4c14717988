"""Contents of the page of a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.extensions.reliability.redundancy import reliability_of
from ballplate.presentation import box_edges, projection
from ballplate.results import ParameterEstimate, labels, reading_residuals
from ballplate.simulator.design import measured
from ballplate.simulator.estimation import Solution
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.readings import ObservedReadings

from .fit_page import FitContents, PlateResiduals
from .page_facts import assumptions, target_in_words, unjudged


def fit_contents(
    experiment: Experiment,
    observed: ObservedReadings,
    solution: Solution,
    data: Mapping[str, Any],
    estimates: Sequence[ParameterEstimate],
    has_scatter: bool,
    untested: str,
) -> FitContents:
    """Return the contents for a fit of an experiment with its plain `data`; residuals of exact
    readings are rounding and not drawn. `untested` states why there was no test for gross errors.
    """
    design = observed.design
    volume = design.machine.volume
    _, towards = projection(design.dimension)
    edges, _ = box_edges(volume.lower, volume.upper, towards)
    reason = unjudged(design)
    judged = None
    if not reason and solution.status == "converged":
        is_estimated = data["sigma_is_estimated"]
        judged = reliability_of(
            design, sigma_is_estimated=is_estimated, experiment=experiment
        ).to_dict()
    how = "estimated from the residuals" if data["sigma_is_estimated"] else "as given"
    files = list(dict.fromkeys(Path(mark.file).name for mark in observed.marks))
    facts = assumptions(experiment, len(design.model.parameters))
    facts.insert(1, ("Readings", f"{len(observed.x)} from {', '.join(files) or 'a table'}"))
    facts.append(("Sigma", f"{how}: it multiplies all stated uncertainties"))
    return FitContents(
        experiment.title,
        data,
        {name: estimate.kind for name, estimate in zip(labels(estimates), estimates, strict=True)},
        judged,
        reason,
        untested or ("" if data["degrees_of_freedom"] > 0 else "there is no redundancy"),
        _residuals(observed, solution, data["sigma"], has_scatter),
        edges,
        target_in_words(experiment),
        (experiment.source.name, *files),
        facts,
    )


def _residuals(
    observed: ObservedReadings, solution: Solution, sigma: float, has_scatter: bool
) -> PlateResiduals:
    design = observed.design
    names = design.positions.names, design.probes.names
    if solution.status != "converged":
        none = np.zeros((0, design.dimension))
        return PlateResiduals(none, none, none, np.zeros(0, int), np.zeros(0, int), *names)
    readings, values, standardised = reading_residuals(design, solution, observed.x)
    is_read = measured(design, readings)
    shown = np.where(is_read, standardised / sigma if has_scatter else 0.0, np.nan)
    return PlateResiduals(
        observed.x[design.plate_readings],
        np.where(is_read, values, np.nan),
        shown,
        readings.position,
        readings.probe,
        *names,
    )
