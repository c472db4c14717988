# Public names of this package, each loaded from its module when it is first used.
from .named_values import (
    FRACTIONS as FRACTIONS,
    NamedUncertainty as NamedUncertainty,
    combined_uncertainties as combined_uncertainties,
    expansion as expansion,
    member_root as member_root,
)
from .pairs import (
    open_above as open_above,
    pair_tiles as pair_tiles,
    pairs_of as pairs_of,
    relative as relative,
)
from .quantities import (
    DESCRIPTIONS as DESCRIPTIONS,
    QUANTITIES as QUANTITIES,
    RECORDED as RECORDED,
    RECORDED_IF_TOLD as RECORDED_IF_TOLD,
    QuantityKind as QuantityKind,
    evaluation_points as evaluation_points,
    functions_of as functions_of,
)
from .scale import (
    OFFSET_TRIAL as OFFSET_TRIAL,
    OWN_SCALES as OWN_SCALES,
    can_stretch as can_stretch,
    exact_offsets as exact_offsets,
    lengths_with_offsets as lengths_with_offsets,
    scale_of as scale_of,
    stretches as stretches,
    with_offsets as with_offsets,
)
from .summaries import Quantity as Quantity, summarise as summarise, uncertainties as uncertainties
