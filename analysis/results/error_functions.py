"""Error functions of a fit as curves through the volume, with their standard uncertainties."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.machines.error_names import AXIS_ERRORS
from ballplate.simulator.machines.protocol import Array, HasLines, Unit

from ..presentation.formatting import as_data

# Points of a curve.
POINTS = 21
# Lines of a function that are told; of more the last, which are inside the volume.
MOST_LINES = 3


@dataclass(frozen=True, eq=False)
class EstimatedCurve:
    """An error function along a line: `values` (m,) and their `standard_uncertainties` (m,) in
    `unit`, NaN where undetermined.

    An error is where the tip is less where the scales say: the correction to be added to a reading.
    `positions` (m,) are co-ordinates along `axis` in metres or, where `position_unit` is 1, parts
    of the line, which `along` names. What is the same everywhere has one value.
    """

    name: str
    meaning: str
    along: str
    unit: Unit
    axis: str
    position_unit: Unit
    positions: Array
    values: Array
    standard_uncertainties: Array

    def to_dict(self) -> dict[str, Any]:
        """As plain data in metres, radians and ratios; what is undetermined is None."""
        found: dict[str, Any] = as_data(self)
        return found


@single_threaded
def estimated_curves(at: Linearisation, sigma: float = 1.0) -> tuple[EstimatedCurve, ...]:
    """The curves of all error functions, none of a model that offers no lines; `sigma` multiplies
    all stated uncertainties.
    """
    model = at.design.model
    if not isinstance(model, HasLines):
        return ()
    parameters = model.parameters
    t = np.linspace(0.0, 1.0, POINTS)
    found = []
    for name in dict.fromkeys(one.function for one in parameters):
        members = [k for k, one in enumerate(parameters) if one.function == name]
        rows = np.zeros((len(t), len(at.layout)))
        lines = model.lines(name, t)
        # Those along the edges come first.
        for line in lines if len(lines) <= MOST_LINES else lines[-MOST_LINES:]:
            rows[:, at.layout.model.start + np.array(members)] = line.basis
            values, u = line.basis @ at.state.a[members], sigma * at.of_shared(rows)
            kept = slice(None) if np.ptp(line.basis, axis=0).any() else slice(1)
            axis, unit, places = _places(at, name, t)
            first = parameters[members[0]]
            found.append(
                EstimatedCurve(
                    name,
                    first.meaning,
                    line.words,
                    first.unit,
                    axis,
                    unit,
                    places[kept],
                    np.where(np.isnan(u), np.nan, values)[kept],
                    u[kept],
                )
            )
    return tuple(found)


def _places(at: Linearisation, name: str, t: Array) -> tuple[str, Unit, Array]:
    """Axis, unit and places (m,) of the points of a function that depends on one axis only."""
    error = AXIS_ERRORS.get(name)
    volume = at.design.machine.volume
    if error is None or error.axis >= len(volume.lower):
        return "", "1", t
    return "xyz"[error.axis], "m", volume.lower[error.axis] + t * volume.size[error.axis]
