# Public names of this package, each loaded from its module when it is first used.
from .fit_verdict import (
    LackOfFit as LackOfFit,
    verdict_content as verdict_content,
    verdict_data as verdict_data,
    verdict_line as verdict_line,
)
from .map_prior import (
    LEAST_SIGMA as LEAST_SIGMA,
    EarlierCampaign as EarlierCampaign,
    MapData as MapData,
    MapShare as MapShare,
)
