"""The verdict of a fit that its map keeps, and what is kept of the campaign of an earlier map."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .fit_verdict import LackOfFit, verdict_content, verdict_data, verdict_line
    from .map_prior import LEAST_SIGMA, EarlierCampaign, MapData, MapShare

__getattr__, __dir__ = lazily(__name__, __file__)
