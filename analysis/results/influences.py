"""How well influence quantities will be known, beside what is stated of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.machines.protocol import Unit

from ..presentation.formatting import aligned, amount_of, finite, number

# Lines of a table; displacements of single readings may be thousands.
MOST_LINES = 30


@dataclass(frozen=True)
class InfluenceUncertainty:
    """The standard uncertainty of a parameter of an influence quantity, in its `unit`: as `stated`,
    infinite where it is unknown, and as `predicted` with the readings, NaN where undetermined.
    """

    name: str
    unit: Unit
    stated: float
    predicted: float


def influence_uncertainties(at: Linearisation) -> tuple[InfluenceUncertainty, ...]:
    """Those of all parameters of influence quantities that are no constants."""
    parameters = at.design.influence_parameters
    rows = np.eye(len(at.layout))[at.layout.influences]
    predicted = at.of_shared(rows, rows).tolist() if parameters else []
    return tuple(
        InfluenceUncertainty(one.name, one.unit, one.uncertainty, u)
        for one, u in zip(parameters, predicted, strict=True)
    )


def influence_table(found: Sequence[InfluenceUncertainty]) -> list[str]:
    """Lines of text, the first of them where there are many."""
    rows = [["influence quantity", "stated uncertainty", "with the readings", "unit"]]
    for one in found[:MOST_LINES]:
        stated, unit = amount_of(one.stated, one.unit)
        u, _ = amount_of(one.predicted, one.unit)
        known = number(stated, 3) if np.isfinite(stated) else "unknown"
        rows.append([one.name, known, number(u, 3), unit])
    left = len(found) - MOST_LINES
    more = [f"({left} more are in --json)"] if left > 0 else []
    return [*aligned(rows, [False, True, True, False]), *more]


def influence_data(found: Sequence[InfluenceUncertainty]) -> dict[str, Any]:
    """The same as plain data, by name."""
    return {
        one.name: {
            "stated_standard_uncertainty": finite(one.stated),
            "standard_uncertainty": finite(one.predicted),
            "unit": one.unit,
        }
        for one in found
    }
