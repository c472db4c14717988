"""Common or separate sigmas of the readings and of prior maps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from ballplate.presentation import Data, finite, number, picked
from ballplate.results import freedom_words
from ballplate.simulator.design import Design, Priors
from ballplate.simulator.estimation import (
    Solution,
    as_drawn,
    estimate,
    implied_count,
    iterate,
    linearised_fit,
)
from ballplate.simulator.experiment import LEAST_SIGMA, EarlierCampaign, Experiment
from ballplate.simulator.machines import Array
from ballplate.simulator.readings import ObservedReadings

# Level of the two-sided F-test of two sigmas, as Bozivich, Bancroft and Hartley (1956) recommend
# before variances are pooled: smaller ones miss more differences of a few tenths, and intervals
# become too short where one campaign has few degrees of freedom.
LEVEL = 0.25


@dataclass(frozen=True)
class ScaledMap:
    """A prior map with the sigma of its `campaign`, compared with that of the readings by a
    two-sided `p_value`, NaN without a test.

    `is_common` maps contribute to the common sigma; others are scaled with their own. `reason`
    states why there is no test.
    """

    campaign: EarlierCampaign
    p_value: float
    is_common: bool
    reason: str = ""

    @property
    def words(self) -> str:
        campaign = self.campaign
        sigma = f"{number(campaign.estimate)} ({freedom_words(campaign.degrees_of_freedom)})"
        result = "is scaled with that"
        if self.is_common:
            result = (
                f"has the common sigma, its S^2 of {number(campaign.sum_of_squares or 0.0)} added"
            )
        test = self.reason
        if not test:
            verb = "agree" if self.is_common else "differ"
            test = f"they {verb}, p = {number(self.p_value, 2)} against a level of {LEVEL:g}"
        return f"sigma of {campaign.file}: {sigma}; {test}: the map {result}"


@dataclass(frozen=True, eq=False)
class CampaignSigmas:
    """The estimate with prior maps, `observed` as weighted in it, and the `sum_of_squares` and
    `freedom` of sigma.

    `own` is sigma of the readings without maps, with `own_freedom`. `degrees_of_freedom` are the
    fewest of all sigmas in uncertainties, and `ratios` those of maps to that of readings.
    """

    observed: ObservedReadings
    solution: Solution
    sum_of_squares: float
    freedom: int
    degrees_of_freedom: int
    own: float
    own_freedom: int
    maps: tuple[ScaledMap, ...]
    ratios: Mapping[EarlierCampaign, float]

    def lines(self) -> list[str]:
        """The sigmas and the choice as lines of text."""
        if not self.own_freedom:
            return [scaled.words for scaled in self.maps]
        sigma = f"{number(self.own)} ({freedom_words(self.own_freedom)})"
        words = (scaled.words for scaled in self.maps)
        return [f"sigma of the readings without maps: {sigma}", *words]

    def to_dict(self) -> Data:
        return {
            "sigma_without_maps": finite(self.own),
            "degrees_of_freedom_without_maps": self.own_freedom,
            "level": LEVEL,
            "maps": [
                {
                    **picked(one.campaign, "file", "sigma", "degrees_of_freedom", "sum_of_squares"),
                    "p_value": finite(one.p_value),
                    "common": one.is_common,
                }
                for one in self.maps
            ],
        }


def campaign_sigmas(experiment: Experiment, observed: ObservedReadings) -> CampaignSigmas | None:
    """Return the estimate with one sigma for readings and maps, or with separate ones if an F-test
    finds a difference; None without maps.

    With a common sigma a map replaces its campaign's readings: rows at their stated uncertainties,
    its S^2 and its degrees of freedom.
    """
    campaigns = experiment.earlier_campaigns
    if not campaigns:
        return None
    design, x = observed.design, observed.x
    ratios = dict.fromkeys(campaigns, 1.0)
    joint = weighted(design, experiment, ratios)
    solution = estimate(joint, x)
    own_sigma, own_freedom = _without_maps(joint, experiment, x, solution)
    maps = tuple(compared(campaign, own_sigma, own_freedom) for campaign in campaigns)
    pooled = [campaign.campaign for campaign in maps if campaign.is_common]
    squares = sum(campaign.sum_of_squares or 0.0 for campaign in pooled)
    freedom = sum(campaign.degrees_of_freedom for campaign in pooled)
    separate = [campaign.campaign for campaign in maps if not campaign.is_common]
    if separate:
        squares, freedom = squares + own_freedom * own_sigma**2, freedom + own_freedom
        sigma = math.sqrt(squares / freedom) if freedom else 1.0
        ratios |= {campaign: campaign.estimate / sigma for campaign in separate}
        joint = weighted(design, experiment, ratios)
        solution = estimate(joint, x)
    elif solution.status == "converged":
        squares += solution.factor.sum_of_squares
        freedom += linearised_fit(joint, solution).degrees_of_freedom
    limits = (
        campaign.degrees_of_freedom for campaign in separate if campaign.sum_of_squares is not None
    )
    fewest = min([freedom, *limits])
    return CampaignSigmas(
        replace(observed, design=joint),
        solution,
        squares,
        freedom,
        fewest,
        own_sigma,
        own_freedom,
        maps,
        ratios,
    )


def weighted(
    design: Design, experiment: Experiment, sigmas: Mapping[EarlierCampaign, float]
) -> Design:
    """Return an experiment's design with maps weighted by their campaigns' `sigmas`."""
    priors = design.of(Priors)
    uncertainty = priors.uncertainty.copy()
    scaled_priors = with_sigmas(experiment, sigmas).priors
    uncertainty[: len(scaled_priors)] = [prior.standard_uncertainty for prior in scaled_priors]
    return design.observed(replace(priors, uncertainty=uncertainty))


def with_sigmas(experiment: Experiment, sigmas: Mapping[EarlierCampaign, float]) -> Experiment:
    """Return an experiment with maps weighted by their campaigns' `sigmas`."""
    priors = (
        prior
        if prior.share is None
        else replace(
            prior, standard_uncertainty=prior.share.uncertainty(sigmas[prior.share.campaign])
        )
        for prior in experiment.priors
    )
    return replace(experiment, priors=tuple(priors))


