"""Views and pages of predictions and fits, as services for the kernel."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ballplate.simulator.estimation import linearise

from .embedded import View
from .views import judged_pictures, position_picture, residual_pictures

if TYPE_CHECKING:
    from ballplate.results import Fit, Prediction


def design_view(prediction: Prediction) -> View:
    """A design in space, with what its prediction knows."""
    experiment = prediction.experiment
    target = None if experiment is None else experiment.target_uncertainty
    pictures = judged_pictures(linearise(prediction.design), prediction.verdict, target)
    return View(prediction.label, prediction.title, pictures)


def fit_view(fit: Fit) -> View:
    """A fit in space; of one that has failed the positions alone."""
    if fit.estimated is None or not fit.converged:
        return View(fit.label, fit.title, (position_picture(fit.design),))
    target = None if fit.experiment is None else fit.experiment.target_uncertainty
    # Without scatter residuals are mere rounding.
    residuals = () if fit.without_scatter else residual_pictures(fit.observed, fit.solution)
    linearisation = fit.estimated.at
    pictures = judged_pictures(linearisation, fit.verdict, target, fit.sigma, residuals)
    return View(fit.label, fit.title, pictures)


def fit_page_text(fit: Fit) -> str:
    """The page of a fit.

    :raises ValueError: it does not know its experiment.
    """
    if fit.experiment is None:
        raise ValueError("the fit holds no experiment, which a page names; fit it again")
    # Loaded only now: views need no other extension.
    from .fit_contents import fit_contents
    from .fit_page import fit_page

    contents = fit_contents(
        fit.experiment,
        fit.observed,
        fit.solution,
        fit.to_dict(),
        fit.estimates,
        not fit.without_scatter,
        fit.untested,
    )
    return fit_page(replace(contents, caveat=fit.lack_of_fit.caveat))
