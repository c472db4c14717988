"""Uncertainties of quantities that the parameters determine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .kernel_quantities import evaluation_points
    from .pairs import open_above, pair_tiles, pairs_of, relative
    from .quantities import DESCRIPTIONS, QUANTITIES, RECORDED, RECORDED_IF_TOLD, functions_of
    from .scale import (
        OFFSET_TRIAL,
        OWN_SCALES,
        can_stretch,
        exact_offsets,
        lengths_with_offsets,
        scale_of,
        stretches,
        with_offsets,
    )
    from .summaries import Quantity, summarise, uncertainties
    from .tasks import expansion

__getattr__, __dir__ = lazily(__name__, __file__)
