"""Predicted uncertainties of influence quantities, with stated ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.presentation.formatting import Data
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.machines.protocol import Unit

# Rows of a table; displacements of single readings may be thousands.
MOST_LINES = 30


@dataclass(frozen=True)
class InfluenceUncertainty:
    """The standard uncertainty of a parameter of an influence quantity, in its `unit`: `stated`,
    infinite if unknown, and `predicted` with the readings, NaN if undetermined.
    """

    name: str
    unit: Unit
    stated: float
    predicted: float


def influence_uncertainties(at: Linearisation) -> tuple[InfluenceUncertainty, ...]:
    """Return the uncertainties of all estimated parameters of influence quantities."""
    parameters = at.design.influence_parameters
    rows = np.eye(len(at.layout))[at.layout.influences]
    predicted = at.of_shared(rows, rows).tolist() if parameters else []
    return tuple(
        InfluenceUncertainty(parameter.name, parameter.unit, parameter.uncertainty, u)
        for parameter, u in zip(parameters, predicted, strict=True)
    )


COLUMNS: dict[str, Any] = {
    "influence quantity": "name",
    "stated uncertainty": (
        lambda row: row.stated if np.isfinite(row.stated) else "unknown",
        3,
    ),
    "with the readings": ("predicted", 3),
    "unit": "unit",
}


def influence_table(influences: Sequence[InfluenceUncertainty]) -> list[str]:
    """Return up to `MOST_LINES` rows as lines of text."""
    from ballplate.presentation.table_columns import table_lines

    omitted = len(influences) - MOST_LINES
    more = [f"({omitted} more are in --json)"] if omitted > 0 else []
    return [*table_lines(COLUMNS, influences[:MOST_LINES]), *more]


def influence_data(influences: Sequence[InfluenceUncertainty]) -> Data:
    """Return uncertainties of influence quantities as plain data, by name."""
    return {
        influence.name: {
            "stated_standard_uncertainty": influence.stated,
            "standard_uncertainty": influence.predicted,
            "unit": influence.unit,
        }
        for influence in influences
    }
