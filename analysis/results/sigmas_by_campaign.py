"""One sigma for the readings and the maps that are prior knowledge, or one for each campaign."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from ballplate.presentation.formatting import finite, number, picked
from ballplate.results.adjustments import freedom_words
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.estimation.gauss_newton import (
    Solution,
    as_drawn,
    estimate,
    gauss_newton,
    linearised_fit,
)
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.maps.fitted_map import LEAST_SIGMA
from ballplate.simulator.maps.map_prior import EarlierCampaign
from ballplate.simulator.readings.observed_readings import ObservedReadings

# Level of the two-sided F-test of two sigmas, as Bozivich, Bancroft and Hartley (1956) recommend
# before variances are pooled: smaller ones miss more differences of a few tenths, and intervals
# become too short where one campaign has few degrees of freedom.
LEVEL = 0.25

NOT_STATED = "the map is older and does not state its sum of squares"


@dataclass(frozen=True)
class ScaledMap:
    """A map that is prior knowledge, with the sigma of its `campaign` and how that compares with
    the one of the readings alone: the two-sided `p_value`, NaN where there is no test.

    `is_common` where it takes part in the common sigma; otherwise its information is scaled with
    its own. `reason` says why there is no test.
    """

    campaign: EarlierCampaign
    p_value: float
    is_common: bool
    reason: str = ""

    @property
    def words(self) -> str:
        campaign = self.campaign
        own = f"{number(campaign.estimate)} ({freedom_words(campaign.degrees_of_freedom)})"
        result = "is scaled with that"
        if self.is_common:
            result = (
                f"has the common sigma, its S^2 of {number(campaign.sum_of_squares or 0.0)} added"
            )
        test = self.reason
        if not test:
            verb = "agree" if self.is_common else "differ"
            test = f"they {verb}, p = {number(self.p_value, 2)} against a level of {LEVEL:g}"
        lack = "" if campaign.is_stated else f"; {NOT_STATED}"
        return f"sigma of {campaign.file}: {own}; {test}: the map {result}{lack}"


@dataclass(frozen=True, eq=False)
class CampaignSigmas:
    """The estimate with maps as prior knowledge, `observed` with these weighted as it was, and
    where `sigma` comes from: `sum_of_squares` with `freedom`.

    `own` is sigma of the readings without any map, with `own_freedom`. `degrees_of_freedom` are the
    fewest of all sigmas that uncertainties rest on, and `ratios` those of maps to that of readings.
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
            return [one.words for one in self.maps]
        own = f"{number(self.own)} ({freedom_words(self.own_freedom)})"
        return [f"sigma of the readings without maps: {own}", *(one.words for one in self.maps)]

    def to_dict(self) -> dict[str, Any]:
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
    """The estimate with one sigma for readings and maps, or with separate ones where an F-test says
    that they differ; None without any map.

    With a common sigma a map is what its campaign's readings are: rows at their stated
    uncertainties, its S^2 and its degrees of freedom.
    """
    campaigns = experiment.earlier_campaigns
    if not campaigns:
        return None
    design, x = observed.design, observed.x
    ratios = dict.fromkeys(campaigns, 1.0)
    joint = weighted(design, experiment, ratios)
    solution = estimate(joint, x)
    own, own_freedom = _without_maps(joint, experiment, x, solution)
    maps = tuple(compared(one, own, own_freedom) for one in campaigns)
    pooled = [one.campaign for one in maps if one.is_common]
    squares = sum(one.sum_of_squares or 0.0 for one in pooled)
    freedom = sum(one.degrees_of_freedom for one in pooled)
    separate = [one.campaign for one in maps if not one.is_common]
    if separate:
        squares, freedom = squares + own_freedom * own**2, freedom + own_freedom
        sigma = math.sqrt(squares / freedom) if freedom else 1.0
        ratios |= {one: one.estimate / sigma for one in separate}
        joint = weighted(design, experiment, ratios)
        solution = estimate(joint, x)
    elif solution.status == "converged":
        squares += solution.factor.sum_of_squares
        freedom += linearised_fit(joint, solution).degrees_of_freedom
    limits = (one.degrees_of_freedom for one in separate if one.sum_of_squares is not None)
    fewest = min([freedom, *limits])
    return CampaignSigmas(
        replace(observed, design=joint),
        solution,
        squares,
        freedom,
        fewest,
        own,
        own_freedom,
        maps,
        ratios,
    )


def weighted(
    design: Design, experiment: Experiment, sigmas: Mapping[EarlierCampaign, float]
) -> Design:
    """The design of an experiment with each map weighted as if sigma of its campaign were that."""
    priors = design.of(Priors)
    uncertainty = priors.uncertainty.copy()
    known = with_sigmas(experiment, sigmas).priors
    uncertainty[: len(known)] = [prior.standard_uncertainty for prior in known]
    return design.observed(replace(priors, uncertainty=uncertainty))


def with_sigmas(experiment: Experiment, sigmas: Mapping[EarlierCampaign, float]) -> Experiment:
    """The experiment with each map weighted as if sigma of its campaign were that."""
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
    """Sigma of the readings, and what is known beside them, without any map, and its degrees of
    freedom; found from the estimate with the maps.
    """
    if solution.status != "converged":
        return math.nan, 0
    priors = design.of(Priors)
    kept = np.ones(len(priors), bool)
    kept[: len(experiment.priors)] = [one.share is None for one in experiment.priors]
    alone = design.observed(priors.select(kept))
    drawn = as_drawn(alone)
    found = gauss_newton(alone, x, solution.state, held=drawn)
    freedom = alone.observation_count - alone.parameter_count + drawn.deficiency
    if found.status != "converged" or freedom <= 0:
        return math.nan, 0
    return math.sqrt(found.factor.sum_of_squares / freedom), freedom


def compared(campaign: EarlierCampaign, own: float, own_freedom: int) -> ScaledMap:
    """A map against the readings alone, by an F-test of both sigmas."""
    from scipy.special import fdtr, fdtrc

    if campaign.sum_of_squares is None:
        return ScaledMap(campaign, math.nan, False, "its residuals are unknown")
    if not campaign.degrees_of_freedom or not own_freedom:
        return ScaledMap(campaign, math.nan, True, "no test for want of degrees of freedom")
    if own < LEAST_SIGMA:
        return ScaledMap(campaign, math.nan, True, "no test, as the readings have no scatter")
    freedoms, ratio = (campaign.degrees_of_freedom, own_freedom), (campaign.estimate / own) ** 2
    p = 2.0 * float(min(fdtr(*freedoms, ratio), fdtrc(*freedoms, ratio)))
    return ScaledMap(campaign, p, p >= LEVEL)
