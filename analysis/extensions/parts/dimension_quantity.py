"""The quantity `dimensions`: those of the part of an experiment."""

from __future__ import annotations

from ballplate.simulator.design import Design, SharedLayout
from ballplate.simulator.estimation import Functions
from ballplate.uncertainty import QuantityKind


def _dimensions(design: Design, layout: SharedLayout) -> tuple[Functions, ...]:
    if "part" not in design.sections:
        return ()
    from .part_values import laid_in_design

    return (design.once(laid_in_design).combinations,)


QUANTITY = QuantityKind(
    "dimensions of the part",
    _dimensions,
    are_lengths=True,
    by_limits=True,
    is_recorded=False,
    needs="part",
)
