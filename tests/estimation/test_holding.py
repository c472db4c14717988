"""Parameters that are held after the elimination, against designs that never had them."""

from __future__ import annotations

from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.estimation import holding
from ballplate.uncertainty import uncertainties

from tests.reference.small_quickstart import small_sections

INFLUENCES = [
    {"kind": "drift", "axes": {"standard_uncertainty": "1 um/h"}},
    {"kind": "sag", "artefact": "plate", "standard_uncertainty": "1 um"},
]
SIDES = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.2 um"}
TIGHT = {**SIDES, "pairs": "corner diagonals", "standard_uncertainty": "0.001 nm"}


@pytest.mark.parametrize("kept", [(), (0,), (1,)])
@pytest.mark.parametrize("calibration", [[], [SIDES], [SIDES, TIGHT]])
def test_held_influences_are_as_if_never_stated(
    kept: tuple[int, ...], calibration: list[dict[str, Any]]
) -> None:
    sections = small_sections(calibration=calibration)
    # Without a length, the design is deficient; the tight ones make its rows graded.
    few, every = (
        bp.linearise(bp.lay_out(bp.experiment({**sections, **stated})))
        for stated in (
            {"influences": [INFLUENCES[k] for k in kept]} if kept else {},
            {"influences": INFLUENCES},
        )
    )
    assert (every.factor.orders is not None) == (TIGHT in calibration)
    names = {parameter.name for parameter in few.layout.parameters}
    held = [k for k, p in enumerate(every.layout.parameters) if p.name not in names]
    without = holding(every, np.array(held, np.int64))
    assert without.deficiency == few.deficiency == (0 if calibration else few.deficiency)
    assert not without.shared[held].any()
    # Balls as well, whose rows are not eliminated again.
    for symbol, quantity in uncertainties(few).items():
        value = uncertainties(without)[symbol]
        assert value.undetermined == quantity.undetermined, symbol
        for word in ("average", "maximum"):
            assert getattr(value, word) == pytest.approx(
                getattr(quantity, word), rel=1e-8, nan_ok=True
            ), symbol
