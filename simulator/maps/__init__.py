"""Fitted maps of machines: estimated errors with their covariance, and what follows from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .fit_verdict import LackOfFit, verdict_data, verdict_line
    from .fitted_map import (
        LEAST_SIGMA,
        FittedMap,
        InCommon,
        MapData,
        readings_in_common,
    )
    from .map_prior import MapShare, campaign_of, determined_combinations, marginal_of

__getattr__, __dir__ = lazily(__name__, __file__)
