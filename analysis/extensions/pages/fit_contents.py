"""Contents of the page of a fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from ballplate.extensions.diagnosis.redundancy import reliability_of
from ballplate.results import Fit, labels, reading_residuals
from ballplate.simulator.design import measured

from .design_contents import part_sections
from .fit_page import FitContents, PlateResiduals, fit_page
from .page_facts import assumptions, target_in_words, unjudged


def page_of_fit(fit: Fit) -> str:
    """Return the page of a fit; residuals of exact readings are rounding and not drawn.

    :raises ValueError: it does not know its experiment.
    """
    experiment, observed, data = fit.experiment, fit.observed, fit.to_dict()
    if experiment is None:
        raise ValueError("the fit holds no experiment, which a page names; fit it again")
    design = observed.design
    reason = unjudged(design)
    judged = None
    if not reason and fit.converged:
        is_estimated = data["sigma_is_estimated"]
        judged = reliability_of(
            design, sigma_is_estimated=is_estimated, experiment=experiment
        ).to_dict()
    how = "estimated from the residuals" if data["sigma_is_estimated"] else "as given"
    files = list(dict.fromkeys(Path(mark.file).name for mark in observed.marks))
    facts = assumptions(experiment, len(design.model.parameters))
    facts.insert(1, ("Readings", f"{len(observed.x)} from {', '.join(files) or 'a table'}"))
    facts.append(("Sigma", f"{how}: it multiplies all stated uncertainties"))
    names = labels(fit.estimates)
    contents = FitContents(
        experiment.title,
        data,
        {name: estimate.kind for name, estimate in zip(names, fit.estimates, strict=True)},
        judged,
        reason,
        fit.untested or ("" if data["degrees_of_freedom"] > 0 else "there is no redundancy"),
        _residuals(fit),
        target_in_words(experiment),
        (experiment.source.name, *files),
        facts,
        fit.lack_of_fit.caveat,
        part_sections(fit.design, fit.quantities),
    )
    return fit_page(contents)


def _residuals(fit: Fit) -> PlateResiduals:
    design = fit.observed.design
    names = design.positions.names, design.probes.names
    if not fit.converged:
        none = np.zeros((0, design.dimension))
        return PlateResiduals(none, np.zeros(0, int), np.zeros(0, int), *names)
    readings, _, standardised = reading_residuals(design, fit.solution, fit.observed.x)
    is_read = measured(design, readings)
    shown = np.where(is_read, 0.0 if fit.without_scatter else standardised / fit.sigma, np.nan)
    return PlateResiduals(shown, readings.position, readings.probe, *names)
