"""How well influence quantities will be known, beside what is stated of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.machines.protocol import Unit

from ..presentation.table_columns import table_lines

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


COLUMNS: dict[str, Any] = {
    "influence quantity": "name",
    "stated uncertainty": (
        lambda one: one.stated if np.isfinite(one.stated) else "unknown",
        3,
    ),
    "with the readings": ("predicted", 3),
    "unit": "unit",
}


def influence_table(found: Sequence[InfluenceUncertainty]) -> list[str]:
    """Lines of text, the first of them where there are many."""
    left = len(found) - MOST_LINES
    more = [f"({left} more are in --json)"] if left > 0 else []
    return [*table_lines(COLUMNS, found[:MOST_LINES]), *more]


def influence_data(found: Sequence[InfluenceUncertainty]) -> dict[str, Any]:
    """The same as plain data, by name."""
    return {
        one.name: {
            "stated_standard_uncertainty": one.stated,
            "standard_uncertainty": one.predicted,
            "unit": one.unit,
        }
        for one in found
    }