def _without_maps(
    design: Design, experiment: Experiment, x: Array, solution: Solution
) -> tuple[float, int]:
    """Return sigma and degrees of freedom of the readings without maps, iterated from the estimate
    with maps.
    """
    if solution.status != "converged":
        return math.nan, 0
    priors = design.of(Priors)
    is_chosen = np.ones(len(priors), bool)
    is_chosen[: len(experiment.priors)] = [prior.share is None for prior in experiment.priors]
    without = design.observed(priors.select(is_chosen))
    drawn = as_drawn(without)
    fit = iterate(without, x, solution.state, held_spectrum=drawn)
    freedom = without.observation_count - without.parameter_count + drawn.deficiency
    freedom -= implied_count(without, fit.state)
    if fit.status != "converged" or freedom <= 0:
        return math.nan, 0
    return math.sqrt(fit.factor.sum_of_squares / freedom), freedom


def compared(campaign: EarlierCampaign, own_sigma: float, own_freedom: int) -> ScaledMap:
    """Return a map compared with the readings by an F-test of both sigmas."""
    from scipy.special import fdtr, fdtrc

    if campaign.sum_of_squares is None:
        return ScaledMap(campaign, math.nan, False, "its residuals are rounding")
    if not campaign.degrees_of_freedom or not own_freedom:
        return ScaledMap(campaign, math.nan, True, "no test for want of degrees of freedom")
    if own_sigma < LEAST_SIGMA:
        return ScaledMap(campaign, math.nan, True, "no test, as the readings have no noise")
    freedoms, ratio = (
        (campaign.degrees_of_freedom, own_freedom),
        (campaign.estimate / own_sigma) ** 2,
    )
    p = 2.0 * float(min(fdtr(*freedoms, ratio), fdtrc(*freedoms, ratio)))
    return ScaledMap(campaign, p, p >= LEVEL)
